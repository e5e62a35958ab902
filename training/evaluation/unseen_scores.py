"""How well predictions scored on configurations that they have not learned from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .summary import clustered, corrected_p, sign_flip_p

QUANTITIES = ("peak force", "contact time", "impulse")


@dataclass(frozen=True, eq=False)
class UnseenScores:
    """CRPS of n pulses, (n, 3) for `QUANTITIES` as natural logarithms, of predictions by name; and
    which values (n, 3) lie `inside` their 90 % bands.

    The first is the candidate, the second the reference that it is judged against; a third, the
    contact of which nothing was learned, is further information.
    """

    names: tuple[str, ...]
    crps: tuple[Floats, ...]
    inside: tuple[NDArray[np.bool_], ...]
    configuration: NDArray[np.str_]
    folds: int

    @property
    def means(self) -> tuple[float, float]:
        """Over pulses and quantities."""
        return float(self.crps[0].mean()), float(self.crps[1].mean())

    @property
    def first_is_better(self) -> bool:
        return self.means[0] < self.means[1]

    @property
    def configurations(self) -> int:
        return len(np.unique(self.configuration))

    def p_value(self, rng: np.random.Generator) -> float:
        """Of the hypothesis that the models are equal: the larger p-value of the sign-flip test
        over configurations and of the t-test that allows for the luck of what each model learned
        from (`corrected_p`)."""
        clusters = clustered(
            (self.crps[0] - self.crps[1]).mean(axis=1, keepdims=True), self.configuration
        )
        return max(float(sign_flip_p(clusters, rng)[0]), float(corrected_p(clusters)[0]))

    def figures(self) -> dict[str, float]:
        """By metric names that MLflow takes: "crps.candidate", "crps.reference.peak_force",
        "crps.prior"."""
        figures = {}
        for name, scores in zip(("candidate", "reference", "prior"), self.crps, strict=False):
            figures[f"crps.{name}"] = float(scores.mean())
            for quantity, mean in zip(QUANTITIES, scores.mean(axis=0).tolist(), strict=True):
                figures[f"crps.{name}.{quantity.replace(' ', '_')}"] = mean
        return figures
