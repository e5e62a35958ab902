"""Every operation: its command, its address below /api, and where it is not offered."""

from __future__ import annotations

from collections.abc import Iterator

from pyroshock.app.operations.catalogue import OPERATIONS, operation

from .markdown import code, escaped, joined, table

_DOORS = {"command": "command line", "json": "network", "form": "pages", "python": "Python"}


def page() -> str:
    """A row of each operation."""
    return joined(table(("operation", "commands", "network", "not offered, and why"), _rows()))


def _rows() -> Iterator[tuple[str, str, str, str]]:
    for name, (_, _, *commands) in OPERATIONS.items():
        declared = operation(name)
        method, address = declared.route or ("POST", f"/{name}")
        absent = declared.absent
        doors = {
            reason: ", ".join(_DOORS[door] for door in absent if absent[door] == reason)
            for reason in dict.fromkeys(absent.values())
        }
        yield (
            escaped(name),
            ", ".join(code(words) for words in commands if "command" not in absent),
            "" if "json" in absent else code(f"{method} /api{address}"),
            escaped(" ".join(f"{names}: {reason}" for reason, names in doors.items())),
        )
