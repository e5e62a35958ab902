"""Scatter from run to run: heavier tails than a normal distribution's."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats

DOF = 5


def heavy(rng: np.random.Generator, *shape: int) -> Floats:
    """Numbers of unit variance from Student's t with 5 degrees of freedom."""
    return np.asarray(rng.standard_t(DOF, shape) / np.sqrt(DOF / (DOF - 2)))
