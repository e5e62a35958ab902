"""How a campaign changes from its first run to its last within its configurations: their means hide it.

Where runs are shuffled, each configuration's mean is that of the middle of the day, and what drifts looks steady. How
repetitions lean on their place in the order says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..gap import GapTable
from .factors import smooth
from .whitening import Whitening

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Range, in shares of the order of runs, over which something drifts.
_LENGTH = 0.4
#: Smaller eigenvalues of it, over the largest, are left out.
_KEPT = 1e-3
#: Below this sum of squared places about their configuration's mean repetitions stand too close to say anything.
_SPREAD = 0.05
#: A simulator may creep by so many tolerances over the day, in what scatters together together.
_STEADY = 0.3


@dataclass(frozen=True, eq=False)
class Creep:
    """`slope` (d,) of the observables `columns` (d,) over the whole order of runs, about the means of configurations,
    in tolerances; `noise` is that of the slopes.

    Of something that drifts with variance 1, `means` (C, k) says what configurations' means have in common, and
    `within` (C, k) what each configuration adds to the slope, by the same k components.
    """

    slope: Floats
    columns: Rows
    noise: Whitening
    means: Floats
    within: Floats

    @property
    def whitened(self) -> Floats:
        return self.noise.white(self.slope)

    @classmethod
    def of(cls, gap: GapTable) -> Self:
        of, order = gap.record.configuration_of, np.array([run.order for run in gap.record.runs], dtype=np.float64)
        here = np.isin(of, gap.rows) & np.isfinite(gap.residuals).any(axis=1)
        time = (order - order.min()) / max(float(np.ptp(order)), 1.0)
        time, residuals = time[here], gap.residuals[here]
        member = (of[here][None, :] == gap.rows[:, None]).astype(np.float64)  # (C, R)
        known = np.isfinite(residuals).astype(np.float64)
        off = _about(np.where(known > 0, time[:, None], 0.0), known, member)
        power = (off**2).sum(axis=0)
        columns = np.flatnonzero(power > _SPREAD)
        tolerance, power = gap.tolerance[columns], power[columns]
        slope = (off * np.nan_to_num(residuals)).sum(axis=0)[columns] / power / tolerance
        scatter = gap.noise.covariance[np.ix_(columns, columns)] / np.outer(tolerance, tolerance)
        size = np.sqrt(np.diag(scatter))
        covariance = scatter / np.sqrt(np.outer(power, power)) + _STEADY**2 * scatter / np.outer(size, size)
        means, within = _drifting(time, member)
        return cls(slope, columns, Whitening.of(covariance), means, within)


def _about(values: Floats, known: Floats, member: Floats) -> Floats:
    """(R, D) less the mean over the known runs of their configuration; 0 where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nan_to_num((member @ values) / (member @ known))
    return np.asarray((values - member.T @ mean) * known)


def _drifting(time: Floats, member: Floats) -> tuple[Floats, Floats]:
    """(C, k) twice, of runs at `time` (R,) that are members (C, R) of configurations."""
    share = member / np.maximum(member.sum(axis=1, keepdims=True), 1.0)
    off = time - member.T @ (share @ time)
    within = member * off / max(float(off @ off), _SPREAD)
    both = np.concatenate([share, within])
    values, vectors = np.linalg.eigh(both @ smooth((time[:, None] - time[None, :]) ** 2, _LENGTH) @ both.T)
    kept = values > _KEPT * values.max()
    root = vectors[:, kept] * np.sqrt(values[kept])
    return root[: len(member)], root[len(member) :]
