"""How alike two settings are, and two lines of a spectrum: the correlations that a discrepancy is
made of.

A correlation of settings takes (n,) and (m,) of them to (n, m), one of lines takes octaves (f,) to
(f, f); all are positive semidefinite. Correlations of lines commute with each other: they have the
same eigenvectors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..setting import Setting

#: A correlation of lines, from octaves (f,).
OfLines = Callable[[Floats], Floats]

#: Where the common part of a discrepancy forgets: half an octave.
SMOOTH_OCTAVES = 0.5
#: Columns of `Coordinates.words`.
PLATE, POSITION, TIP, ANVIL, INSULATOR, BOUNDARY = range(6)


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Settings as the kernels take them: logarithms (n, 3) of drive, mass and tip radius, and
    `words` (n, 6).

    The drive is the tank's pressure, or the velocity where that is set. The words are plate,
    position, tip, anvil, insulator and boundary conditions. `shots` (n,) says of how many shots a
    row is the mean.
    """

    logs: Floats
    words: NDArray[np.str_]
    shots: Floats

    @classmethod
    def of(cls, settings: Sequence[Setting]) -> Coordinates:
        numbers = [
            (s.impact_velocity_m_s or s.tank_pressure_pa, s.impactor_mass_kg, s.tip_radius_m)
            for s in settings
        ]
        logs = np.log(np.maximum(np.array(numbers, dtype=np.float64), 1e-9))
        return cls(logs, np.array([_words(s) for s in settings]), np.ones(len(settings)))

    def __len__(self) -> int:
        return len(self.logs)

    def means(self, groups: NDArray[np.intp]) -> Coordinates:
        """Of the settings of each group (n,), in rising order; a group's words are those of its
        first setting."""
        _, first, which, count = np.unique(
            groups, return_index=True, return_inverse=True, return_counts=True
        )
        logs = np.zeros((count.size, self.logs.shape[1]))
        np.add.at(logs, which, self.logs)
        return Coordinates(logs / count[:, None], self.words[first], count.astype(np.float64))


def _words(setting: Setting) -> tuple[str, ...]:
    anvil = setting.anvil.name if setting.anvil else "none"
    place = setting.plate.name, setting.impact_position
    return *place, setting.tip.name, anvil, setting.insulator, setting.boundary_conditions


class Everywhere:
    """The same for all settings."""

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        return np.ones((len(first), len(second)))


@dataclass(frozen=True)
class SameWords:
    """The same for all settings that share the words of these columns."""

    columns: tuple[int, ...]

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        words = list(self.columns)
        same = np.all(first.words[:, None, words] == second.words[None, :, words], axis=-1)
        return np.asarray(same, dtype=np.float64)


#: One place of one plate, held in one way: what its modes have wrong.
SamePlace = SameWords((PLATE, POSITION, BOUNDARY))
#: One stack of layers on the plate: what it passes on.
SameStack = SameWords((ANVIL, INSULATOR))
#: One pair of bodies in contact: the shape of its pulse.
SameContact = SameWords((TIP, ANVIL, INSULATOR))


class EachShot:
    """Each shot for itself, repeats of one setting too: given another object, no shot is the same.

    A mean of shots has so much less of it.
    """

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        return np.diag(1 / first.shots) if first is second else np.zeros((len(first), len(second)))


@dataclass(frozen=True)
class SettingKernel:
    """Falls with the distance of the logarithms (a Gaussian of these lengths), and by a factor per
    other category."""

    lengths: tuple[float, float, float] = (1.0, 1.0, 0.7)
    factors: tuple[float, ...] = (0.5, 0.6, 0.4, 0.5, 0.3, 0.6)

    def __call__(self, first: Coordinates, second: Coordinates) -> Floats:
        a, b = (c.logs / np.array(self.lengths) for c in (first, second))
        squared = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
        out = np.exp(-0.5 * np.maximum(squared, 0.0))
        for column, factor in enumerate(self.factors):
            other = first.words[:, None, column] != second.words[None, :, column]
            out *= np.where(other, factor, 1.0)
        return np.asarray(out)


#: A correlation of settings.
OfSettings = Everywhere | SameWords | EachShot | SettingKernel


def level(octaves: Floats) -> Floats:
    """All lines together."""
    return np.ones((octaves.size, octaves.size))


def smooth(octaves: Floats) -> Floats:
    """Matern 3/2 over half an octave: neighbours together, with corners as spectra have them.

    Of it the mean over the lines is taken apart, so that it commutes with `level`; 1 on the
    diagonal in the mean.
    """
    distance = np.sqrt(3) * np.abs(octaves[:, None] - octaves) / SMOOTH_OCTAVES
    matern = (1 + distance) * np.exp(-distance)
    apart = matern - matern.mean(axis=0) - matern.mean(axis=1)[:, None] + 2 * matern.mean()
    return np.asarray(apart * octaves.size / np.trace(apart))


def white(octaves: Floats) -> Floats:
    """Every line for itself."""
    return np.eye(octaves.size)
