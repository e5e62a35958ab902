"""The lowest modes of a sparse pair of stiffness and mass, by inverse iteration about a shift below zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .assembly import Matrix

__all__ = ["lowest_modes", "modes_below"]

#: By how much more modes are asked for when the last guess fell short of the limit.
_MORE = 1.25


def lowest_modes(
    stiffness: Matrix, mass: Matrix, count: int, *, shift_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies (count,) in Hz, rising, and mass-normalised shapes (size, count).

    `shift_hz` is a frequency of the order of the lowest elastic mode. By rounding, a mode without stiffness comes out
    within some 1e-3 of it, or at 0.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    shift = (2 * np.pi * shift_hz) ** 2
    # Positive definite: no pivoting, and an ordering that keeps the symmetry, solve some times faster.
    factors = splu(
        (stiffness + shift * mass).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    inverse = LinearOperator(stiffness.shape, matvec=factors.solve, dtype=np.float64)
    # A fixed start keeps the modes the same from call to call, and from process to process.
    start = np.sin(1.0 + np.arange(stiffness.shape[0]))
    squares, shapes = eigsh(stiffness, count, mass, sigma=-shift, OPinv=inverse, v0=start)
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)) / (2 * np.pi), np.asarray(shapes[:, order])


def modes_below(
    stiffness: Matrix, mass: Matrix, limit_hz: float, *, expected: int, shift_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All modes up to `limit_hz`, of which about `expected` are thought to be there."""
    count = min(expected, stiffness.shape[0] // 2)
    frequencies, shapes = lowest_modes(stiffness, mass, count, shift_hz=shift_hz)
    while frequencies[-1] <= limit_hz and count < stiffness.shape[0] // 2:
        count = min(int(_MORE * count) + 1, stiffness.shape[0] // 2)
        frequencies, shapes = lowest_modes(stiffness, mass, count, shift_hz=shift_hz)
    inside = frequencies <= limit_hz
    return frequencies[inside], shapes[:, inside]
