"""What each command loads: a command that lists, shows or refuses starts in half a second."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from shutil import copyfile

import pyroshock
import pytest
from pyroshock.app.operations.plan.planning import make_plan
from support.stores.care_stores import HAMMER
from support.stores.hammer_stores import url_of
from support.stores.stores import opened

EXAMPLES = Path(pyroshock.__file__).parent / "examples"
RECORD = EXAMPLES / "modal-hammer-hit" / "recordings" / "acceleration.lvm"

#: Libraries whose import takes a tenth of a second or more.
HEAVY = (
    *("fastapi", "jinja2", "llvmlite", "matplotlib", "mlflow", "numba", "numpy", "pandas", "pint"),
    *("pyarrow", "scipy", "sklearn", "sqlalchemy", "starlette", "torch"),
)
STORE = ("sqlalchemy",)
ARRAYS = ("numpy",)
COMPILED = ("llvmlite", "numba", "scipy")

#: Commands and the heavy libraries that each may load, lighter commands first: one process runs
#: all of a list, so that a command finds what those before it have loaded.
LISTS: dict[str, list[tuple[str, tuple[str, ...]]]] = {
    "refused by the request": [
        ("predict --bullet-mass -1kg", ()),
        ("predict --tank-pressure 5", ()),
        ("predict --insulator polymeric", ()),
        ("promote tree@one --reason x", ()),
        ("plan lhs autumn --runs 0", ARRAYS),
        # pint imports dask, where it is installed
        ("predict --tank-pressure 5parsec", (*ARRAYS, "pint", "jinja2", "scipy")),
    ],
    "answered by the store": [
        ("query 'select count(*) from impacts'", STORE),
        ("impacts --where peak_force_n>1", STORE),
        ("impacts list", STORE),
        ("impacts show 1", STORE),
        ("show 1", STORE),
        ("campaigns list", STORE),
        ("plan list", STORE),
        ("plan status sheets", STORE),
        ("plan predictions sheets", STORE),
        ("plan sheet sheets --out sheets.html", STORE),
        ("predict --plan no-such-plan", STORE),
        ("predict --campaign no-such-campaign", STORE),
        ("predict --tip no-such-material", STORE),
        ("views list", STORE),
        ("home list", STORE),
        ("plan factorial sheets", (*STORE, *ARRAYS)),
        ("predict --impact-position #99", (*STORE, *ARRAYS)),
        ("explore --kind control", (*STORE, *ARRAYS)),
        (f"predict --campaign {HAMMER}", (*STORE, *ARRAYS)),  # it has no gun, and needs a velocity
        ("train no-such-dataset --models linear", (*STORE, *ARRAYS)),
    ],
    "computed": [("srs record.lvm", (*ARRAYS, *COMPILED))],
}

#: Runs the commands of a file, a list of words in each line, and writes what each has loaded.
CHILD = """
import json, sys
from click.exceptions import Exit
from pyroshock.app.doors.command_line.main import main
commands, heavy, loaded = (sys.argv[1], set(sys.argv[2].split(",")), open(sys.argv[3], "w"))
for line in open(commands):
    try:
        main(json.loads(line), standalone_mode=False)
    except Exit:
        pass  # a refusal: what it has loaded until then counts
    print(json.dumps(sorted(heavy & sys.modules.keys())), file=loaded)
"""

#: Where the last command is the process's own, as of the program `pyroshock`.
OWN = """
import atexit, gc, sys
atexit.register(lambda: print(gc.isenabled(), gc.get_freeze_count() > 0))
sys.argv = ["pyroshock", "query", "select 1"]
from pyroshock.app.doors.command_line.main import main
main()
"""


def _run(code: str, *words: str, folder: Path, store: str) -> str:
    process = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=folder,
        env={**os.environ, "PYROSHOCK_DB": store},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


@pytest.fixture(scope="module")
def store(care_source, tmp_path_factory):
    """The address of a store with impacts and a plan."""
    place = tmp_path_factory.mktemp("imports") / "lab.db"
    copyfile(care_source / "lab.db", place)
    with opened(url_of(place)) as copied:
        make_plan(copied, "factorial", "sheets", kind="hammer")
    return url_of(place)


@pytest.mark.parametrize("name", LISTS)
def test_a_command_loads_no_library_that_it_does_not_need(name, store, tmp_path):
    (tmp_path / "record.lvm").symlink_to(RECORD)
    commands = tmp_path / "commands"
    commands.write_text("\n".join(json.dumps(shlex.split(line)) for line, _ in LISTS[name]))
    _run(CHILD, str(commands), ",".join(HEAVY), "loaded", folder=tmp_path, store=store)
    loaded = (tmp_path / "loaded").read_text().splitlines()
    for (line, may_load), names in zip(LISTS[name], loaded, strict=True):
        assert set(json.loads(names)) <= set(may_load), line


def test_memory_is_searched_for_garbage_while_a_command_works_and_not_at_its_end(store, tmp_path):
    printed = _run(OWN, folder=tmp_path, store=store)
    assert printed.splitlines()[-1] == "True True"
