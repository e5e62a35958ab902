"""The nouns `campaigns` and `runs`: what is in the store, and what leaves it."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

campaigns = OperationGroup(
    "campaigns",
    """List the campaigns with their counts; begin, delete, archive or restore a campaign. Without a
    command, list them.

    \b
    Example:
        pyroshock campaigns --json
        pyroshock campaigns show rehearsal
        pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn" --dry-run
    """,
)
runs = OperationGroup(
    "runs",
    """List the recordings of a campaign with their runs; take one out of the store, or replace it
    by a corrected one.

    \b
    Example:
        pyroshock runs list rehearsal
        pyroshock runs show rehearsal recordings/0001-01.npz
        pyroshock runs discard rehearsal --run 7 --reason "the plate had come loose" --dry-run
    """,
)
