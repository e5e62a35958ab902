"""Copies of a store that are killed on their way: `python -m support.processes.killed_copies SOURCE
TARGET WORD...`.

For each word a child copies, and kills itself when its progress names it; then what the target
holds is printed.
"""

from __future__ import annotations

import os
import signal
import sys

from pyroshock.schema.engine import make_engine
from sqlalchemy import inspect

from support.stores.care_stores import copied


def killed_at(source: str, target: str, word: str) -> bool:
    """Whether a copy reached the step of this name, and died there."""

    def step(_done: int, _total: int, what: str) -> None:
        if what == word:
            os.kill(os.getpid(), signal.SIGKILL)

    child = os.fork()
    if child == 0:
        copied(source, target, step)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


def tables_at(target: str) -> list[str]:
    engine = make_engine(target)
    found = inspect(engine).get_table_names()
    engine.dispose()
    return found


if __name__ == "__main__":
    for each in sys.argv[3:]:
        print(each, killed_at(sys.argv[1], sys.argv[2], each), tables_at(sys.argv[2]))
