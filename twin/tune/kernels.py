"""How alike two settings are, and two lines of a spectrum: the correlations that a discrepancy is made of.

A correlation of settings takes (n,) and (m,) of them to (n, m), one of lines takes octaves (f,) to (f, f); all are
positive semidefinite, with 1 on the diagonal of a setting or line with itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..setting import Setting
from .space import amounts

Floats = NDArray[np.float64]

#: A correlation of lines, from octaves (f,).
OfLines = Callable[[Floats], Floats]

#: Where the common part of a discrepancy forgets: half an octave.
SMOOTH_OCTAVES = 0.5


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Settings as the kernels take them: logarithms (n, 3) of pressure, mass and tip radius, and `words` (n, 5).

    The words are plate, position, tip, anvil and insulator.
    """

    logs: Floats
    words: NDArray[np.str_]

    @classmethod
    def of(cls, settings: Sequence[Setting]) -> Coordinates:
        given = amounts(settings)
        radius = np.array([[s.tip_radius_m] for s in settings])
        logs = np.log(np.maximum(np.hstack([given, radius]), 1e-9))
        return cls(logs, np.array([_words(s) for s in settings]))

    def __len__(self) -> int:
        return len(self.logs)


def _words(setting: Setting) -> tuple[str, ...]:
    anvil = setting.anvil.name if setting.anvil else "none"
    return setting.plate.name, setting.impact_position, setting.tip.name, anvil, setting.insulator


class Everywhere:
    """The same for all settings."""

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        return np.ones((len(first), len(second)))


class SamePlace:
    """The same for all shots on one place of one plate: what its modes have wrong."""

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        same = np.all(first.words[:, None, :2] == second.words[None, :, :2], axis=-1)
        return np.asarray(same, dtype=np.float64)


class EachShot:
    """Each shot for itself, repeats of one setting too: given another object, no shot is the same."""

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        return np.eye(len(first)) if first is second else np.zeros((len(first), len(second)))


@dataclass(frozen=True)
class Alike:
    """Falls with the distance of the logarithms (a Gaussian of these lengths), and by a factor per other category."""

    lengths: tuple[float, float, float] = (1.0, 1.0, 0.7)
    factors: tuple[float, float, float, float, float] = (0.5, 0.6, 0.4, 0.5, 0.3)

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        a, b = (c.logs / np.array(self.lengths) for c in (first, second))
        squared = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
        out = np.exp(-0.5 * np.maximum(squared, 0.0))
        for column, factor in enumerate(self.factors):
            other = first.words[:, None, column] != second.words[None, :, column]
            out *= np.where(other, factor, 1.0)
        return np.asarray(out)


#: A correlation of settings.
OfSettings = Everywhere | SamePlace | EachShot | Alike


def level(octaves: Floats) -> Floats:
    """All lines together."""
    return np.ones((octaves.size, octaves.size))


def smooth(octaves: Floats) -> Floats:
    """Matern 3/2 over half an octave: neighbours together, with corners as spectra have them."""
    distance = np.sqrt(3) * np.abs(octaves[:, None] - octaves) / SMOOTH_OCTAVES
    return np.asarray((1 + distance) * np.exp(-distance))


def white(octaves: Floats) -> Floats:
    """Every line for itself."""
    return np.eye(octaves.size)
