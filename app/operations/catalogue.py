"""Every operation: its name, where it is declared, and its section on the command line.

A new operation is a file of its feature below `app/operations`, and a row here. The table keeps
help and completion from importing the operations.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

from .operation import Operation

#: Name -> (module below this package, attribute).
OPERATIONS: dict[str, tuple[str, str]] = {
    "plan": ("plan.make", "PLAN"),
    "train": ("train.train", "TRAIN"),
    "compare": ("train.compare", "COMPARE"),
    "promote": ("train.promote", "PROMOTE"),
    "build-dataset": ("train.build_dataset", "BUILD_DATASET"),
    "list-datasets": ("train.stored_datasets", "LIST_DATASETS"),
    "show-dataset": ("train.stored_datasets", "SHOW_DATASET"),
    "trace-pulse": ("train.stored_datasets", "TRACE_PULSE"),
}


def operation(name: str) -> Operation[Any, Any]:
    """The operation of a name. Raises `LookupError` for one that there is not."""
    if name not in OPERATIONS:
        raise LookupError(f"no operation {name!r}; there are: {', '.join(OPERATIONS)}")
    module, attribute = OPERATIONS[name]
    declared = getattr(importlib.import_module(f".{module}", __package__), attribute)
    assert isinstance(declared, Operation)
    return declared


def operations() -> Iterator[Operation[Any, Any]]:
    """All operations, in the order of the table."""
    return map(operation, OPERATIONS)
