"""A campaign as the simple ways of answering see it: arrays, in tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..diagnosis.gap import GapTable
from ..diagnosis.inference.effect_laws import EffectLaw
from ..diagnosis.inference.problem import InferenceProblem, StageBlock

#: Places of each parameter of a law with so many parameters; a law with more has the last.
_PLACES = (9, 5, 3)


@dataclass(frozen=True, eq=False)
class GapProblem:
    """N cells: means of a configuration's residuals in one observable.

    `z` (N,) the gap, `noise` (N, N) its covariance from repetitions and uncertain nominal parameters, with what no
    simulator is better than; `stage`, `configuration` and `observable` of each. `changes` by effect: (M, N), what it
    does at M places of its parameters; `parameters` how many it has (the most of its laws).
    """

    z: Floats
    noise: Floats
    stage: NDArray[np.str_]
    configuration: NDArray[np.intp]
    observable: NDArray[np.intp]
    changes: Mapping[str, Floats]
    parameters: Mapping[str, int]

    @classmethod
    def of(cls, gap: GapTable, inference: InferenceProblem | None = None) -> Self:
        """Without `inference` no effect is simulated, and `changes` is empty."""
        from scipy.linalg import block_diag

        blocks = inference.blocks if inference is not None else [StageBlock.of(gap, name) for name in gap.stages]
        laws = () if inference is None else tuple(law for law in inference.laws if not law.levels)
        return cls(
            np.concatenate([block.z for block in blocks]),
            block_diag(*(block.covariances[0] for block in blocks)),
            np.concatenate([np.full(len(block.z), block.stage) for block in blocks]),
            np.concatenate([block.configuration for block in blocks]),
            np.concatenate([block.observable for block in blocks]),
            {} if inference is None else _changes(inference, laws),
            {name: max(law.size for law in laws if law.id == name) for name in dict.fromkeys(law.id for law in laws)},
        )


def _changes(inference: InferenceProblem, laws: Sequence[EffectLaw]) -> dict[str, Floats]:
    """Places without an answer are left out, and so is an effect that has none."""
    points = [((law, u),) for law in laws for u in _places(law.size)]
    table = np.concatenate(inference.changes(points), axis=1)
    effects = np.array([law.id for ((law, _),) in points])
    answered = np.isfinite(table).all(axis=1)
    return {str(name): table[answered & (effects == name)] for name in dict.fromkeys(effects[answered])}


def _places(count: int) -> Floats:
    """(M, `count`): a grid that is even in the prior's probability."""
    from scipy.special import ndtri

    places = _PLACES[min(count, len(_PLACES)) - 1]
    middles = ndtri((np.arange(places) + 0.5) / places)
    return np.array(list(product(middles, repeat=count)))
