"""What the right effect would have achieved: it knows the effect's kind, and fits its parameters on the same folds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...twin.effects import Effect
from ..localisation.means import Floats
from ..stages.base import Stage
from ..verdict import Shrinkage
from .fit import Fitter
from .measure import shrinkage


def oracle(
    stages: Sequence[Stage],
    kinds: Sequence[type[Effect]],
    rng: np.random.Generator,
    scales: Mapping[str, Floats] | None = None,
) -> tuple[Shrinkage, ...]:
    """Shrinkage by effects of these kinds: give `rng` the seed of the shrinkage that it stands beside.

    No upper bound where the truth has another law than the twin: another effect may then explain it better.
    """
    fitter = Fitter.of(stages, kinds)
    return shrinkage(stages, fitter.fit, rng, scales, pulses=False)
