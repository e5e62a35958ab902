"""What every law of contact keeps to, and its bodies: broadcast, or refused by name."""

from __future__ import annotations

import math
import time
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.twin.contact.bodies import Bodies, MissingQuantityError
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.laws import LAWS, LOSSY, RESTITUTIONS, contact_law
from pyroshock.twin.contact.pulse import ContactPulse, Law
from pyroshock.twin.contact.restitution_laws import Restitution
from support.records.contact_bodies import DELRIN, any_impacts, impacts, impulse

ALL = {**LAWS, **{f"{law}, {e}": contact_law(law, e) for law in LOSSY for e in RESTITUTIONS}}
every_law = pytest.mark.parametrize("law", ALL.values(), ids=ALL.keys())

#: Powers of kilogram, metre and second.
DIMENSIONS = {
    "radius_m": (0, 1, 0),
    "thickness_m": (0, 1, 0),
    "mass_kg": (1, 0, 0),
    "modulus_pa": (1, -1, -2),
    "strength_pa": (1, -1, -2),
    "density_kg_m3": (1, -3, 0),
    "velocity_m_s": (0, 1, -1),
    "ratio": (0, 0, 0),
}


def _in_other_units(bodies: Bodies, units: np.ndarray) -> Bodies:
    values = {}
    for item in fields(bodies):
        powers = next(powers for end, powers in DIMENSIONS.items() if item.name.endswith(end))
        values[item.name] = getattr(bodies, item.name) * np.prod(units ** np.array(powers))
    return Bodies.of(**values)


@every_law
@settings(max_examples=30)
@given(bodies=any_impacts, units=st.tuples(*[st.sampled_from([0.1, 0.3, 1.0, 7.0])] * 3))
def test_units_do_not_matter(law: Law, bodies: Bodies, units: tuple[float, float, float]) -> None:
    kilogram, metre, second = units
    here, there = law(bodies), law(_in_other_units(bodies, np.array(units)))
    force = kilogram * metre / second**2
    assert there.contact_time_s == pytest.approx(here.contact_time_s * second, rel=1e-9)
    assert there.compression_time_s == pytest.approx(here.compression_time_s * second, rel=1e-9)
    assert there.impulse_n_s == pytest.approx(here.impulse_n_s * force * second, rel=1e-9)
    assert there.force_n() == pytest.approx(
        here.force_n() * force, rel=1e-6, abs=1e-9 * force * here.peak_force_n[0]
    )


@every_law
@settings(max_examples=20)
@given(bodies=any_impacts)
def test_pulse_pushes_and_ends_at_zero(law: Law, bodies: Bodies) -> None:
    pulse = law(bodies)
    force = pulse.force_n(101)
    assert np.all(force[:, [0, -1]] == 0)
    assert np.all((force >= 0) & (force <= (1 + 1e-4) * pulse.peak_force_n[:, None]))
    assert np.all(
        (pulse.compression_time_s > 0) & (pulse.compression_time_s < pulse.contact_time_s)
    )


@every_law
def test_impulse_is_the_integral_of_the_force_and_impacts_do_not_meet(law: Law) -> None:
    """Each impact alone gives what it gives among others."""
    speeds = np.array([0.3, 1.0, 30.0])
    pulse = law(impacts(impact_velocity_m_s=speeds))
    assert impulse(pulse.contact_time_s, pulse.force_n(5001)) == pytest.approx(
        pulse.impulse_n_s, rel=1e-5
    )
    alone = [law(impacts(impact_velocity_m_s=speed)).force_n()[0] for speed in speeds]
    assert pulse.force_n() == pytest.approx(np.array(alone), rel=1e-9)


@every_law
def test_a_campaign_in_one_call(law: Law) -> None:
    bodies = impacts(impact_velocity_m_s=np.linspace(0.2, 2, 1800))
    started = time.perf_counter()
    assert law(bodies).force_n().shape == (1800, 20)
    assert time.perf_counter() - started < 1.0


