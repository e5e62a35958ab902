"""The probability that something outside of the catalogue makes most of the gap.

Evidence alone is too sure: a law that is a little wrong is beaten by a free form. Hence a logit of two figures, learned
on campaigns whose cause was known (`benchmarks/diagnosis_maps.py`): the compressed log odds of the evidence, and the
fraction of the gap that the effects take away where they were not fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class UnknownMap:
    """logit p = `intercept` + `odds` asinh(log odds / 2) + `fraction` (1/2 - held-out fraction)."""

    intercept: float = 0.40
    odds: float = 0.26
    fraction: float = 3.9
    source: str = "development campaigns of the virtual bench (docs/blind-check/development/maps.jsonl)"

    def __call__(self, log_odds: float, fraction: float | None) -> float:
        """Without a fraction that is held out the odds alone decide."""
        held_out = 0.5 if fraction is None or not np.isfinite(fraction) else float(np.clip(fraction, -0.5, 1.0))
        logit = self.intercept + self.odds * np.arcsinh(log_odds / 2) + self.fraction * (0.5 - held_out)
        return float(1 / (1 + np.exp(-logit)))
