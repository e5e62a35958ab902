"""What effects of the contact do to pulses that no law gave: what they do to Hertz' impact, by
similarity.

Peak and times change by the same factors, and the shape, force over its peak at equal phases, by
the same difference. For a mass that a model never saw these are Hertz' laws of similarity: peak ~
m^0.6, times ~ m^0.4, impulse ~ m.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...array_types import Floats
from ..contact_interface import ForcePulses, ImpactBatch
from ..effects import Effect
from .impact import impact, trimmed
from .impacts import bodies_of, impedance, insulated


def with_effects(
    pulses: ForcePulses, strikes: ImpactBatch, effects: Sequence[Effect]
) -> ForcePulses:
    """The pulses of `strikes` as Hertz' impact changes under `effects`; of that impact itself, what
    it then is.

    Momentum and energy hold: an impulse of at most two momenta of the impactor stays below two of
    those that it has with the effects. Raises as `impact`.
    """
    points = pulses.force_n.shape[1]
    without, acting = (_law_pulses(strikes, chosen, points) for chosen in ((), effects))
    force = changed_force(pulses.force_n, without.force_n, acting.force_n)
    time = acting.contact_time_s / without.contact_time_s
    compression = acting.compression_time_s / without.compression_time_s
    changed = ForcePulses(
        pulses.contact_time_s * time, force, pulses.compression_time_s * compression
    )
    momentum = (
        np.array([setting.impactor_mass_kg for setting in strikes.settings])
        * strikes.impact_velocity_m_s
    )
    most = np.maximum(2 * momentum, pulses.impulse_n_s) * np.maximum(
        1, acting.impulse_n_s / without.impulse_n_s
    )
    kept = np.minimum(1, most / changed.impulse_n_s)
    return ForcePulses(changed.contact_time_s, force * kept[:, None], changed.compression_time_s)


def changed_force(force_n: Floats, without_n: Floats, with_n: Floats) -> Floats:
    """Forces (n, p) as a law's change from `without_n` to `with_n`, all at the same phases: peak by
    ratio, shape by difference."""
    peak, before, after = (
        values.max(axis=1, keepdims=True) for values in (force_n, without_n, with_n)
    )
    shape = np.maximum(force_n / peak + with_n / after - without_n / before, 0.0)
    return np.asarray(shape / shape.max(axis=1, keepdims=True) * peak * after / before)


def _law_pulses(strikes: ImpactBatch, effects: Sequence[Effect], points: int) -> ForcePulses:
    place = impedance(strikes)
    solved = impact(
        bodies_of(strikes), effects, insulated=insulated(strikes), plate_impedance_n_s_m=place
    )
    return trimmed(solved, points)
