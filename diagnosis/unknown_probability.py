"""The probability that something outside of the catalogue makes most of the gap.

Evidence alone is too sure: a law that is a little wrong is beaten by a free form. Hence a logit of three figures,
learned on campaigns whose cause was known (`benchmarks/diagnosis_maps.py`): the compressed log odds of the evidence,
the fraction of the gap that the effects take away where they were not fitted, and how much is left there, in
tolerances. Where it is likely that no effect acts there is nothing to predict, and the fraction says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Less than this is left by any simulator, and more than that says no more, in tolerances.
_LEAST_LEFT, _MOST_LEFT = 0.3, 3.0


@dataclass(frozen=True)
class UnknownMap:
    """logit p = `intercept` + `odds` asinh(log odds / 2) + `fraction` (1 - p_none) (1/2 - held-out fraction) + `left`
    ln(left)."""

    intercept: float = -0.99
    odds: float = 0.31
    fraction: float = 5.09
    left: float = 1.27
    source: str = "development campaigns of the virtual bench (docs/blind-check/development/maps.jsonl)"

    def __call__(self, log_odds: float, fraction: float | None, left: float | None, none: float = 0.0) -> float:
        """`left`: rms of the gap that the effects leave held out, less the noise floor, in tolerances; `none`: the
        probability of sets within tolerance. Without figures that are held out the odds alone decide."""
        figures = np.array(features(log_odds, fraction, left, none))
        logit = float(figures @ [self.intercept, self.odds, self.fraction, self.left])
        return float(1 / (1 + np.exp(-logit)))


def features(
    log_odds: float, fraction: float | None, left: float | None, none: float = 0.0
) -> tuple[float, float, float, float]:
    """One, and the figures of the logit in the order of `UnknownMap`."""
    fraction = 0.5 if fraction is None or not np.isfinite(fraction) else fraction
    left = 1.0 if left is None or not np.isfinite(left) else left
    return (
        1.0,
        float(np.arcsinh(log_odds / 2)),
        (1 - none) * (0.5 - float(np.clip(fraction, -0.5, 1.0))),
        float(np.log(np.clip(left, _LEAST_LEFT, _MOST_LEFT))),
    )
