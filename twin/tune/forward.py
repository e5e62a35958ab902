"""What the tuner asks of a forward model, and of the bench around it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from ...array_types import Floats
from ..setting import Setting

#: For each setting the reasons for which the bench must not fire it; empty where it may.
Refusals = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: For each setting what of it the forward model has not been made for; empty inside of its domain.
Outside = Callable[[Sequence[Setting]], list[tuple[str, ...]]]
#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]

#: Levels below this (m/s2) are taken for it: a shot that does not leave the barrel has no logarithm.
FLOOR_M_S2 = 1e-3


class Forward(Protocol):
    """Settings to the maximax shock response spectrum (m/s2) at one sensor."""

    @property
    def frequency_hz(self) -> Floats:
        """Lines (f,), rising."""
        ...

    def spectra(self, settings: Sequence[Setting]) -> Floats:
        """Nominal spectra (n, f)."""
        ...

    def draws(self, settings: Sequence[Setting], count: int, rng: np.random.Generator) -> Floats:
        """Random spectra (count, n, f): what the model itself does not know."""
        ...


def level_db(spectra_m_s2: Floats) -> Floats:
    """20 log10 of spectra in m/s2, any shape, finite."""
    return np.asarray(20 * np.log10(np.maximum(spectra_m_s2, FLOOR_M_S2)))


def nothing_refused(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
    """A bench, or a model, without limits."""
    return [()] * len(settings)
