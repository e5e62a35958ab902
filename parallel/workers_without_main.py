"""Worker processes that do not import the program that starts them.

Python's own workers import the parent's main module anew (documentation of Python 3.11,
`multiprocessing`, "Safe importing of main module"): a script without `if __name__ == "__main__"`
would run a second time in each of them, and a program from standard input has no file to import.
Our workers get functions and data of this package only.
"""

from __future__ import annotations

from multiprocessing import popen_forkserver, spawn
from multiprocessing.context import ForkServerContext, ForkServerProcess
from multiprocessing.process import BaseProcess
from types import FunctionType, SimpleNamespace
from typing import Any


def _preparation_data(name: str) -> dict[str, Any]:
    """What a worker is told of its parent, without the main module."""
    data = spawn.get_preparation_data(name)
    return {key: value for key, value in data.items() if not key.startswith("init_main_from_")}


class _Popen(popen_forkserver.Popen):
    # Python has no parameter for it. These are its own steps, of whatever version, with other data:
    # to replace `spawn.get_preparation_data` would change the user's own processes too.
    _launch = FunctionType(
        popen_forkserver.Popen._launch.__code__,  # type: ignore[attr-defined]
        vars(popen_forkserver) | {"spawn": SimpleNamespace(get_preparation_data=_preparation_data)},
    )


class _WorkerProcess(ForkServerProcess):
    @staticmethod
    def _Popen(process_obj: BaseProcess) -> popen_forkserver.Popen:
        return _Popen(process_obj)


class ContextWithoutMain(ForkServerContext):
    """Forked from Python's server of this process, as those of
    `multiprocessing.get_context("forkserver")` are."""

    Process = _WorkerProcess
