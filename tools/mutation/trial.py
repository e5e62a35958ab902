"""One mutant against its tests, in a process that forks from one with the libraries loaded.

A copy of the tree lies in a folder `pyroshock`, and the folder around it leads the path of imports:
nothing of the work tree is written to. What is compiled by numba is cached by file; a caller in
another file would keep the code of before the change, hence a mutant of a compiled module gets a
cache of its own.
"""

from __future__ import annotations

import gc
import importlib
import itertools
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

#: Of address space: a mutant that takes more is one that fails.
_MEMORY_BYTES = 12 * 2**30
_LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv", ".cache", "results", "*.egg-info", "__pycache__", ".*_cache", "*.db"
)
#: Plugins load by name alone: others add seconds to every start.
_PLUGINS = (
    "pytest_timeout",
    "_hypothesis_pytestplugin",
    "no:unraisableexception",
    "no:cacheprovider",
)
_SECONDS = itertools.count(1_000_000_000)
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


@dataclass(frozen=True)
class Outcome:
    """`what`: survived, killed or timed out; `by`: the first test that failed."""

    what: str
    by: str
    seconds: float


def warmed_own(copy: Path, modules: Sequence[str]) -> None:
    """Loads modules of the copy that no mutant touches, and none of which imports one that a mutant
    does."""
    sys.path.insert(0, str(copy.parent))
    for module in modules:
        importlib.import_module(module)
    gc.collect()
    gc.freeze()


def copied(root: Path, folder: Path) -> Path:
    """A copy of the tree in a new folder, with the way to what lies beside the tree. The copy's
    path."""
    copy = folder / "pyroshock"
    shutil.copytree(root, copy, ignore=_LEFT_OUT, symlinks=True)
    if (root.parent / "shared").is_dir():
        (folder / "shared").symlink_to(root.parent / "shared")
    return copy


def warmed(libraries: Sequence[str]) -> None:
    """Loads what the trials share. Threads would not outlive a fork, hence one for each library."""
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"
    from _pytest.config import default_plugins

    for library in (*libraries, *(f"_pytest.{name}" for name in default_plugins)):
        importlib.import_module(library)


def tried(
    copy: Path, module: str, code: str | None, tests: Sequence[str], limit_s: float
) -> Outcome:
    """A module's changed code (None: as it is) against tests, as words for pytest; the file is put
    back."""
    path = copy / module
    original, times = path.read_bytes(), path.stat()
    began = time.monotonic()
    with tempfile.TemporaryDirectory(dir=copy.parent) as scratch:
        output = Path(scratch) / "output"
        compiled = code is not None and b"numba" in original
        cache = Path(scratch) if compiled else copy.parent / "numba"
        try:
            if code is not None:
                path.write_text(code, encoding="utf-8")
                # Bytecode is known by its source's second and size: each mutant has a second of its
                # own.
                os.utime(path, (next(_SECONDS), next(_SECONDS)))
            child = os.fork()
            if child == 0:
                _run(copy, tests, output, cache)
            status = _awaited(child, began + limit_s)
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
        seconds = time.monotonic() - began
        text = output.read_text(encoding="utf-8", errors="replace") if output.exists() else ""
    if status is None:
        return Outcome("timed out", "", seconds)
    failed = _FAILED.search(text)
    if status == 0:
        return Outcome("survived", "", seconds)
    return Outcome("killed", failed[1] if failed else f"exit {status}: {text[-300:]}", seconds)


def _run(copy: Path, tests: Sequence[str], output: Path, cache: Path) -> NoReturn:
    """In the child: pytest until the first failure, nothing after it."""
    try:
        os.setsid()
        with output.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.dont_write_bytecode = False
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        os.environ |= {"NUMBA_CACHE_DIR": str(cache), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        os.environ["PYTHONPATH"] = str(copy.parent)
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
        os.chdir(copy)
        sys.path[:] = [str(copy.parent), str(copy), *(each for each in sys.path if each)]
        import pytest
        from hypothesis import Phase, settings

        # A failing example is enough: making it small takes longer than finding it.
        settings.register_profile(
            "mutants", phases=[Phase.explicit, Phase.generate], database=None, derandomize=True
        )
        settings.load_profile("mutants")
        plugins = [word for name in _PLUGINS for word in ("-p", name)]
        words = ["-x", "-q", "--tb=no", "-m", "not slow and not bench"]
        status = int(pytest.main([*plugins, *words, *tests]))
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    except BaseException as error:  # noqa: BLE001 - the child must not go on as its parent
        os.write(2, repr(error).encode())
        os._exit(99)


def _awaited(child: int, until: float) -> int | None:
    """The exit status, negative for a signal; None: it ran past its time and was ended with all
    that it began."""
    while time.monotonic() < until:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None
