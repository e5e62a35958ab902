"""Modules that lie in the working directory are not imported, whatever they are called, by no
process that we start."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import h5py
import numpy as np
import pytest
from pyroshock.parallel.working_directory import working_directory_closed
from support.processes.planted import planted, ran
from support.records.campaigns import gun_campaign, hammer_campaign, recording_name, replace_in
from support.stores.hammer_stores import full_campaign
from support.stores.stores import counts, pyroshock

#: What `pyroshock` is where it is installed: Python then has the folder of this file on its path,
#: not the working one.
PROGRAM = (
    "import sys\nfrom pyroshock.app.doors.command_line.main import main\nif __name__ == "
    "'__main__':\n    sys.exit(main())\n"
)
SCRIPT = """
import os, sys
sys.path.append({tests!r})
from pyroshock.parallel.map_tasks import ExecutorConfig
from pyroshock.parallel.map_tasks import run_all_tasks
from support.processes import chores

if __name__ == "__main__":
    squares = dict(run_all_tasks(ExecutorConfig(jobs=2), chores.squared, range(4)))
    print(squares[3], os.environ.get("PYTHONSAFEPATH"))
"""
TESTS = Path(__file__).resolve().parents[1]
PATIENCE_S = 90.0


def as_hdf5(folder: Path) -> Path:
    """The campaign's first recording as HDF5, which is read in a process of its own, for it could
    crash its reader."""
    with (
        np.load(folder / recording_name(1)) as given,
        h5py.File(folder / "recordings" / "test-01.h5", "w") as file,
    ):
        for name in given.files:
            file[name] = given[name]
    (folder / recording_name(1)).unlink()
    replace_in(folder / "runs.csv", recording_name(1), "recordings/test-01.h5")
    return folder


def environment(db: str) -> dict[str, str]:
    """As a user has it: nothing says yet that the working directory is closed."""
    kept = {
        k: v
        for k, v in os.environ.items()
        if not k.startswith(("PYTHONSAFEPATH", "NUMBA", "MLFLOW"))
    }
    return kept | {"PYROSHOCK_DB": db}


@pytest.fixture
def program(tmp_path: Path) -> list[str]:
    file = tmp_path / "bin" / "pyroshock"
    file.parent.mkdir()
    file.write_text(PROGRAM, encoding="utf-8")
    return [sys.executable, str(file)]


def done(command: list[str], db: str, cwd: Path) -> str:
    how = {"capture_output": True, "text": True, "timeout": PATIENCE_S, "check": False}
    result = subprocess.run(command, cwd=cwd, env=environment(db), **how)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def test_a_planted_module_would_run(tmp_path: Path) -> None:
    """Else the tests below show nothing."""
    (tmp_path / "c").mkdir()
    trap = planted(tmp_path / "c")
    done([sys.executable, "-c", "import copy"], "", tmp_path / "c")
    assert "copy" in ran(trap).split()


@pytest.fixture
def db(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'lab.db'}"


def test_ingest_and_extract_import_nothing_from_a_campaign_folder(
    tmp_path: Path, program: list[str], db: str
) -> None:
    """The processes that read ahead, and those of joblib."""
    folder = hammer_campaign(tmp_path / "c", recordings=3, hits=2)
    trap = planted(folder)
    done([*program, "ingest", ".", "--jobs", "2"], db, folder)
    assert (ran(trap), counts(db)["impacts"]) == ("", 6)
    done([*program, "extract", "hammer", "--threshold", "0.01", "--jobs", "2"], db, folder)
    assert ran(trap) == ""


def test_the_process_of_one_file_imports_nothing_from_its_folder(
    tmp_path: Path, program: list[str], db: str
) -> None:
    folder = as_hdf5(hammer_campaign(tmp_path / "c", recordings=1, hits=1))
    trap = planted(folder)
    asked = ["recordings/test-01.h5", "--channel", "force", "--unit", "m/s2", "--json"]
    done([*program, "srs", *asked], db, folder)
    assert ran(trap) == ""


def test_python_m_imports_nothing_from_a_campaign_folder(tmp_path: Path, db: str) -> None:
    """Nothing after our first line, that is: Python itself looks there before it
    (docs/explanation/threats.md)."""
    folder = hammer_campaign(tmp_path / "c", recordings=3, hits=2)
    trap = planted(folder)
    for name in ("importlib", "pkgutil", "runpy", "types", "warnings"):
        (folder / f"{name}.py").unlink()
    done([sys.executable, "-m", "pyroshock", "ingest", ".", "--jobs", "2"], db, folder)
    assert (ran(trap), counts(db)["impacts"]) == ("", 6)
    campaign = json.loads(
        done([sys.executable, "-m", "pyroshock", "campaigns", "--json"], db, folder)
    )
    assert campaign[0]["name"] == "hammer"


@pytest.mark.slow
def test_train_imports_nothing_from_the_working_directory(
    tmp_path: Path, program: list[str], db: str
) -> None:
    folder = full_campaign(tmp_path / "c")
    assert pyroshock("ingest", folder, "--db", db).exit_code == 0
    assert (
        pyroshock(
            "dataset", "build", "spring", "--from", "spring", "--quality", "none", "--db", db
        ).exit_code
        == 0
    )
    trap = planted(folder)
    done([*program, "train", "spring", "--models", "hann,linear", "--jobs", "2"], db, folder)
    assert ran(trap) == ""


def test_diagnose_takes_no_module_or_compiled_code_from_there(
    tmp_path: Path, program: list[str], db: str
) -> None:
    """numba would take the folder of its cache from a file there, and unpickle what lies in it."""
    folder = gun_campaign(tmp_path / "c", name="spring")
    trap = planted(folder)
    (folder / ".numba_config.yaml").write_text("cache_dir: planted-cache\n", encoding="utf-8")
    done([*program, "diagnose", ".", "--with", "gun.blow_by", "--json"], db, folder)
    assert (ran(trap), (folder / "planted-cache").exists()) == ("", False)


def test_jobs_of_the_window_import_nothing_from_a_campaign_folder(
    tmp_path: Path, program: list[str], db: str
) -> None:
    """The server was started in the folder that it is to ingest."""
    folder = as_hdf5(hammer_campaign(tmp_path / "c", recordings=3, hits=2))
    trap = planted(folder)
    command = [*program, "serve", "--data", ".", "--port", "0", "--db", db]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=folder, env=environment(db), text=True, **pipes) as server:
        ended = threading.Timer(PATIENCE_S, server.kill)
        ended.start()
        try:
            address = server.stderr.readline().removeprefix("pyroshock: ").strip()
            browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
            csrf = json.load(browser.open(f"{address}api/csrf"))["token"]
            body = json.dumps({"path": "."}).encode()
            headers = {"X-CSRF-Token": csrf, "Content-Type": "application/json"}
            job = json.load(
                browser.open(urllib.request.Request(f"{address}api/ingest", body, headers))
            )["id"]
            state = "waiting"
            while state not in ("done", "failed", "stopped") and server.poll() is None:
                time.sleep(0.1)
                state = json.load(browser.open(f"{address}api/jobs/{job}"))["state"]
        finally:
            server.terminate()
            server.communicate()
            ended.cancel()
    assert (ran(trap), state, counts(db)["impacts"]) == ("", "done", 6)


def test_processes_of_a_script_import_nothing_from_the_working_directory(tmp_path: Path) -> None:
    """A library's user has closed nothing; what we add to the environment is gone afterwards."""
    (tmp_path / "c").mkdir()
    trap, script = planted(tmp_path / "c"), tmp_path / "script.py"
    script.write_text(SCRIPT.format(tests=str(TESTS)), encoding="utf-8")
    assert (
        done([sys.executable, str(script)], "", tmp_path / "c").split() == ["9", "None"]
        and ran(trap) == ""
    )


def test_blocks_within_blocks_leave_the_environment_as_it_was(monkeypatch) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/var/cache/numba")
    with working_directory_closed():
        with working_directory_closed():
            pass
        assert (os.environ["PYTHONSAFEPATH"], os.environ["NUMBA_CACHE_DIR"]) == (
            "1",
            "/var/cache/numba",
        )
    assert ("PYTHONSAFEPATH" in os.environ, os.environ["NUMBA_CACHE_DIR"]) == (
        False,
        "/var/cache/numba",
    )
