"""The background: what no effect explains, small and smooth over the factors, and a little for each configuration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...array_types import Floats
from .case import BackgroundGap
from .designs import CaseSetting

_FEATURES = 64


def draw_background(rng: np.random.Generator, *, rough: bool = False) -> BackgroundGap:
    """A background within tolerance: 0.2 to 0.8 of it in rms; a rough one has shorter lengths and up to 1.6."""
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
        [np.log(s.tank_pressure_bar or 1.0), np.log(s.mass_kg), np.log(s.tip_radius_mm), np.log(s.pulse_s or 1.0)]
        for s in settings
    ]
    words = [(s.tip_material, s.face_material, s.insulator, s.hammer_speed) for s in settings]
    columns = [np.array(column, dtype=np.float64) for column in zip(*numbers, strict=True)]
    for column in zip(*words, strict=True):
        columns += [np.array([word == level for word in column], dtype=np.float64) for level in sorted(set(column))[1:]]
    spread = [column.std() for column in columns]
    kept = [(c - c.mean()) / s for c, s in zip(columns, spread, strict=True) if s > 1e-9]
    return np.stack(kept, axis=1) if kept else np.zeros((len(settings), 1))


def background(what: BackgroundGap, settings: Sequence[CaseSetting], count: int, stream: str) -> Floats:
    """`count` independent columns (C, count) in tolerances; another `stream` gives others.

    The smooth part is a sum of random Fourier features (Rahimi and Recht, 2007), of a squared-exponential kernel.
    """
    rng = np.random.default_rng([what.seed, *stream.encode()])
    factors = scaled_factors(settings)
    # ||d|| grows with the number of factors; the length is for one of them
    waves = rng.standard_normal((factors.shape[1], _FEATURES)) / (what.length * np.sqrt(factors.shape[1]))
    phases = rng.uniform(0, 2 * np.pi, _FEATURES)
    features = np.sqrt(2 / _FEATURES) * np.cos(factors @ waves + phases)
    smooth = features @ rng.standard_normal((_FEATURES, count))
    white = rng.standard_normal((len(settings), count))
    return np.asarray(what.smooth * smooth + what.white * white)
