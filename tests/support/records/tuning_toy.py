"""A bench in closed form: a half-sine pulse into five modes, whose spectrum is quick to tell and
plausible."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pyroshock.twin.setting import THESIS
from pyroshock.twin.tune.space import ContinuousRange, TuningSpace

LINES = 100 * 2.0 ** (np.arange(41) / 6)
SPACE = TuningSpace(
    plate=THESIS["aluminum"],
    plate_thickness_m=0.01,
    plate_mass_kg=8.0,
    tips=(THESIS["PLA"], THESIS["aluminum"], THESIS["steel"]),
    tip_radii_m=(0.03, 0.06),
    anvils=(None, THESIS["steel"]),
    insulators=("none", "polymeric"),
    impact_positions=("#1", "#2"),
    tank_pressure_pa=ContinuousRange(0.5e5, 8e5),
    impactor_mass_kg=ContinuousRange(0.2, 1.0),
)
_MODES_HZ = np.array([180.0, 420.0, 900.0, 2100.0, 5200.0])
_SHAPES = {"#1": np.array([1.0, 0.4, 0.8, 0.3, 0.6]), "#2": np.array([0.3, 1.0, 0.4, 0.9, 0.3])}


def contact_time_s(setting):
    softness = 69.9e9 / setting.tip.youngs_modulus_pa
    layer = 2.0 if setting.insulator == "polymeric" else 0.9 if setting.anvil else 1.0
    return (
        1.5e-4
        * layer
        * softness**0.2
        * (setting.impactor_mass_kg**2 / setting.tip_radius_m / 20) ** 0.2
    )


def spectrum(setting):
    """Impulse times modes, each with its resonance at Q = 10 and the half-sine's content at it."""
    velocity = 25 * np.sqrt(setting.tank_pressure_pa / 8e5 / setting.impactor_mass_kg)
    impulse = setting.impactor_mass_kg * velocity
    x = 2 * _MODES_HZ * contact_time_s(setting)
    content = 1 / np.sqrt(1 + x**4)
    ratio = LINES[:, None] / _MODES_HZ
    gain = ratio**2 / np.sqrt((1 - ratio**2) ** 2 + (ratio / 10) ** 2)
    strength = impulse * _MODES_HZ * content * _SHAPES[setting.impact_position]
    return np.sqrt(np.sum((gain * strength) ** 2, axis=1))


@dataclass(frozen=True)
class Toy:
    spread_db: float = 0.0
    frequency_hz: np.ndarray = field(default_factory=lambda: LINES)

    def spectra(self, settings):
        return np.array([spectrum(s) for s in settings])

    def draws(self, settings, count, rng):
        apart = self.spread_db * rng.standard_normal((count, 1, 1))
        return self.spectra(settings) * 10 ** (apart / 20)
