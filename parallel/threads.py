"""One thread of linear algebra for each worker: the same sums everywhere, and as many workers as there are cores."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

#: What libraries that are loaded later look at.
_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@cache
def use_one_thread() -> None:
    """From now on, in a process that is a worker and nothing else."""
    import scipy.linalg  # noqa: F401 - brings a BLAS of its own, which is limited only where it is loaded
    from threadpoolctl import threadpool_limits

    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    threadpool_limits(limits=1)
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)


@contextmanager
def one_thread() -> Iterator[None]:
    """As long as the block lasts, in a process that has other things to do; what is loaded within it stays at one."""
    import scipy.linalg  # noqa: F401 - as above
    from threadpoolctl import threadpool_limits

    torch = sys.modules.get("torch")
    threads = torch.get_num_threads() if torch else 0
    variables = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    with threadpool_limits(limits=1):
        if torch:
            torch.set_num_threads(1)
        try:
            yield
        finally:
            if torch:
                torch.set_num_threads(threads)
            for name, value in variables.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})
