"""`diagnoses`: list, show, delete the diagnoses of the store, or adopt effects of one."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

diagnoses = OperationGroup(
    "diagnoses",
    """List the diagnoses; show or delete one, or adopt its effects. Without a command, list them.
    `pyroshock diagnose` makes new ones.

    \b
    Example:
        pyroshock diagnoses
        pyroshock diagnoses show 1
    """,
)
