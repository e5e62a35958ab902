"""Progress bars: on standard error of a terminal, silent where nobody watches, and in notebooks."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Step = Callable[[int, int, str], None]


@contextmanager
def progress_bar(label: str, unit: str) -> Iterator[Step]:
    """Gives `step(done, total, what)`. The bar appears once work takes half a second, on a terminal only."""
    from tqdm import tqdm

    bar = tqdm(desc=label, unit=f" {unit}", delay=0.5, disable=not sys.stderr.isatty(), leave=False)
    with _stepping(bar) as step:
        yield step


@contextmanager
def notebook_bar(label: str, unit: str) -> Iterator[Step]:
    """The same in a notebook, where the bar is a widget or text, and on a terminal; elsewhere it is silent."""
    from tqdm.auto import tqdm

    in_notebook = "ipykernel" in sys.modules
    bar = tqdm(desc=label, unit=f" {unit}", delay=0.5, disable=not (in_notebook or sys.stderr.isatty()), leave=False)
    with _stepping(bar) as step:
        yield step


@contextmanager
def _stepping(bar: Any) -> Iterator[Step]:
    def step(done: int, total: int, what: str) -> None:
        bar.total = total
        bar.set_postfix_str(what, refresh=False)
        bar.update(done - bar.n)

    try:
        yield step
    finally:
        bar.close()
