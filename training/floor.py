"""The repeatability floor: what a predictor reaches that knows the treatment exactly, from its repetitions alone.

Told which group a pulse belongs to, and having measured that group, a predictor is left with what repetitions of one
setting do not share; no model can do better, but by chance, than to know each group's law. Two groups are of interest:

- "configuration": all factors, the impact position included, which a model never sees.
- "treatment": what the predictors tell apart. What can be reached from them, with the positions' scatter in it.

Within a group force / velocity and log(contact time) are polynomials of log(velocity): a hammer is swung by hand, and
its velocity is known. One degree for all groups, of force and of time each, is chosen by leave-one-out.

The plain floor pays for learning from few repetitions: with h the leverage, an error is sqrt(1 + h) times the scatter
of a repetition, 6 % more than it for the mean of eight. `corrected` divides by that: errors of the noise alone, the
floor of endless repetitions, if the polynomial is the truth. The plain one is the default, as a predictor that exists
reaches it; a model that learns many groups together may come below it, but below the corrected one only by chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..dataset.table import PulseTable
from .metrics.errors import PulseErrors, pulse_errors
from .models.base import ContactPrediction
from .repetitions import force_targets, groups_of, misfit, predicted, time_targets, velocity_of

Scope = Literal["configuration", "treatment"]

#: Of the polynomials that are tried.
DEGREES = (0, 1, 2)


@dataclass(frozen=True, eq=False)
class Floor:
    """`errors` are those of the held-out pulses `rows` (all but those without another repetition, `lonely` of them).

    `left_out` pulses had no training row in their group and were predicted from the group's other held-out pulses.
    """

    scope: Scope
    corrected: bool
    errors: PulseErrors
    rows: NDArray[np.intp]
    force_degree: int
    time_degree: int
    left_out: int
    lonely: int

    @property
    def note(self) -> str:
        """How it was found, in a sentence."""
        power = {0: "their mean", 1: "a line in log velocity", 2: "a parabola in log velocity"}
        parts = [f"each pulse from the other repetitions of its {self.scope}"]
        if self.left_out:
            parts.append(f"{self.left_out} of {len(self.rows)} leave-one-out among the held-out ones")
        parts.append(f"force by {power[self.force_degree]}, time by {power[self.time_degree]}")
        if self.corrected:
            parts.append("the regression's own noise taken out")
        if self.lonely:
            parts.append(f"{self.lonely} pulses without another repetition have none")
        return "; ".join(parts)


def repeatability_floor(
    training: PulseTable,
    held_out: PulseTable,
    scope: Scope = "configuration",
    *,
    corrected: bool = False,
) -> Floor:
    """The floor of the held-out pulses, by the errors that models are judged with.

    Raises `ValueError` where no held-out pulse has another repetition, and for a velocity that is not positive.
    """
    groups = groups_of(training, held_out, scope)
    if not groups:
        raise ValueError(f"no held-out pulse shares its {scope} with another: repeat runs to know what repeats")
    force_degree = min(DEGREES, key=lambda degree: misfit(groups, degree, force_targets))
    time_degree = min(DEGREES, key=lambda degree: misfit(groups, degree, time_targets))
    rows = np.concatenate([group.rows for group in groups])
    force = np.concatenate([predicted(group, force_degree, force_targets, corrected) for group in groups])
    time = np.concatenate([predicted(group, time_degree, time_targets, corrected) for group in groups])
    order = np.argsort(rows)
    pulses = held_out.take(rows[order])
    force_n = force[order] * velocity_of(pulses)[:, None]
    prediction = ContactPrediction(force_n, np.exp(time[order, 0]), None, None)
    return Floor(
        scope=scope,
        corrected=corrected,
        errors=pulse_errors(pulses, prediction),
        rows=rows[order],
        force_degree=force_degree,
        time_degree=time_degree,
        left_out=sum(len(group.rows) for group in groups if group.alone),
        lonely=len(held_out) - len(rows),
    )