def test_unknown_names_and_phases_are_refused_and_ends_have_no_force() -> None:
    for name in ("hunter", "reed", "hertz"):
        restitution = LAWS[name](impacts()).restitution
        assert restitution.value == pytest.approx(1.0)
        assert not restitution.clipped.any()
    bodies = impacts(impact_velocity_m_s=90.0)
    times = [
        float(contact_law("hann", name)(bodies).contact_time_s[0]) for name in (None, *RESTITUTIONS)
    ]
    assert times[0] == times[1] != times[2]
    with pytest.raises(
        LookupError, match="'hanning'; there are: hunter, reed, hertz, hann, hunt-crossley"
    ):
        contact_law("hanning")
    with pytest.raises(LookupError, match="'newton'; there are: zener, weir-tallon"):
        contact_law("hann", "newton")
    with pytest.raises(ValueError, match="restitution 'zener' for 'reed'"):
        contact_law("reed", "zener")
    for phase in (-0.1, 1.001, float("nan")):
        with pytest.raises(ValueError, match="expected all in \\[0, 1\\]"):
            LAWS["hunter"](impacts()).force_at(np.array([0.5, phase]))

    def flat(phase: np.ndarray) -> np.ndarray:
        return np.ones((2, phase.size))

    one = np.ones(2)
    pulse = ContactPulse(one, one, np.array([3.0, 5.0]), one, Restitution.bounded(one), flat)
    assert pulse.force_at(np.array([0.0, 1e-12, 0.5, 1.0])).tolist() == [[0, 3, 3, 0], [0, 5, 5, 0]]
    assert pulse.force_n().shape == (2, 20), "as the thesis keeps its pulses"
    with pytest.raises(ValueError, match=r"phases from -0\.1 to 0\.5: expected all in \[0, 1\]"):
        pulse.force_at(np.array([-0.1, 0.5]))
    with pytest.raises(ValueError, match=r"phases from 0\.5 to 1\.1"):
        pulse.force_at(np.array([0.5, 1.1]))


def test_ten_thousand_in_one_call() -> None:
    """Within ten seconds of the processor, many times what it takes; each its own."""
    bodies = impacts(impact_velocity_m_s=np.linspace(0.1, 5, 10_000))
    started = time.process_time()
    pulse = impact(bodies, [ViscousLoss(0.05), PlasticYield(), PlateCompliance(0.3)])
    assert time.process_time() - started < 10
    assert np.all(np.diff(pulse.peak_force_n) > 0)
    assert np.all(np.diff(pulse.restitution.value) < 0)


def test_numbers_broadcast_to_impacts_of_balls_and_tips() -> None:
    bodies = impacts(impact_velocity_m_s=[0.5, 1.0, 2.0])
    assert len(bodies) == 3
    assert bodies.plate_thickness_m is not None
    assert bodies.plate_thickness_m.tolist() == [0.01] * 3
    # A bearing ball of 1 inch weighs 66.8 g.
    assert impacts(
        impactor_radius_m=0.0127, impactor_density_kg_m3=7790
    ).sphere_mass_kg == pytest.approx(0.0668, 1e-3)
    rigid = impacts(target_youngs_modulus_pa=1e30)
    assert rigid.compliance_1_pa == pytest.approx((1 - 0.35**2) / 3.2e9, rel=1e-12)


@pytest.mark.parametrize("name", [name for name in DELRIN if not name.endswith("poisson_ratio")])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_unphysical_bodies_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} = {value!r}: expected positive and finite"):
        impacts(**{name: [DELRIN[name], value]})


def test_impossible_unlike_and_missing_quantities_are_refused_by_name() -> None:
    """A quantity after one that is not known is looked at, too."""
    with pytest.raises(ValueError, match=r"plate_thickness_m = -2\.0: expected positive"):
        impacts(impactor_yield_strength_pa=None, plate_thickness_m=[0.01, -2.0, -3.0])
    for value in (-1.0, 0.51, math.nan):
        with pytest.raises(ValueError, match=f"target_poisson_ratio = {value!r}"):
            impacts(target_poisson_ratio=value)
    with pytest.raises(ValueError, match="impactor_radius_m has shape"):
        replace(impacts(), impactor_radius_m=np.ones(2))
    bodies = Bodies.of(
        **{name: value for name, value in DELRIN.items() if name != "impactor_mass_kg"}
    )
    with pytest.raises(
        MissingQuantityError, match="Hertz' impact needs impactor_mass_kg"
    ) as caught:
        bodies.needed("impactor_mass_kg", "Hertz' impact")
    assert caught.value.quantity == "impactor_mass_kg"
