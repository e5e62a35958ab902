"""Background and scatter of pulses' shapes and of the plate.

The background: what no effect explains, small and smooth over the factors, and a little for each
configuration.

Scatter from run to run: heavier tails than a normal distribution's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...virtualbench.plate.modes import PlateModes
from .case import TOLERANCES, BackgroundGap, Case
from .contact_case import CasePulse
from .designs import CaseSetting, design
from .plates import plate_of
from .unknown_effects import UnknownEffect

_FEATURES = 64


def draw_background(rng: np.random.Generator, *, rough: bool = False) -> BackgroundGap:
    """A background within tolerance: 0.2 to 0.8 of it in rms; a rough one has shorter lengths and
    up to 1.6."""
    size = float(rng.uniform(0.8, 1.6) if rough else rng.uniform(0.2, 0.8))
    share = float(rng.uniform(0.5, 1.0))  # of the variance, to the smooth part
    length = float(rng.uniform(0.4, 0.9) if rough else rng.uniform(1.2, 3.0))
    return BackgroundGap(
        smooth=size * share**0.5,
        white=size * (1 - share) ** 0.5,
        length=length,
        rough=rough,
        seed=int(rng.integers(2**31)),
    )


def scaled_factors(settings: Sequence[CaseSetting]) -> Floats:
    """Factors (C, k) in standard deviations; words as 0 and 1."""
    numbers = [
        [
            np.log(s.tank_pressure_bar or 1.0),
            np.log(s.mass_kg),
            np.log(s.tip_radius_mm),
            np.log(s.pulse_s or 1.0),
        ]
        for s in settings
    ]
    words = [(s.tip_material, s.face_material, s.insulator, s.hammer_speed) for s in settings]
    columns = [np.array(column, dtype=np.float64) for column in zip(*numbers, strict=True)]
    for column in zip(*words, strict=True):
        columns += [
            np.array([word == level for word in column], dtype=np.float64)
            for level in sorted(set(column))[1:]
        ]
    spread = [column.std() for column in columns]
    kept = [(c - c.mean()) / s for c, s in zip(columns, spread, strict=True) if s > 1e-9]
    return np.stack(kept, axis=1) if kept else np.zeros((len(settings), 1))


def background(
    what: BackgroundGap, settings: Sequence[CaseSetting], count: int, stream: str
) -> Floats:
    """`count` independent columns (C, count) in tolerances; another `stream` gives others.

    The smooth part is a sum of random Fourier features (Rahimi and Recht, 2007), of a
    squared-exponential kernel.
    """
    rng = np.random.default_rng([what.seed, *stream.encode()])
    factors = scaled_factors(settings)
    # ||d|| grows with the number of factors; the length is for one of them
    waves = rng.standard_normal((factors.shape[1], _FEATURES)) / (
        what.length * np.sqrt(factors.shape[1])
    )
    phases = rng.uniform(0, 2 * np.pi, _FEATURES)
    features = np.sqrt(2 / _FEATURES) * np.cos(factors @ waves + phases)
    smooth = features @ rng.standard_normal((_FEATURES, count))
    white = rng.standard_normal((len(settings), count))
    return np.asarray(what.smooth * smooth + what.white * white)


DOF = 5


def heavy(rng: np.random.Generator, *shape: int) -> Floats:
    """Numbers of unit variance from Student's t with 5 degrees of freedom."""
    return np.asarray(rng.standard_t(DOF, shape) / np.sqrt(DOF / (DOF - 2)))


#: Between which sizes a plate's errors of its modes are drawn, evenly in the logarithm: of
#: frequencies, of damping and of shapes. Assumed: modal tests of a structure that is hung up and
#: instrumented again differ by as much. They are the bench's own, and no tolerances of a diagnosis.
FREQUENCY, DAMPING, SHAPE = (0.0006, 0.0018), (0.03, 0.11), (0.02, 0.065)
#: Over how many octaves errors of neighbouring modes are alike.
_OCTAVES = (0.2, 3.0)
#: Every part of the plate's background and of its scatter adds to the spectra: this share of each.
_PART = 0.6
#: Of a run's scatter, in each mode and in each sensor's gain: a line of a spectrum averages over
#: its modes.
_SPREAD = 0.85
_DB = 20 / np.log(10)


def warped(pulse: CasePulse, weights: Floats, tolerance: float) -> CasePulse:
    """A pulse whose force changes smoothly over its length by a tolerance times the weights (2,):
    skewed, fuller."""
    phase = np.linspace(-1, 1, pulse.force_n.size)
    shape = 0.5 * weights[0] * np.sin(np.pi * phase) + 0.5 * weights[1] * np.cos(2 * np.pi * phase)
    return replace(pulse, force_n=pulse.force_n * (1 + tolerance * shape))


