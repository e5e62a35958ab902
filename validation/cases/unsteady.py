"""Background and scatter of pulses' shapes and of the plate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from ...virtualbench.plate.modes import PlateModes
from .background import background
from .case import TOLERANCES, Case
from .contact_case import CasePulse
from .designs import design
from .heavy_tail import heavy
from .plates import plate_of

#: Between which sizes a plate's errors of its modes are drawn, evenly in the logarithm: of frequencies, of damping and
#: of shapes. Assumed: modal tests of a structure that is hung up and instrumented again differ by as much. They are the
#: bench's own, and no tolerances of a diagnosis.
FREQUENCY, DAMPING, SHAPE = (0.0006, 0.0018), (0.03, 0.11), (0.02, 0.065)
#: Over how many octaves errors of neighbouring modes are alike.
_OCTAVES = (0.2, 3.0)
#: Every part of the plate's background and of its scatter adds to the spectra: this share of each.
_PART = 0.6
#: Of a run's scatter, in each mode and in each sensor's gain: a line of a spectrum averages over its modes.
_SPREAD = 0.85
_DB = 20 / np.log(10)


def warped(pulse: CasePulse, weights: Floats, tolerance: float) -> CasePulse:
    """A pulse whose force changes smoothly over its length by a tolerance times the weights (2,): skewed, fuller."""
    phase = np.linspace(-1, 1, pulse.force_n.size)
    shape = 0.5 * weights[0] * np.sin(np.pi * phase) + 0.5 * weights[1] * np.cos(2 * np.pi * phase)
    return replace(pulse, force_n=pulse.force_n * (1 + tolerance * shape))


def _even_in_log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _alike(rng: np.random.Generator, octaves: Floats, count: int) -> Floats:
    """Normal deviates (count, m) of variance 1. Their correlation falls exponentially over octaves, at a drawn rate."""
    apart = np.abs(octaves[:, None] - octaves[None, :])
    correlation = np.exp(-apart / _even_in_log(rng, *_OCTAVES))
    return np.asarray(rng.standard_normal((count, octaves.size)) @ np.linalg.cholesky(correlation).T)


@dataclass(frozen=True, eq=False)
class PlateBackground:
    """Errors that stay: of each mode's frequency and damping (m,), of its shape at each sensor (S, m), ln of gains of
    each configuration (C, S). `spread`: of one run, ln."""

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
        frequency, damping, shape = (_even_in_log(rng, *bounds) for bounds in (FREQUENCY, DAMPING, SHAPE))
        shapes = smooth * _alike(rng, octaves, 2) + white * rng.standard_normal((2, modes))
        gains = background(what, design(case.kind, case.design), 2, "plate")
        return cls(
            frequency=frequency * size * _alike(rng, octaves, 1)[0],
            damping=damping * size * _alike(rng, octaves, 1)[0],
            shapes=_PART * shape * size * shapes,
            configurations=_PART * TOLERANCES["plate"] / _DB * gains,
            spread=case.floor * TOLERANCES["plate"] / _DB * case.repetitions**0.5,
        )

    def applied(self, modes: PlateModes, configuration: int, rng: np.random.Generator) -> PlateModes:
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
