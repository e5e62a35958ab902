"""The wheel holds the whole product and nothing else, and the command starts without its heavy
parts."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import sysconfig
import time
import tomllib
import zipfile
from pathlib import Path
from shutil import copytree, ignore_patterns

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
NOT_SHIPPED = ("tests", "benchmarks", "docs", "deploy", "tools")
NOT_SOURCE = (".*", "__pycache__", "*.egg-info", "build", "dist", "results")
HEAVY_MODULES = ("torch", "mlflow", "matplotlib", "pandas", "scipy.signal")
HELP_LIMIT_S = 0.5
DATA_FILES = ("py.typed", "schema/data/*.csv", "schema/migrations/**/*.py", "examples/**/*")

IMPORT_EVERYTHING = """
import importlib, json, pkgutil
import pyroshock
modules = pkgutil.walk_packages(pyroshock.__path__, "pyroshock.")
names = ["pyroshock", *(module.name for module in modules)]
names.remove("pyroshock.schema.migrations.env")  # a script: runs only inside Alembic
print(json.dumps({name: importlib.import_module(name).__file__ for name in names}))
"""

LOADED_BY_COMMAND = """
import json, sys
import pyroshock.app.doors.command_line.main
print(json.dumps(sorted(sys.modules)))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel built from a copy of the sources, so that no leftover of an earlier build gets
    in."""
    work = tmp_path_factory.mktemp("wheel")
    source = copytree(REPOSITORY, work / "source", ignore=ignore_patterns(*NOT_SOURCE))
    build = [
        sys.executable,
        "-m",
        "build",
        "--wheel",
        "--no-isolation",
        "--outdir",
        str(work / "dist"),
    ]
    run([*build, str(source)], cwd=work)
    (built,) = (work / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path) -> Path:
    """A folder with nothing but the wheel installed in it."""
    target = wheel.parent.parent / "installed"
    run(
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "-qq",
            "--no-deps",
            "--target",
            str(target),
            str(wheel),
        ]
    )
    return target


def run(command: list[str], cwd: Path | None = None, **variables: str) -> str:
    """What the command prints; fails with all it said if it does not succeed."""
    done = subprocess.run(
        command,
        cwd=cwd,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def shipped_files(pattern: str) -> set[str]:
    """Source files matching the pattern, by the name they have in the wheel."""
    files = [
        path
        for path in REPOSITORY.glob(pattern)
        if path.is_file() and "__pycache__" not in path.parts
    ]
    return {f"pyroshock/{path.relative_to(REPOSITORY)}" for path in files}


def package_folders() -> list[Path]:
    """The repository's folders that hold Python files of the product."""
    rooms = [
        path.parent
        for path in REPOSITORY.glob("*/__init__.py")
        if path.parent.name not in NOT_SHIPPED
    ]
    return [REPOSITORY, *{path.parent for room in rooms for path in room.rglob("*.py")}]


def test_every_module_of_the_wheel_imports_from_it(installed: Path, tmp_path: Path) -> None:
    printed = run(
        [sys.executable, "-c", IMPORT_EVERYTHING],
        cwd=tmp_path,
        PYTHONPATH=str(installed),
        NUMBA_DISABLE_JIT="1",  # each module's kernels are compiled by its own tests
    )
    files = json.loads(printed)
    strangers = {
        name: file for name, file in files.items() if not Path(file).is_relative_to(installed)
    }
    assert strangers == {}
    assert "pyroshock.app.doors.command_line.main" in files


def test_wheel_holds_every_module_and_data_file_and_no_tests_or_benchmarks(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        wheel_names = set(archive.namelist())
    modules = {
        str(path.relative_to(REPOSITORY))
        for folder in package_folders()
        for path in folder.glob("*.py")
    }
    assert {f"pyroshock/{module}" for module in modules} - wheel_names == set()
    for pattern in DATA_FILES:
        expected = shipped_files(pattern)
        assert expected, f"no source file matches {pattern}"
        assert expected - wheel_names == set()
    folders = {name.split("/")[1] for name in wheel_names if name.startswith("pyroshock/")}
    assert folders.isdisjoint(NOT_SHIPPED)
    assert {name.split("/")[0].split("-")[0] for name in wheel_names} == {"pyroshock"}


def test_pyproject_lists_every_folder_with_modules_and_each_is_a_package() -> None:
    settings = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]
    expected = {
        ".".join(["pyroshock", *folder.relative_to(REPOSITORY).parts])
        for folder in package_folders()
    }
    assert set(settings["packages"]) == expected
    assert [folder for folder in package_folders() if not (folder / "__init__.py").is_file()] == []


def test_command_starts_without_heavy_libraries(tmp_path: Path) -> None:
    loaded = set(json.loads(run([sys.executable, "-c", LOADED_BY_COMMAND], cwd=tmp_path)))
    assert loaded & set(HEAVY_MODULES) == set()


def test_help_is_quick(tmp_path: Path) -> None:
    command = [str(Path(sysconfig.get_path("scripts")) / "pyroshock"), "--help"]
    times_s = []
    for _ in range(5):
        start_s = time.perf_counter()
        assert "Usage" in run(command, cwd=tmp_path)
        times_s.append(time.perf_counter() - start_s)
    assert statistics.median(times_s) < HELP_LIMIT_S, f"pyroshock --help took {times_s} s"
