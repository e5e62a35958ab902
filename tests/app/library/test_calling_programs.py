"""A recording whose library may crash is read in a process of its own, whatever the program is that
asks for it."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support.records.campaigns import (
    FS_HZ,
    blows,
    force_record,
    hammer_campaign,
    hammer_rows,
    write_runs,
)

#: No `if __name__ == "__main__"`: a process that imports the program would run it again, and print
#: another line.
PROGRAM = """
import json
import pyroshock as ps

ingested = ps.open({url!r}, create=True).ingest({folder!r})
print(json.dumps([ingested.added["recordings"], ingested.report.set_aside]))
"""
NOTEBOOK = """
import sys
exec(compile({program!r}, "<ipython-input-1>", "exec"), {{"__name__": "__main__"}})
"""
#: libhdf5 reads an attribute of it for ever (tests/fuzzing).
ENDLESS = Path(__file__).parents[2] / "fuzzing" / "samples" / "hdf5-without-end.h5.gz"


def hdf5_campaign(folder: Path, *, damaged: bool = False) -> Path:
    """Two recordings, HDF5 and MATLAB 7.3, which is HDF5 behind 512 bytes; with `damaged` a third
    one."""
    hammer_campaign(folder, recordings=3 if damaged else 2)
    rows = hammer_rows(3 if damaged else 2)
    for run, (name, before) in enumerate({"one.h5": 0, "two.mat": 512}.items(), 1):
        with h5py.File(folder / "recordings" / name, "w", userblock_size=before) as file:
            file["fs"] = FS_HZ
            file["force"] = force_record(blows(run, 2), np.random.default_rng(run))
        if before:
            with (folder / "recordings" / name).open("r+b") as raw:
                raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    if damaged:
        (folder / "recordings" / "three.h5").write_bytes(gzip.decompress(ENDLESS.read_bytes()))
    names = {1: "one.h5", 2: "two.mat", 3: "three.h5"}
    write_runs(
        folder, [{**row, "recording": f"recordings/{names[int(str(row['run']))]}"} for row in rows]
    )
    return folder


def printed(way: str, program: str, folder: Path) -> list[Any]:
    """What the program prints, once, when it is given to Python in this way; nothing goes to its
    error output."""
    (folder / "program.py").write_text(program, encoding="utf-8")
    arguments, text = {
        "standard input": (["-"], program),
        "-c": (["-c", program], None),
        "script": (["program.py"], None),
        "module": (["-m", "program"], None),
        "notebook": (["-"], NOTEBOOK.format(program=program)),
    }[way]
    done = subprocess.run(
        [sys.executable, *arguments],
        input=text,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    (line,) = done.stdout.splitlines()
    return list(json.loads(line))


SLOW = [pytest.param(way, marks=pytest.mark.slow) for way in ("-c", "module", "notebook")]


@pytest.mark.parametrize("way", ["standard input", "script", *SLOW])
def test_a_program_is_run_once_and_ingests_hdf5(way, tmp_path):
    program = PROGRAM.format(
        url=f"sqlite:///{tmp_path / 'lab.db'}", folder=str(hdf5_campaign(tmp_path / "c"))
    )
    assert printed(way, program, tmp_path) == [2, []]


def test_a_program_from_standard_input_is_told_which_file_is_damaged(tmp_path):
    folder = hdf5_campaign(tmp_path / "c", damaged=True)
    program = PROGRAM.format(url=f"sqlite:///{tmp_path / 'lab.db'}", folder=str(folder))
    added, set_aside = printed("standard input", program, tmp_path)
    assert added == 2
    assert [recording["recording"] for recording in set_aside] == ["recordings/three.h5"]
    assert "the library that reads it was crashed by it, or did not end" in set_aside[0]["reason"]
