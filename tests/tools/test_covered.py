"""The table of `make coverage`, on figures made by hand and on a count of a small program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tools.covered import ROOT, Covered, below, by_file, by_room, floor_text, page_text

FILES = [
    Covered("ingest/folder/campaign_file.py", 100, 90, 40, 38),
    Covered("ingest/readers/csv.py", 50, 50, 10, 10),
    Covered("twin/ode.py", 20, 5, 0, 0),
    Covered("__init__.py", 1, 1, 0, 0),
]


def test_rooms_are_summed_held_to_floors_and_written_to_the_page() -> None:
    ingest, twin, everything = by_room(FILES)
    assert (ingest.name, ingest.statements, ingest.statements_run, ingest.branches_run) == (
        "ingest",
        150,
        140,
        48,
    )
    assert ingest.percent == pytest.approx(100 * 188 / 200) and (twin.name, twin.percent) == (
        "twin",
        25.0,
    )
    assert (everything.name, everything.statements) == ("all", 171)
    rooms = by_room(FILES)
    assert list(below(rooms, {"ingest": 94.0, "twin": 25.0, "all": 80.0})) == []
    low, unknown = below(rooms, {"ingest": 94.1, "all": 80.0})
    assert low == "ingest: 94.00 % covered, under its floor of 94.1 %" and unknown.startswith(
        "twin: no floor"
    )
    floor = tomllib.loads(floor_text(by_room(FILES)))
    assert (
        floor == {"ingest": 93.0, "twin": 24.0, "all": 86.8}
        and list(below(by_room(FILES), floor)) == []
    )
    page = "# Coverage\n<!-- rooms: written by make coverage -->\nold\n<!-- end of rooms -->\nend\n"
    once = page_text(page, by_room(FILES), "2026-11-22")
    assert once.startswith("# Coverage\n") and once.endswith("-->\nend\n") and "old" not in once
    assert "| `ingest` | 140 of 150 | 48 of 50 | 94.0 % |" in once
    assert page_text(once, by_room(FILES), "2026-11-22") == once
    with pytest.raises(ValueError, match="expected <!-- rooms"):
        page_text("# Coverage\n", by_room(FILES), "2026-11-22")


def test_report_of_coverage_py_is_read(tmp_path: Path) -> None:
    """One branch of two, and three statements of four, of a program that is run."""
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "one.py").write_text(
        "import sys\nx = 1\nif len(sys.argv) > 5:\n    x = 2\n"
    )
    for words in (["run", "--branch", "room/one.py"], ["json", "-q", "-o", "out.json"]):
        subprocess.run(
            [sys.executable, "-m", "coverage", *words], cwd=tmp_path, env=_outside(), check=True
        )
    (file,) = by_file(json.loads((tmp_path / "out.json").read_text()))
    assert file == Covered("room/one.py", 4, 3, 2, 1)


#: Writes what a run has counted to the file of $COVERAGE_FILE, and tells the files of the report on
#: it.
_REPORT = """
import os, sys
from coverage import CoverageData
from tools.covered import by_file, counted
data = CoverageData(os.environ["COVERAGE_FILE"])
data.add_arcs({path: {(-1, 1), (1, 2)} for path in sys.argv[1:]})
data.write()
print(*(file.name for file in by_file(counted())))
"""


def test_what_was_run_in_a_folder_that_is_gone_is_not_counted(tmp_path: Path) -> None:
    """Tests of `make mutants` run a copy of the tree: the report ended in an error for want of its
    sources.

    In a process of its own: a second count beside the one that counts this test damages what that
    one has found.
    """
    paths = [str(ROOT / "twin" / "ode.py"), str(tmp_path / "gone" / "pyroshock" / "ode.py")]
    done = subprocess.run(
        [sys.executable, "-c", _REPORT, *paths],
        cwd=ROOT,
        env=_outside() | {"COVERAGE_FILE": str(tmp_path / "counted")},
        capture_output=True,
        text=True,
        check=True,
    )
    files = done.stdout.split()
    assert "twin/ode.py" in files and not any("gone" in name for name in files)


def _outside() -> dict[str, str]:
    """The environment of a process that is not counted by, or into, what counts this test."""
    return {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE")}
