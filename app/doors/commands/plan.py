"""The nouns `plan` and `plans`: designs made, judged, kept and worked off."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

plan = OperationGroup(
    "plan",
    """Plan a campaign: make a design, store it, and see what is still to do. Without a command,
    list the plans.

    \b
    Example:
        pyroshock plan lhs autumn --runs 12
        pyroshock plan sheet autumn --out autumn.html
        pyroshock plan status autumn
    """,
)
plans = OperationGroup(
    "plans",
    """List the plans; show or delete one. Without a command, list them. `pyroshock plan` makes new
    plans.

    \b
    Example:
        pyroshock plans
        pyroshock plans show rehearsal
    """,
)
