"""The long run: every target in processes of its own, begun anew where an input ends one; a table
at the end."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from fuzzing import seeds, worker
from fuzzing.mutations import folders
from fuzzing.target import ACCEPTED, REFUSED, SET_ASIDE, Target
from fuzzing.worker import Counts, keep, read_counts
from support.stores.stores import start_cli

LEAST_INPUTS = 3000
_MOST_DEATHS = 2000
#: An ingest takes seconds: so many of those that end by the same signal are given to one.
_VERIFIED = 8
_TITLES = (
    *(
        "target",
        "inputs",
        ACCEPTED,
        REFUSED,
        SET_ASIDE,
        "ended their process",
        "of them tried by an ingest",
    ),
    *("findings", "slowest s", "peak MB", "lines reached"),
)


@dataclass(frozen=True)
class Row:
    """What came of a target. `crashes` are inputs that ended their process; `survived` of them an
    ingest set aside."""

    target: str
    counts: Counts
    crashes: int
    survived: int
    findings: tuple[str, ...]
    coverage: str = ""


def run(targets: Iterable[Target], inputs: int, folder: Path, seed: int, jobs: int) -> list[Row]:
    """At least `LEAST_INPUTS` of `inputs` for each target (fewer where `inputs` are), the rest by
    weight."""
    chosen = list(targets)
    shares = shares_of(chosen, inputs)
    with ThreadPoolExecutor(jobs) as pool:
        return list(
            pool.map(lambda t: _one(t, shares[t.name], folder / slug(t.name), seed), chosen)
        )


def shares_of(targets: list[Target], inputs: int) -> dict[str, int]:
    """Inputs of each target, in all at least `inputs`."""
    total = sum(target.weight for target in targets)
    least = min(LEAST_INPUTS, -(-inputs // len(targets)))
    shares = {target.name: max(least, int(inputs * target.weight / total)) for target in targets}
    first = targets[0].name
    return shares | {first: shares[first] + max(0, inputs - sum(shares.values()))}


def slug(name: str) -> str:
    return name.lower().replace(" ", "-")


def _one(target: Target, inputs: int, folder: Path, seed: int) -> Row:
    folder.mkdir(parents=True, exist_ok=True)
    for death in range(_MOST_DEATHS):
        code = _process(target.name, inputs, seed + death, folder)
        if code == 0:
            break
        _note_death(target, folder, code)
    row = row_of(target, folder)
    print(json.dumps(asdict(row)), flush=True)
    return row


def _process(name: str, inputs: int, seed: int, folder: Path) -> int:
    """The exit code; negative for a signal."""
    (folder / "current").unlink(missing_ok=True)
    process = multiprocessing.get_context("fork").Process(
        target=worker.work, args=(name, inputs, seed, folder)
    )
    process.start()
    process.join()
    with suppress(ProcessLookupError):  # what it started itself, and did not live to end
        os.killpg(process.pid or 0, signal.SIGKILL)
    return process.exitcode or 0


def _note_death(target: Target, folder: Path, code: int) -> None:
    """Keep the input that ended the process, and whether the ingest of a folder with it goes on."""
    if not (folder / "current").exists():
        raise RuntimeError(
            f"{target.name}: its process ends before the first input; see {folder / 'log.txt'}"
        )
    data = (folder / "current").read_bytes()
    fate = _fate(target, folder, code, data)
    (folder / f"death-{len(_deaths(folder))}-{code}-{fate}").write_bytes(data)
    if fate == "lost":
        what = {-signal.SIGPROF: "too much processor time", -signal.SIGALRM: "too long"}.get(
            code, f"exit code {code}"
        )
        keep(folder, data, f"the process ended: {what}", f"exit code {code}")
    counts = read_counts(folder)
    counts["inputs"] += 1
    (folder / "counts.json").write_text(json.dumps(counts))


def _fate(target: Target, folder: Path, code: int, data: bytes) -> str:
    """survived: an ingest set it aside; alike: as others that ended by the same signal; lost: a
    finding."""
    if not target.may_crash:
        return "lost"
    if len([file for file in _deaths(folder) if f"-{code}-" in file.name]) >= _VERIFIED:
        return "alike"
    return "survived" if is_set_aside(data, target.names) else "lost"


def _deaths(folder: Path) -> list[Path]:
    return list(folder.glob("death-*"))


def row_of(target: Target, folder: Path) -> Row:
    """As far as the run has come."""
    findings = sorted(file.read_text().split("\n")[0] for file in folder.glob("finding-*.txt"))
    survived = sum(file.name.endswith("survived") for file in _deaths(folder))
    return Row(target.name, read_counts(folder), len(_deaths(folder)), survived, tuple(findings))


def markdown(rows: list[Row]) -> str:
    """The table of the documentation."""
    lines = [f"| {' | '.join(_TITLES)} |", "| --- |" + " ---: |" * (len(_TITLES) - 1)]
    for row in rows:
        cells = [f"{int(row.counts[key]):,}" for key in ("inputs", ACCEPTED, REFUSED, SET_ASIDE)]
        cells += [str(number) for number in (row.crashes, row.survived, len(row.findings))]
        cells += [f"{row.counts['slowest_s']:.2f}", f"{row.counts['peak_mb']:.0f}", row.coverage]
        lines.append("| " + " | ".join([row.target, *cells]) + " |")
    inputs, found = (
        sum(int(row.counts["inputs"]) for row in rows),
        sum(len(row.findings) for row in rows),
    )
    return "\n".join([*lines, f"| all | {inputs:,} |  |  |  |  |  | {found} |  |  |  |"])


#: On a machine that has other work; the limits of the ingest are of processor time.
_PATIENCE_S = 300


def is_set_aside(data: bytes, name: str) -> bool:
    """A campaign with this recording and a good one is ingested: the good one stored, this one set
    aside or stored."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "campaign"
        folder.mkdir()
        folders.write(seeds.hammer_folders("npz")[0], folder)
        (folder / name).write_bytes(data)
        with (folder / "runs.csv").open("a") as runs:
            runs.write(
                seeds.HAMMER_RUNS.format(name).splitlines()[1].replace("1,1,", "2,1,", 1) + "\n"
            )
        process = start_cli("ingest", folder, "--db", f"sqlite:///{scratch}/lab.db", "--json")
        out, _ = process.communicate(timeout=_PATIENCE_S)
    if process.returncode != 0:
        return False
    report = json.loads(out)
    return bool(report["recordings"] + len(report["set_aside"]) == 2)
