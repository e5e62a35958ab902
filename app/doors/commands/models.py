"""The noun `models`: the registered models, listed, shown, deleted and recovered."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

models = OperationGroup(
    "models",
    """List the registered models with their figures; show or delete one. Without a command, list
    them. `pyroshock models MODEL@VERSION` shows one version.

    \b
    Example:
        pyroshock models --dataset rehearsal-pulses
        pyroshock models gp@1
        pyroshock models --promotions
    """,
    otherwise="show",
)
