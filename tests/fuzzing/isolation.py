"""Whether a recording that crashes a library in its own process leaves an ingest whole."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from fuzzing import seeds
from fuzzing.mutations import folders
from support.stores.stores import start_cli

#: On a machine that has other work; the limits of the ingest are of processor time.
_PATIENCE_S = 300


def is_set_aside(data: bytes, name: str) -> bool:
    """A campaign with this recording and a good one is ingested: the good one stored, this one set aside or stored."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "campaign"
        folder.mkdir()
        folders.write(seeds.hammer_folders("npz")[0], folder)
        (folder / name).write_bytes(data)
        with (folder / "runs.csv").open("a") as runs:
            runs.write(seeds.HAMMER_RUNS.format(name).splitlines()[1].replace("1,1,", "2,1,", 1) + "\n")
        process = start_cli("ingest", folder, "--db", f"sqlite:///{scratch}/lab.db", "--json")
        out, _ = process.communicate(timeout=_PATIENCE_S)
    if process.returncode != 0:
        return False
    report = json.loads(out)
    return bool(report["recordings"] + len(report["set_aside"]) == 2)
