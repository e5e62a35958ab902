"""Progress bars on standard error, silent where nobody watches."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(label: str, unit: str) -> Iterator[Callable[[int, int, str], None]]:
    """Gives `step(done, total, what)`. The bar appears once work takes half a second, on a terminal only."""
    from tqdm import tqdm

    bar = tqdm(desc=label, unit=f" {unit}", delay=0.5, disable=not sys.stderr.isatty(), leave=False)

    def step(done: int, total: int, what: str) -> None:
        bar.total = total
        bar.set_postfix_str(what, refresh=False)
        bar.update(done - bar.n)

    try:
        yield step
    finally:
        bar.close()
