"""Progress bars of the library's long work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..progress import Step, notebook_bar


@contextmanager
def step_bar(label: str, unit: str, shown: bool) -> Iterator[Step]:
    """A bar that notebooks show, too; where it is not `shown`, nothing is counted."""
    if not shown:
        yield lambda _done, _total, _what: None
        return
    with notebook_bar(label, unit) as step:
        yield step
