"""Linear algebra on one core: the same sums, and so the same model, whatever else runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_core() -> Iterator[None]:
    """Also faster here: small matrices and a second thread that waits do not go together."""
    import scipy.linalg  # noqa: F401 - brings a BLAS of its own, which is limited only where it is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield
