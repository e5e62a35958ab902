"""What a withheld campaign's contact does: pulses from the bench's chain, and the figures that are
compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from ...virtualbench.effects import Effects, EffectSwitch
from ...virtualbench.impact.build import Impactor, ImpactTarget, Layer, contact_material, target
from ...virtualbench.impact.integrate import contact_forces
from ...virtualbench.second_laws.contact import contact_forces as second_forces
from ...virtualbench.second_laws.sensors import force_read
from ...virtualbench.sensors.filters import low_passed
from .designs import CaseSetting

#: The load cell's electronics at strength 1 of sensor.force_bandwidth.
FORCE_CORNER_HZ = 25e3
PLATE_THICKNESS_M = 0.010
_MOST_SAMPLES = 2000


class _Bare(ImpactTarget):
    """A target whose anvil is a face alone, of no mass: an insulator may lie on the plate."""

    def __post_init__(self) -> None:
        return


@dataclass(frozen=True, eq=False)
class CasePulse:
    """Force (n,) in N from first contact, at even steps."""

    force_n: Floats
    step_s: float

    @property
    def figures(self) -> Floats:
        """ln of peak (N), impulse (N s) and width at half of the peak (s); NaN without any
        force."""
        peak = int(np.argmax(self.force_n))
        top = self.force_n[peak]
        if not top > 0:
            return np.full(3, np.nan)
        above = np.flatnonzero(self.force_n > top / 2)
        first, last = int(above[0]), int(above[-1])
        width = (
            last
            - first
            + _share(self.force_n, first - 1, top / 2)
            + _share(self.force_n[::-1], -last - 2, top / 2)
        )
        return np.log([top, self.force_n.sum() * self.step_s, width * self.step_s])

    def scaled(self, amplitude: float, time: float) -> CasePulse:
        """The same shape, so many times as high and as long."""
        return replace(self, force_n=self.force_n * amplitude, step_s=self.step_s * time)

    def on(self, time_s: Floats) -> Floats:
        """Force at times (k,), 0 outside."""
        return np.interp(
            time_s, self.step_s * np.arange(self.force_n.size), self.force_n, left=0.0, right=0.0
        )


def _share(force: Floats, before: int, level: float) -> float:
    """Part of the step from sample `before` to the next that lies above the level."""
    if before < -force.size or before == -1:
        return 0.0
    low, high = force[before], force[before + 1]
    return float((high - level) / (high - low)) if high > low else 0.0


def strikes(
    settings: Sequence[CaseSetting],
    speeds_m_s: Floats,
    strengths: Mapping[str, float],
    laws: str = "",
) -> list[CasePulse]:
    """The true pulses of impacts (n) at true speeds (n,)."""
    if laws:
        bodies = (
            [_impactor(setting) for setting in settings],
            [_target(setting) for setting in settings],
        )
        return [
            _pulse(step, force)
            for step, force in second_forces(*bodies, strengths, laws, speeds_m_s)
        ]
    acting = tuple(
        EffectSwitch(name, strength=v)
        for name, v in strengths.items()
        if name.startswith("contact.")
    )
    forces = contact_forces(
        [_impactor(setting) for setting in settings],
        [_target(setting) for setting in settings],
        Effects(acting),
        speeds_m_s,
        np.random.default_rng(0),
        steps_per_contact=300,
    )
    return [_pulse(step, force) for step, force in forces]


def _pulse(step: float, force: Floats) -> CasePulse:
    """A pulse that ends at zero, without more samples than it needs: stiff links take short
    steps."""
    every = max(1, force.size // _MOST_SAMPLES)
    return CasePulse(np.append(force[::every], 0.0), step * every)


def cell_reading(pulse: CasePulse, strengths: Mapping[str, float], laws: str = "") -> CasePulse:
    """What the load cell shows of a true pulse."""
    if laws:
        read = force_read(pulse.force_n, pulse.step_s, strengths, laws, FORCE_CORNER_HZ)
        return replace(pulse, force_n=read)
    force = pulse.force_n * (1 + strengths.get("sensor.force_gain", 0.0))
    strength = strengths.get("sensor.force_bandwidth", 0.0)
    if strength:
        corner = FORCE_CORNER_HZ / strength
        room = np.zeros(int(3.0 / corner / pulse.step_s) + 1)
        force = low_passed(np.concatenate([[0.0], force, room]), pulse.step_s, corner)
    return replace(pulse, force_n=force)


def _impactor(setting: CaseSetting) -> Impactor:
    return Impactor(
        contact_material(setting.tip_material), setting.tip_radius_mm * 1e-3, setting.mass_kg
    )


def _target(setting: CaseSetting) -> ImpactTarget:
    layer = Layer() if setting.insulator == "polymeric" else None
    impedance = target(setting.plate_material, PLATE_THICKNESS_M).plate_impedance_n_s_m
    return _Bare(contact_material(setting.face_material), impedance, None, layer)
