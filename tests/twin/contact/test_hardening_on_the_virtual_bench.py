"""What the hardening of yield is worth: pulses of Meyer's law, whose index the twin does not
know."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.impact import impact
from pyroshock.virtualbench.impact.build import hammer, target
from pyroshock.virtualbench.second_laws.contact import MEYER_INDEX, contact_forces
from scipy.optimize import least_squares

VELOCITIES = np.geomspace(0.5, 6.0, 7)
PEAK, WIDTH, RISE = range(3)


def features(step_s: Floats, force_n: Floats) -> Floats:
    """Logarithms of a pulse's peak (N), of the time above a tenth of it (s) and of that from there
    to the peak (s)."""
    peak, top = force_n.max(), int(force_n.argmax())
    above = np.flatnonzero(force_n > 0.1 * peak)
    first, last = above[0], above[-1]
    begin = first - (force_n[first] - 0.1 * peak) / (force_n[first] - force_n[first - 1])
    end = last + (force_n[last] - 0.1 * peak) / (force_n[last] - force_n[last + 1])
    return np.log([peak, (end - begin) * step_s, (top - begin) * step_s])


def measured(tip: str, strength: float) -> tuple[Bodies, Floats]:
    """A rigid hammer on steel by the development law: what the twin knows of it, and its pulses'
    features (v, 3)."""
    impactor = replace(
        hammer(tip, 0.03), tip_height_m=math.inf, rear_fraction=0.0, rear_resonance_hz=0.0
    )
    struck = target("steel", 0.010, anvil_material="steel")
    n = len(VELOCITIES)
    pulses = contact_forces(
        [impactor] * n, [struck] * n, {"contact.plastic_yield": strength}, "development", VELOCITIES
    )
    bodies = Bodies.of(
        impactor_radius_m=np.full(n, impactor.tip_radius_m),
        impactor_mass_kg=impactor.mass_kg,
        impact_velocity_m_s=VELOCITIES,
        **{
            f"{side}_{name}": getattr(material, name)
            for side, material in (("impactor", impactor.tip), ("target", struck.face))
            for name in ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa")
        },
    )
    padded = [(step, np.concatenate([[0.0], force, [0.0]])) for step, force in pulses]
    return bodies, np.array([features(*pulse) for pulse in padded])


def misfit(
    bodies: Bodies, wanted: Floats, columns: list[int], hardens: bool
) -> tuple[float, Floats]:
    """The rms over those features, as a share, of the best `PlasticYield`, and its parameters."""

    def residuals(place: Floats) -> Floats:
        pulse = impact(
            bodies, [PlasticYield(float(np.exp(place[0])), float(place[1]) if hardens else 1.0)]
        )
        steps = pulse.contact_time_s / 1000
        fitted_features = [
            features(step, force) for step, force in zip(steps, pulse.force_n(1001), strict=True)
        ]
        return np.ravel((np.array(fitted_features) - wanted)[:, columns])

    count = 1 + hardens
    bounds = ([np.log(0.3), 0.2][:count], [np.log(20.0), 1.5][:count])
    starts = [[pressure, 1.1][:count] for pressure in np.log([0.6, 1.5, 4.0])]
    best = min(
        (least_squares(residuals, s, bounds=bounds, diff_step=1e-4) for s in starts),
        key=lambda fit: fit.cost,
    )
    return float(np.sqrt(np.mean(best.fun**2))), best.x


@pytest.mark.parametrize(
    ("tip", "strength", "loading", "pulse"),
    [
        ("steel", 1.0, 0.2, 0.92),
        ("steel", 3.0, 0.05, 0.8),
        ("delrin", 1.0, 0.6, 0.93),
        ("delrin", 3.0, 0.05, 0.65),
    ],
)
def test_pulses_of_meyers_law_are_met_closer_with_hardening(
    tip: str, strength: float, loading: float, pulse: float
) -> None:
    """The misfit of peak and rise becomes a small share of that with r = 1, and r is near half of
    Meyer's index.

    The misfit of peak and width falls less: that law lets the bodies part along a contact of the
    radius sqrt(2 R delta), eq. 1.17 along one of sqrt(R delta), which springs back further.
    """
    bodies, wanted = measured(tip, strength)
    for columns, share in (([PEAK, RISE], loading), ([PEAK, WIDTH], pulse)):
        (straight, _), (hardening, _) = (
            misfit(bodies, wanted, columns, hardens) for hardens in (False, True)
        )
        assert hardening < share * straight
    exponent = misfit(bodies, wanted, [PEAK, RISE], hardens=True)[1][1]
    assert exponent == pytest.approx(MEYER_INDEX[tip] / 2, abs=0.08)
