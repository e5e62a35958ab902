"""What a process of the campaign has done so far, in files that outlive its death."""

from __future__ import annotations

import hashlib
import json
import resource
from pathlib import Path

from fuzzing.oracle import FINDING, Outcome
from fuzzing.target import ACCEPTED, REFUSED, SET_ASIDE

Counts = dict[str, float]
_EMPTY: Counts = {"inputs": 0, ACCEPTED: 0, REFUSED: 0, SET_ASIDE: 0, FINDING: 0, "slowest_s": 0.0, "peak_mb": 0.0}


class Tally:
    """Counts of one target in `folder`, the input that is in use, and one file per cause of a finding."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.counts = read_counts(folder)
        self.before_mb = peak_mb()

    def begin(self, data: bytes) -> None:
        (self.folder / "current").write_bytes(data)

    def end(self, data: bytes, outcome: Outcome, cpu_s: float) -> None:
        """`peak_mb` is above what the libraries themselves take."""
        self.counts["inputs"] += 1
        self.counts[outcome.kind] += 1
        if cpu_s > self.counts["slowest_s"]:
            self.counts["slowest_s"] = cpu_s
            (self.folder / "slowest").write_bytes(data)
        self.counts["peak_mb"] = max(self.counts["peak_mb"], peak_mb() - self.before_mb)
        if outcome.kind == FINDING:
            keep(self.folder, data, outcome.where, outcome.detail)
        self._write()

    def _write(self) -> None:
        new = self.folder / "counts.new"
        new.write_text(json.dumps(self.counts))
        new.replace(self.folder / "counts.json")


def keep(folder: Path, data: bytes, where: str, detail: str) -> None:
    """The smallest input of each cause, for reproduction."""
    name = f"finding-{hashlib.sha256(where.encode()).hexdigest()[:10]}"
    file = folder / name
    if not file.exists() or file.stat().st_size > len(data):
        file.write_bytes(data)
        (folder / f"{name}.txt").write_text(f"{where}\n\n{detail}", encoding="utf-8", errors="backslashreplace")


def read_counts(folder: Path) -> Counts:
    file = folder / "counts.json"
    return dict(_EMPTY) | (json.loads(file.read_text()) if file.exists() else {})


def peak_mb() -> float:
    """ru_maxrss is in KiB on Linux."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
