"""Who does the work: this process, processes beside it, or a cluster."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.util import find_spec

LOCAL, DASK = "local", "dask"


BACKENDS = (LOCAL, DASK)


def usual_jobs() -> int:
    """Processes where nobody says how many: one per core that this process may use, four at
    most."""
    return min(
        4, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )


@dataclass(frozen=True)
class ExecutorConfig:
    """`jobs` processes of this machine (1: this process), or the workers of the cluster whose
    `scheduler` is named.

    Raises `ValueError` for what is no executor, and where the library of its backend is not
    installed.
    """

    backend: str = LOCAL
    jobs: int = 1
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise ValueError(f"backend {self.backend!r}; expected one of {', '.join(BACKENDS)}")
        if self.jobs < 1:
            raise ValueError(f"jobs = {self.jobs!r}; expected 1 or more processes")
        if self.backend == LOCAL and self.scheduler is not None:
            raise ValueError(
                f"scheduler {self.scheduler!r} without a cluster; name its kind too: --backend dask"
            )
        if self.backend == DASK and not self.scheduler:
            raise ValueError(
                "backend 'dask' without a scheduler; name its address: --scheduler tcp://HOST:8786"
            )
        if self.backend == DASK and find_spec("distributed") is None:
            raise ValueError(
                "backend 'dask' needs distributed, which is not installed: "
                "pip install 'pyroshock[cluster]'"
            )

    @property
    def is_here(self) -> bool:
        """Whether all is done in this process, one item after the other."""
        return self.backend == LOCAL and self.jobs == 1

    def check(self) -> None:
        """Raises `ValueError` within some ten seconds where the cluster cannot be reached, or runs
        other software."""
        if self.backend == DASK:
            from .cluster import connect_cluster

            assert self.scheduler is not None
            connect_cluster(self.scheduler).close()


#: This process.
HERE = ExecutorConfig()
