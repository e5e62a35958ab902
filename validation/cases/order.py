"""The order in which a campaign's runs are made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .case import Case
from .designs import design


def run_order(case: Case) -> NDArray[np.int64]:
    """Configuration and repetition (from 0) of each run (R, 2), in the order of runs."""
    count = len(design(case.kind, case.design))
    rng = np.random.default_rng([case.background.seed, 7])
    runs = np.stack(np.meshgrid(np.arange(count), np.arange(case.repetitions), indexing="ij"), axis=-1)
    if case.blocked:
        return np.asarray(runs[rng.permutation(count)].reshape(-1, 2))
    return np.asarray(rng.permutation(runs.reshape(-1, 2)))


def places(case: Case) -> tuple[float, ...]:
    """Mean place of each configuration's runs in the order of runs, 0 to 1."""
    rows = run_order(case)
    at = np.linspace(0, 1, len(rows))
    return tuple(float(at[rows[:, 0] == c].mean()) for c in range(int(rows[:, 0].max()) + 1))
