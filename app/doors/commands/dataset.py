"""The nouns `dataset` and `datasets`: pulses frozen for training, looked at, traced to their raw
files, exported."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

dataset = OperationGroup(
    "dataset",
    """Freeze pulses for training, and see what a dataset holds. Without a command, list the
    datasets.

    \b
    Example:
        pyroshock dataset build both --from rehearsal,slow-valve
        pyroshock dataset show both --plot both.png
    """,
)
datasets = OperationGroup(
    "datasets",
    """List the datasets; show or delete one. Without a command, list them. `pyroshock dataset`
    makes new datasets.

    \b
    Example:
        pyroshock datasets
        pyroshock datasets show rehearsal-pulses
    """,
)
