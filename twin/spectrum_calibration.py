"""What measured shots teach of spectra and peak accelerations beyond gun and contact: what remains
under the measured force.

Of each shot the twin's pulse gets the peak and the impulse of the measured force and acts on the
nominal plate. What measured levels differ from its answer by is the Gaussian process of
`discrepancy`, for each sensor alone, with the largest acceleration as one more line. Bands are
those of the process times a scatter that configurations left out have shown: cross-conformal
prediction with local weights (Vovk, Ann. Math. Artif. Intell. 74 (2015) 9; Lei and others, J. Am.
Stat. Assoc. 113 (2018) 1094, section 5), as Student's t of as many configurations as are alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .contact_interface import ForcePulses
from .discrepancy.kernels import (
    BOUNDARY,
    INSULATOR,
    PLATE,
    POSITION,
    TIP,
    Coordinates,
    EachShot,
    Everywhere,
    SameContact,
    SamePlace,
    SameStack,
    SameWords,
    SettingKernel,
    level,
    smooth,
    white,
)
from .discrepancy.likelihood import fitted
from .discrepancy.shot_correction import Discrepancy, ShotCorrection, Term
from .measured_shots import MeasuredShots
from .setting import Setting

#: Levels of settings at velocities of impact and lines under the measured force: (n, sensors, 1 +
#: lines), dB.

#: The largest acceleration stands so many octaves above the highest line: it shares levels with all
#: lines, and colour with none.
_PEAK_OCTAVES = 2.0
#: Configurations that are learned from: evenly picked ones of more. The memory grows with their
#: square.
MOST_CONFIGURATIONS = 300
_ALIKE = SettingKernel()
#: One way of exciting one place: a soft tip excites the lowest modes alone, and then all lines
#: follow them.
_SameBlow = SameWords((PLATE, POSITION, BOUNDARY, TIP, INSULATOR))

#: Before any shot, dB. All are assumed, from how far models of plates lie from plates.
#:
#: all: handbook damping of 0.5 % where structures have 0.2 to 1 % moves a line's ringing by up to 3
#: dB, mount and gain of a sensor some 0.5 dB. place: of a line that few modes make, places of a
#: plate differ by 5.6 dB (Lyon and DeJong, Theory and Application of Statistical Energy Analysis,
#: 1995, ch. 4), less where lines average many; edges that are bolted change the lowest modes, and a
#: place that is known to some millimetres leaves half of it. stack: an anvil of a kilogram on a
#: plate of 10 mm keeps 8 dB of the highest lines to itself, and a layer as much. contact, blow,
#: setting: the corner of a spectrum moves with the pulse's rise, which peak and impulse do not
#: tell.
TERMS: tuple[Term, ...] = (
    Term("level of all", 1.5, Everywhere(), level),
    Term("colour of all", 1.5, Everywhere(), smooth),
    Term("colour of the place", 1.5, SamePlace, smooth),
    Term("line of the place", 1.2, SamePlace, white),
    Term("level of the stack", 3.0, SameStack, level),
    Term("colour of the stack", 2.5, SameStack, smooth),
    Term("level of the contact", 0.7, SameContact, level),
    Term("colour of the contact", 1.5, SameContact, smooth),
    Term("level of the blow", 1.0, _SameBlow, level),
    Term("colour of the blow", 1.0, _SameBlow, smooth),
    Term("level of the setting", 0.7, _ALIKE, level),
    Term("colour of the setting", 1.2, _ALIKE, smooth),
    Term("line of the setting", 0.8, _ALIKE, white),
    Term("level of the shot", 0.3, EachShot(), level),
    Term("colour of the shot", 0.3, EachShot(), smooth),
    Term("line of the shot", 0.3, EachShot(), white),
)

#: Fewer configurations than this say nothing of scatter.
_FEW = 4
#: So many configurations that behave as stated stand beside those measured: of a line, and of what
#: is alike.
_LINE_WEIGHT, _ALIKE_WEIGHT = 4.0, 1.5
#: How alike scatter is: a tip makes it, places and plates hardly.
_SCATTER_ALIKE = SettingKernel(lengths=(2.0, 2.0, 1.4), factors=(0.7, 1.0, 0.05, 0.7, 0.4, 1.0))
#: Squares of errors over stated ones count no further than this: one strange configuration does not
#: widen all others.
_MOST_SQUARE = 25.0
#: Degrees of freedom of a scatter that nothing alike was measured of.
_LEAST_FREEDOM = 3.0


@dataclass(frozen=True, eq=False)
class Scatter:
    """By how much more configurations scatter than a process says: of lines (f,), and of c
    configurations (c,)."""

    lines: Floats
    configurations: Coordinates | None = None
    squares: Floats = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(cls, learned: ShotCorrection, within_db2: Floats) -> Self:
        """From configurations that were learned from, each predicted from the others.

        `within_db2` (c, f) are mean squares of its shots about their mean: a band is that of a
        single shot.
        """
        lines = learned.prior.frequency_hz.size
        if learned.shots is None or len(learned.shots) < _FEW:
            return cls(np.ones(lines))
        errors, deviations = learned.left_out()
        of_shot = np.diag(learned.prior.shot_covariance_db2()) * (
            1 - 1 / learned.shots.shots[:, None]
        )
        squares = np.minimum((errors**2 + within_db2) / (deviations**2 + of_shot), _MOST_SQUARE)
        of_lines = (squares.sum(axis=0) + _LINE_WEIGHT) / (len(squares) + _LINE_WEIGHT)
        return cls(of_lines, learned.shots, (squares / of_lines).mean(axis=1))

    def factors(self, settings: Sequence[Setting]) -> Floats:
        """Of standard deviations at settings, (n, f)."""
        if self.configurations is None:
            return np.tile(np.sqrt(self.lines), (len(settings), 1))
        from scipy.special import stdtrit

        alike = _SCATTER_ALIKE(Coordinates.of(settings), self.configurations)
        weight = alike.sum(axis=1)
        local = (alike @ self.squares + _ALIKE_WEIGHT) / (weight + _ALIKE_WEIGHT)
        wider = stdtrit(weight + _LEAST_FREEDOM, 0.95) / stdtrit(np.inf, 0.95)
        return np.asarray(np.sqrt(local[:, None] * self.lines) * wider[:, None])


@dataclass(frozen=True, eq=False)
class SpectrumCalibration:
    """Of each of `sensors`, what to multiply a twin's spectra and peak accelerations by, and how
    sure that is.

    Settings are asked with the velocity of their impact. `shots` counts those that taught the
    sensor of which most were usable; 0 for a calibration that has the prior alone.
    """

    sensors: tuple[str, ...]
    learned: tuple[ShotCorrection, ...]
    scatter: tuple[Scatter, ...]
    shots: int = 0

    @classmethod
    def untaught(cls, sensors: Sequence[str], frequency_hz: Floats) -> Self:
        """Nothing learned: nothing is corrected, and bands have the documented spread."""
        prior = _prior(frequency_hz)
        learned = prior.after((), np.empty((0, prior.frequency_hz.size)))
        return cls(
            tuple(sensors),
            (learned,) * len(sensors),
            (Scatter(np.ones(prior.frequency_hz.size)),) * len(sensors),
        )

    @classmethod
    def of(cls, shots: MeasuredShots, predicted_db: Floats) -> Self:
        """After shots, whose levels under the measured force a twin predicts, (n, sensors, 1 +
        lines), peaks first.

        Shots with a NaN among a sensor's levels teach it nothing. Raises `ValueError` for another
        shape.
        """
        expected = (len(shots), len(shots.sensors), shots.frequency_hz.size + 1)
        if predicted_db.shape != expected:
            raise ValueError(f"predicted_db has shape {predicted_db.shape}: expected {expected}")
        measured = np.concatenate(
            [shots.peak_acceleration_m_s2[..., None], shots.spectra_m_s2], axis=-1
        )
        residual = np.roll(
            20 * np.log10(measured) - predicted_db, -1, axis=-1
        )  # the peak is the last line
        settings = at_velocities(shots.settings, shots.impact_velocity_m_s)
        learned: list[ShotCorrection] = []
        scatter: list[Scatter] = []
        counts: list[int] = []
        for number in range(len(shots.sensors)):
            rows = np.flatnonzero(np.isfinite(residual[:, number]).all(axis=-1))
            rows = rows[_most(shots.configuration[rows])]
            counts.append(rows.size)
            some = [settings[row] for row in rows]
            item, within = _learned(
                shots.frequency_hz, some, shots.configuration[rows], residual[rows, number]
            )
            learned.append(item)
            scatter.append(Scatter.of(item, within))
        return cls(shots.sensors, tuple(learned), tuple(scatter), max(counts, default=0))

    @property
    def normals(self) -> int:
        """How many standard normal numbers one draw takes: for each sensor one a line, and one for
        the peak."""
        return sum(learned.prior.frequency_hz.size for learned in self.learned)

    def factors(
        self, settings: Sequence[Setting], sensors: Sequence[str], z: Floats | None = None
    ) -> Floats:
        """By which peaks (first) and lines are multiplied at settings, (n, sensors, 1 + lines); of
        draws (d, n, ...).

        `z` (d, normals): the same for all settings, so that they can be compared. Raises
        `LookupError` for a sensor that there is none of.
        """
        parts, begin = {}, 0
        for sensor, learned, scatter in zip(self.sensors, self.learned, self.scatter, strict=True):
            stop = begin + learned.prior.frequency_hz.size
            if sensor in sensors:
                db = learned.mean_db(settings)
                if z is not None:
                    db = db + learned.draws_db(settings, z[:, begin:stop]) * scatter.factors(
                        settings
                    )
                parts[sensor] = np.roll(db, 1, axis=-1)
            begin = stop
        if missing := [sensor for sensor in sensors if sensor not in parts]:
            raise LookupError(
                f"no sensor {missing[0]!r} is calibrated; there are: "
                f"{', '.join(self.sensors) or 'none'}"
            )
        return np.asarray(10 ** (np.stack([parts[sensor] for sensor in sensors], axis=-2) / 20))


def at_velocities(settings: Sequence[Setting], velocity_m_s: Floats) -> list[Setting]:
    """Settings with the velocities that their impacts have; that of the setting, or 1 m/s, where
    that is not known."""
    set_m_s = [setting.impact_velocity_m_s or 1.0 for setting in settings]
    usable = np.where(velocity_m_s > 0, velocity_m_s, set_m_s).tolist()
    return [
        replace(setting, tank_pressure_pa=None, valve_profile=None, impact_velocity_m_s=velocity)
        for setting, velocity in zip(settings, usable, strict=True)
    ]


def stretched(
    pulses: ForcePulses, law: ForcePulses, peak_force_n: Floats, impulse_n_s: Floats
) -> ForcePulses:
    """Pulses as they become where those of a law are stretched to measured peaks and impulses,
    (n,).

    `pulses` are the law's, or what of them acts on a plate. Those without a measured force stay as
    they are.
    """
    usable = np.isfinite(peak_force_n) & np.isfinite(impulse_n_s)
    force = np.where(usable, peak_force_n / law.peak_force_n, 1.0)
    time = np.where(usable, impulse_n_s / (law.impulse_n_s * force), 1.0)
    return ForcePulses(
        pulses.contact_time_s * time,
        pulses.force_n * force[:, None],
        pulses.compression_time_s * time,
    )


def _prior(frequency_hz: Floats) -> Discrepancy:
    return Discrepancy(np.append(frequency_hz, frequency_hz.max() * 2**_PEAK_OCTAVES), TERMS)


def _most(configuration: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which shots are of the configurations that are learned from."""
    distinct = np.unique(configuration)
    picked = (
        np.linspace(0, distinct.size - 1, min(distinct.size, MOST_CONFIGURATIONS))
        .round()
        .astype(np.intp)
    )
    return np.isin(configuration, distinct[picked])


def _learned(
    frequency_hz: Floats,
    settings: Sequence[Setting],
    configuration: NDArray[np.intp],
    residual_db: Floats,
) -> tuple[ShotCorrection, Floats]:
    """From the shots of configurations (n,): their scatter from each, the rest from means over
    repeats. And the mean squares (c, f) of a configuration's shots about their mean."""
    prior = fitted(_prior(frequency_hz), settings, residual_db)
    if not len(settings):
        return prior.after((), residual_db), np.empty((0, prior.frequency_hz.size))
    groups = [residual_db[configuration == key] for key in np.unique(configuration)]
    learned = ShotCorrection.of(
        prior,
        Coordinates.of(settings).means(configuration),
        np.array([group.mean(axis=0) for group in groups]),
    )
    return learned, np.array([group.var(axis=0) for group in groups])
