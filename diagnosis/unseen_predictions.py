"""What sets of effects predict of configurations that they were not fitted to, each set once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..array_types import Floats
from .gap_reduction import FoldCorrections
from .inference.held_out import set_predictions
from .inference.posterior import HypothesisPosterior
from .inference.subset_fit import SubsetFit


class UnseenPredictions:
    """Predictions by set of laws, which are kept: several parts of a report ask for the same
    sets."""

    def __init__(self, posterior: HypothesisPosterior, held: FoldCorrections) -> None:
        self._library = posterior.library
        self._held = held
        self._tables: dict[tuple[str, ...], Floats] = {}

    def tables(self, fits: Sequence[SubsetFit]) -> list[Floats]:
        """(C, D) of each set: what it adds to the simulation, fitted to the folds that do not have
        the configuration, in the units of the observables.

        Parameters:
            fits: The sets as they were fitted to all configurations.
        """
        missing = list({fit.key: fit for fit in fits if fit.key not in self._tables}.values())
        if missing:
            by_fold = [
                set_predictions(self._library, fold.training, missing) for fold in self._held.folds
            ]
            for fit, own in zip(missing, zip(*by_fold, strict=True), strict=True):
                self._tables[fit.key] = self._held.unseen(np.array(own))
        return [self._tables[fit.key] for fit in fits]
