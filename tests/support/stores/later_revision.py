"""This software as it will be with one revision more, for tests of what an upgrade does to a store.

`python later_revision.py FOLDER COMMAND ...` runs a command of that software.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

REVISION = "9000"
#: The folder of the revision, for processes that are forked (`struck`).
VARIABLE = "PYROSHOCK_TEST_LATER_REVISION"
#: Rows are changed and a table is made anew, which SQLite cannot alter; the models' tables stay.
CHANGE_MATERIALS = """
    for word in ("first", "second"):
        op.execute(sa.text(f"UPDATE materials SET source = source || ' {word}'"))
    if op.get_bind().dialect.name == "sqlite":
        with op.batch_alter_table("materials", recreate="always"):
            pass
    else:
        op.alter_column("materials", "source", type_=sa.Text())
        op.alter_column("materials", "source", type_=sa.String())
"""
_TEXT = """
import sqlalchemy as sa
from alembic import op

revision, down_revision, branch_labels, depends_on = {revision!r}, {head!r}, None, None


def upgrade():
    {change}
"""


def write_revision(folder: Path, change: str = CHANGE_MATERIALS) -> Path:
    """A folder with the revision that follows the newest; `change` are the statements of its
    upgrade."""
    from pyroshock.schema import migrate

    folder.mkdir()
    text = _TEXT.format(revision=REVISION, head=migrate.HEAD, change=change.strip("\n").lstrip())
    (folder / f"{REVISION}_later.py").write_text(text, encoding="utf-8")
    return folder


def install(folder: Path) -> Callable[[], None]:
    """Let this process be the later software; the function that is returned takes it back."""
    from pyroshock.schema import migrate

    config, head = migrate.config, migrate.HEAD
    own = Path(migrate.__file__).parent / "migrations" / "versions"

    def with_later(*given: Any, **extra: Any) -> Any:
        settings = config(*given, **extra)
        settings.set_main_option("version_locations", os.pathsep.join([str(own), str(folder)]))
        return settings

    def become(configuration: Any, revision: str) -> None:
        migrate.config, migrate.HEAD = configuration, revision
        migrate._scripts.cache_clear()
        migrate.known_revisions.cache_clear()

    become(with_later, REVISION)
    return lambda: become(config, head)


def main() -> None:
    """The command line of the later software."""
    install(Path(sys.argv[1]))
    from pyroshock.app.doors.command_line.main import main as command_line

    sys.argv = ["pyroshock", *sys.argv[2:]]
    command_line()


if __name__ == "__main__":
    main()
