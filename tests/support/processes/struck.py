"""A process that starts commands for others to kill: `striking.Forge` speaks with it.

A command's first seconds are imports, and a kill there strikes nothing. So everything is imported
here, once, and each command line asked for on standard input is a process forked from this one, in
a group of its own: it begins with its work. Two lines answer: the process' number when it was
started, its exit status when it has ended.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any

#: What commands import within their functions.
IMPORTS = (
    "alembic.command", "alembic.autogenerate", "psycopg",
    "pyroshock.app.operations.ingest.archiving", "pyroshock.app.operations.ingest.removal",
    "pyroshock.ingest.load", "scipy.interpolate", "scipy.io", "scipy.signal", "tqdm",
)  # fmt: skip
#: And those around models, which take longer than all others.
OF_MODELS = (
    "mlflow.models", "mlflow.pyfunc", "pandas", "pyroshock.training.registry.promotion",
    "pyroshock.training.fitting.session", "sklearn.linear_model",
)  # fmt: skip


def main() -> None:
    """Import, then start what is asked for."""
    os.environ |= {
        "MLFLOW_DISABLE_TELEMETRY": "true",
        "DO_NOT_TRACK": "true",
        "GIT_PYTHON_REFRESH": "quiet",
    }
    models = "models" in sys.argv
    for module in (*IMPORTS, *(OF_MODELS if models else ())):
        importlib.import_module(module)
    from pyroshock.app.doors.command_line.main import main
    from pyroshock.app.operations.command_words import COMMANDS

    for name in COMMANDS:
        main.get_command(None, name)  # it looks a name up
    if models:
        _draw_nothing()
    for line in sys.stdin:
        asked = json.loads(line)
        number = os.fork()
        if number == 0:
            _run(asked)
        _own_group(number)
        print(number, flush=True)
        print(os.waitpid(number, 0)[1], flush=True)


def _draw_nothing() -> None:
    """Pictures of a training take longer than all else, and a kill within them strikes nothing."""
    import pytest

    from support.stores.registries import without_figures

    without_figures(pytest.MonkeyPatch())


def _own_group(number: int) -> None:
    """Both sides of the fork say so: whoever kills the group must find it."""
    with suppress(PermissionError, ProcessLookupError):  # it has, or it is gone
        os.setpgid(number, number)


def _run(asked: dict[str, Any]) -> None:
    """The command line, in this forked process; it ends here."""
    _own_group(0)
    nowhere = os.open(os.devnull, os.O_RDWR)
    errors = os.open(asked["errors"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for descriptor, target in ((nowhere, 0), (nowhere, 1), (errors, 2)):
        os.dup2(descriptor, target)
    os.chdir(asked["folder"])
    os.environ |= asked["environment"]
    _become_later()
    statements = _struck_at(asked["at"])
    from pyroshock.app.doors.command_line.main import main

    sys.argv = ["pyroshock", *asked["command"]]
    code = 1
    try:
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:  # noqa: BLE001 - nothing may get back to the loop
        traceback.print_exc()
    finally:
        Path(asked["count"]).write_text(str(statements[0]), encoding="utf-8")
        sys.stderr.flush()
        os._exit(code)


def _become_later() -> None:
    """The software with one revision more, where the environment names its folder."""
    sys.path.append(str(Path(__file__).resolve().parents[2]))
    from support.stores import later_revision

    if folder := os.environ.get(later_revision.VARIABLE):
        later_revision.install(Path(folder))


def _struck_at(number: int) -> list[int]:
    """Counts statements to any database, the store's and MLflow's, commits too; kills the group
    before this one."""
    from sqlalchemy import Engine, event

    seen = [0]

    def counted(*_: object) -> None:
        seen[0] += 1
        if seen[0] == number:
            os.killpg(0, signal.SIGKILL)

    event.listen(Engine, "before_cursor_execute", counted)
    event.listen(Engine, "commit", counted)
    return seen


if __name__ == "__main__":
    main()