def _even_in_log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _alike(rng: np.random.Generator, octaves: Floats, count: int) -> Floats:
    """Normal deviates (count, m) of variance 1. Their correlation falls exponentially over octaves,
    at a drawn rate."""
    apart = np.abs(octaves[:, None] - octaves[None, :])
    correlation = np.exp(-apart / _even_in_log(rng, *_OCTAVES))
    return np.asarray(
        rng.standard_normal((count, octaves.size)) @ np.linalg.cholesky(correlation).T
    )


@dataclass(frozen=True, eq=False)
class PlateBackground:
    """Errors that stay: of each mode's frequency and damping (m,), of its shape at each sensor (S,
    m), ln of gains of each configuration (C, S). `spread`: of one run, ln."""

    frequency: Floats
    damping: Floats
    shapes: Floats
    configurations: Floats
    spread: float

    @classmethod
    def of(cls, case: Case) -> PlateBackground:
        plate, what = plate_of(case.kind, case.design), case.background
        rng = np.random.default_rng([what.seed, 9])
        size, modes = float(np.hypot(what.smooth, what.white)), plate.listed
        octaves = np.log2(plate.table.frequencies_hz)
        smooth, white = what.smooth / size, what.white / size
        frequency, damping, shape = (
            _even_in_log(rng, *bounds) for bounds in (FREQUENCY, DAMPING, SHAPE)
        )
        shapes = smooth * _alike(rng, octaves, 2) + white * rng.standard_normal((2, modes))
        gains = background(what, design(case.kind, case.design), 2, "plate")
        return cls(
            frequency=frequency * size * _alike(rng, octaves, 1)[0],
            damping=damping * size * _alike(rng, octaves, 1)[0],
            shapes=_PART * shape * size * shapes,
            configurations=_PART * TOLERANCES["plate"] / _DB * gains,
            spread=case.floor * TOLERANCES["plate"] / _DB * case.repetitions**0.5,
        )

    def applied(
        self, modes: PlateModes, configuration: int, rng: np.random.Generator
    ) -> PlateModes:
        """The modes as one run finds them."""
        scatter = _SPREAD * self.spread * heavy(rng, modes.frequencies_hz.size)
        gain = np.exp(self.configurations[configuration])[:, None]
        return replace(
            modes,
            frequencies_hz=modes.frequencies_hz * (1 + self.frequency),
            damping=modes.damping * np.exp(self.damping),
            shape_impact=modes.shape_impact * np.exp(scatter),
            shapes=modes.shapes * np.exp(self.shapes) * gain,
        )

    def gains(self, rng: np.random.Generator) -> Floats:
        """Scatter of each sensor in one run (S, 1)."""
        return np.asarray(np.exp(_SPREAD * self.spread * heavy(rng, 2, 1)))


def run_order(case: Case) -> NDArray[np.int64]:
    """Configuration and repetition (from 0) of each run (R, 2), in the order of runs."""
    count = len(design(case.kind, case.design))
    rng = np.random.default_rng([case.background.seed, 7])
    runs = np.stack(
        np.meshgrid(np.arange(count), np.arange(case.repetitions), indexing="ij"), axis=-1
    )
    if case.blocked:
        return np.asarray(runs[rng.permutation(count)].reshape(-1, 2))
    return np.asarray(rng.permutation(runs.reshape(-1, 2)))


def run_positions(case: Case) -> tuple[float, ...]:
    """Mean place of each configuration's runs in the order of runs, 0 to 1."""
    rows = run_order(case)
    at = np.linspace(0, 1, len(rows))
    return tuple(float(at[rows[:, 0] == c].mean()) for c in range(int(rows[:, 0].max()) + 1))


@dataclass(frozen=True, eq=False)
class CaseRuns:
    """What all runs of a case share; `rows` (R, 2) of configuration and repetition, `order` (R,)
    from 0 to 1."""

    case: Case
    plan: tuple[CaseSetting, ...]
    rows: NDArray[np.int64]
    order: Floats
    outside: UnknownEffect

    @classmethod
    def of(cls, case: Case) -> CaseRuns:
        """Those of a case."""
        plan, rows = design(case.kind, case.design), run_order(case)
        return cls(
            case,
            plan,
            rows,
            np.linspace(0, 1, len(rows)),
            UnknownEffect(case.unknown or "", case.amount, plan),
        )

    @property
    def which(self) -> NDArray[np.int64]:
        return np.asarray(self.rows[:, 0])

    @property
    def settings(self) -> list[CaseSetting]:
        return [self.plan[c] for c in self.which]

    def spread(self, stage: str) -> float:
        """Standard deviation of one run, in the stage's unit."""
        return float(self.case.floor * TOLERANCES[stage] * self.case.repetitions**0.5)

    def background(self, count: int, stream: str) -> Floats:
        """(R, count), in tolerances."""
        return background(self.case.background, self.plan, count, stream)[self.which]
