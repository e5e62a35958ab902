"""Many clients at once: each a process of its own that runs commands as if typed, forked from this
one.

Imports are done once here, for twenty interpreters that import PyTorch would measure that. Called
by `crowd.py` with a folder that holds `clients.json`; what each command said and how it ended goes
to `CLIENT-NUMBER.json` there.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import traceback
from pathlib import Path
from time import monotonic


def client(folder: Path, name: int, commands: list[list[str]], start: int) -> None:
    os.read(start, 1)  # ends for all at once, when the parent closes its side
    for number, words in enumerate(commands):
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            os.dup2(out.fileno(), 1)
            os.dup2(err.fileno(), 2)
            began = monotonic()
            code = run(words)
            seconds = monotonic() - began
            sys.stdout.flush()
            sys.stderr.flush()
            told = {
                "words": words,
                "code": code,
                "seconds": seconds,
                "out": text_of(out),
                "err": text_of(err),
            }
        (folder / f"{name}-{number}.json").write_text(json.dumps(told), encoding="utf-8")


def run(words: list[str]) -> int:
    from pyroshock.app.doors.command_line.main import main

    sys.argv = ["pyroshock", *words]
    try:
        main()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(bool(ended.code))
    except BaseException:  # noqa: BLE001 - whatever a client would be shown
        traceback.print_exc()
        return 70
    return 0


def text_of(file) -> str:  # a temporary file
    file.seek(0)
    return file.read().decode(errors="replace")


def preload(modules: list[str]) -> None:
    for name in modules:
        __import__(name)


if __name__ == "__main__":
    place = Path(sys.argv[1])
    asked = json.loads((place / "clients.json").read_text(encoding="utf-8"))
    preload(asked["modules"])
    ready, go = os.pipe()
    children = []
    for number, commands in enumerate(asked["clients"]):
        child = os.fork()
        if child == 0:
            os.close(go)
            status = 70
            try:
                client(place, number, commands, ready)
                status = 0
            finally:
                os._exit(status)
        children.append(child)
    os.close(go)
    sys.exit(max(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children))
