"""Impacts on a plate that moves and on an anvil: limits, an oscillator, balances, a bar on a wall,
convergence."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.twin.contact.anvil import anvil_pulses
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.coupled import PlatePoint, coupled_impact
from pyroshock.twin.contact.effects.effective_mass import EffectiveMass
from pyroshock.twin.contact.effects.layer_compliance import LayerCompliance
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.impact import solve
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact_interface import ForcePulses
from pyroshock.twin.setting import THESIS
from scipy.integrate import solve_ivp
from support.records.contact_bodies import of_materials

NONE = np.zeros(0)
QUANTITIES = (
    "peak_force_n",
    "contact_time_s",
    "compression_time_s",
    "impulse_n_s",
    "deepest_indentation_m",
)


def impacts_of(
    velocity_m_s, effects=(), *, tip="steel", thickness_m=0.01, mass_kg=0.5, radius_m=0.03
):
    """On aluminium, everywhere insulated: only the layer's effect minds."""
    bodies = of_materials(
        THESIS[tip], THESIS["aluminum"], impactor_radius_m=radius_m, plate_thickness_m=thickness_m,
        impactor_mass_kg=mass_kg, impact_velocity_m_s=velocity_m_s,
    )  # fmt: skip
    nominal = Impacts.of(bodies, np.ones(len(bodies), dtype=np.bool_))
    return reduce(lambda impacts, effect: effect.prepare(impacts), effects, nominal)


def solved(impacts, point, **options):
    return coupled_impact(impacts, [point] * len(impacts.bodies), **options)


def off(found, expected, names=QUANTITIES):
    """Largest relative error of any quantity of any impact."""
    return max(
        float(np.abs(getattr(found, name) / getattr(expected, name) - 1).max()) for name in names
    )


def square_plate(thickness_m, highest_hz, damping=0.0, side_m=1.0):
    """Aluminium, simply supported, struck off its middle: Kirchhoff's modes in closed form."""
    material = THESIS["aluminum"]
    rigidity = material.youngs_modulus_pa * thickness_m**3 / (12 * (1 - material.poisson_ratio**2))
    per_area = material.density_kg_m3 * thickness_m
    i, j = np.meshgrid(np.arange(1, 400), np.arange(1, 400))
    frequency = np.pi / 2 * (i**2 + j**2) / side_m**2 * np.sqrt(rigidity / per_area)
    kept = frequency < highest_hz
    shape = 2 / np.sqrt(per_area * side_m**2) * np.sin(0.44 * np.pi * i) * np.sin(0.53 * np.pi * j)
    order = np.argsort(frequency[kept])
    impedance = 8 * np.sqrt(rigidity * per_area)
    damping_ratio = np.full(order.size, damping)
    return PlatePoint(frequency[kept][order], damping_ratio, shape[kept][order], float(impedance))


RIGID = PlatePoint(NONE, NONE, NONE, np.inf)


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (ViscousLoss(0.05),),
        (PlasticYield(),),
        (PlasticYield(4.0, hardening_exponent=0.75),),
        (ViscousLoss(0.05), PlasticYield(0.8, hardening_exponent=1.25)),
        (LayerCompliance(1e-8),),
        (LayerCompliance(1e-8, 1e-4),),
        (ViscousLoss(0.05), PlasticYield(), LayerCompliance(1e-8)),
        (PlateCompliance(0.2),),  # a dashpot in series, as relaxing polymers have
        (EffectiveMass(1.2),),
    ],
    ids=lambda effects: "+".join(effect.id for effect in effects) or "hertz",
)
def test_rigid_plate_is_the_impact_on_a_rigid_target(effects):
    impacts = impacts_of(np.linspace(1.0, 20.0, 5), effects)
    assert off(solved(impacts, RIGID), solve(impacts)) < 2e-5
    heavy = replace(
        RIGID, frequency_hz=np.zeros(1), damping_ratio=np.zeros(1), shape=np.full(1, 1e-4)
    )
    assert off(solved(impacts, heavy), solve(impacts)) < 1e-4


def oscillator(impacts, frequency_hz, damping, shape, chi=0.0):
    """One impact on one mode, by solve_ivp: time of the last parting, peak force, impulse,
    contacts."""
    k, m, u = (
        float(x[0])
        for x in (impacts.stiffness_n_mp, impacts.mass_kg, impacts.bodies.impact_velocity_m_s)
    )
    omega = 2 * np.pi * frequency_hz

    def force(state):
        x, v, q, p = state
        return k * max(x - shape * q, 0.0) ** 1.5 * (1 + chi * (v - shape * p))

    def rate(_time, state):
        _, v, q, p = state
        return [
            v,
            -force(state) / m,
            p,
            shape * force(state) - 2 * damping * omega * p - omega**2 * q,
        ]

    def gap(time, state):
        return state[0] - shape * state[2] + (1e-9 if time == 0 else 0.0)

    run = solve_ivp(
        rate,
        (0, 0.006),
        [0, u, 0, 0],
        "DOP853",
        events=gap,
        rtol=1e-12,
        atol=1e-16,
        max_step=4e-6,
        dense_output=True,
    )
    crossings = [*run.t_events[0], np.inf]  # partings and touches in turn
    contacts = (
        next(i for i in range(0, len(crossings), 2) if crossings[i + 1] > 1.5 * crossings[i]) // 2
        + 1
    )
    end = crossings[2 * contacts - 2]
    states = run.sol(np.linspace(0, end, 20001))
    return end, max(force(state) for state in states.T), m * (u - run.sol(end)[1]), contacts


@pytest.mark.parametrize(
    ("frequency", "damping", "chi"), [(900.0, 0.0, 0.0), (3000.0, 0.02, 0.0), (900.0, 0.1, 0.05)]
)
def test_one_mode_against_solve_ivp(frequency, damping, chi):
    impacts = impacts_of(np.array([5.0]), [ViscousLoss(chi)] if chi else [], tip="delrin")
    point = PlatePoint(np.array([frequency]), np.array([damping]), np.array([1.5]), np.inf)
    found = solved(impacts, point, steps=192, cycles=100.0)
    time, peak, impulse, contacts = oscillator(impacts, frequency, damping, 1.5, chi)
    assert found.contacts[0] == contacts
    assert found.contact_time_s[0] == pytest.approx(time, rel=1e-6)
    assert found.peak_force_n[0] == pytest.approx(peak, rel=1e-6)
    assert found.impulse_n_s[0] == pytest.approx(impulse, rel=1e-6)


@pytest.mark.parametrize(
    ("tip", "thickness"), [("polyurethane", 0.01), ("delrin", 0.015), ("polyurethane", 0.006)]
)
def test_plate_without_edges_is_zeners(tip, thickness):
    velocity = np.array([1.0, 5.0, 15.0])
    point = PlatePoint(
        NONE,
        NONE,
        NONE,
        float(impacts_of(velocity, thickness_m=thickness).plate_impedance_n_s_m[0]),
    )
    found = solved(
        impacts_of(velocity, tip=tip, thickness_m=thickness), point, steps=96, cycles=16.0
    )
    zener = solve(impacts_of(velocity, [PlateCompliance(1.0)], tip=tip, thickness_m=thickness))
    assert off(found, zener, ("peak_force_n", "contact_time_s", "impulse_n_s")) < 1e-4
    # Eq. 1.13 and 1.14 with the impactor's mass: lambda = m u / (l Z) over Zener's scale, 1.719
    # lambda within 0.014.
    nominal = impacts_of(velocity, tip=tip, thickness_m=thickness)
    length = (nominal.mass_kg * velocity**2 / nominal.stiffness_n_mp) ** 0.4
    inelasticity = nominal.mass_kg * velocity / (length * point.impedance_n_s_m)
    exact = np.exp(-1.719 * inelasticity)
    assert np.all(np.abs(found.separation_velocity_m_s / velocity - exact) < 0.015)


def test_modes_are_the_plate_before_its_echoes_and_above_its_table():
    """Flexural waves of up to 8 / T go 2 x 0.4 m in more than a contact of delrin on 3 mm."""
    velocity = np.array([2.0, 4.0])
    impacts = impacts_of(velocity, tip="delrin", thickness_m=0.003, mass_kg=0.01, radius_m=0.01)
    modes = solved(impacts, square_plate(0.003, 30e3, damping=0.01))
    zener = solve(impacts_of(velocity, [PlateCompliance(1.0)], tip="delrin", thickness_m=0.003,
    mass_kg=0.01,
                             radius_m=0.01))  # fmt: skip
    assert off(modes, zener, ("peak_force_n", "contact_time_s", "impulse_n_s")) < 5e-3
    assert off(solve(impacts), zener, ("peak_force_n",)) > 0.1  # of a rigid target
    # A table that ends early has the plate without edges in the place of what it lacks.
    impacts = impacts_of(np.array([2.0, 10.0]), tip="delrin", thickness_m=0.005)
    whole = solved(impacts, square_plate(0.005, 40e3))
    short = square_plate(0.005, 5e3)
    rigid_above = replace(short, impedance_n_s_m=np.inf)
    names = ("peak_force_n", "contact_time_s", "impulse_n_s")
    assert off(solved(impacts, short), whole, names) < 0.02
    assert off(solved(impacts, rigid_above), whole, names) > 0.05


def test_steps_modes_and_batches_change_nothing():
    impacts = impacts_of(np.array([1.0, 5.0, 15.0]), tip="delrin", thickness_m=0.005)
    point = square_plate(0.005, 20e3, damping=0.005)
    finest = solved(impacts, point, steps=192, cycles=32.0)
    errors = [
        off(solved(impacts, point, steps=steps, cycles=32.0), finest) for steps in (6, 12, 48)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-5
    assert (
        off(
            solved(impacts, point, cycles=8.0),
            finest,
            ("peak_force_n", "contact_time_s", "impulse_n_s"),
        )
        < 1e-4
    )
    velocity = np.array([0.5, 3.0, 12.0])
    point = square_plate(0.004, 8e3, damping=0.005)
    together = solved(impacts_of(velocity, tip="delrin", thickness_m=0.004), point)
    for row, speed in enumerate(velocity):
        alone = solved(impacts_of(np.array([speed]), tip="delrin", thickness_m=0.004), point)
        assert alone.peak_force_n[0] == together.peak_force_n[row]
        assert alone.impulse_n_s[0] == together.impulse_n_s[row]


MATERIALS = sorted(THESIS)


@settings(max_examples=40, deadline=None)
@given(
    tip=st.sampled_from(MATERIALS),
    velocity=st.floats(0.1, 30.0),
    mass=st.floats(0.02, 2.0),
    radius=st.floats(0.005, 0.1),
    frequency=st.lists(st.floats(20.0, 5000.0), min_size=1, max_size=5),
    shape=st.floats(0.1, 2.0),
    plate_mass=st.floats(0.5, 50.0),
)
def test_momentum_and_energy_are_kept(tip, velocity, mass, radius, frequency, shape, plate_mass):
    """What the impactor has lost the plate has, in a free plate of a few modes without damping."""
    impacts = impacts_of(np.array([velocity]), tip=tip, mass_kg=mass, radius_m=radius)
    rows = np.array([0.0, *sorted(frequency)])
    point = PlatePoint(
        rows, np.zeros(rows.size), np.array([plate_mass**-0.5] + [shape] * len(frequency)), np.inf
    )
    found = solved(impacts, point, steps=192, cycles=1e6)
    before = mass * velocity**2 / 2
    after = mass * found.separation_velocity_m_s[0] ** 2 / 2 + found.plate_energy_j[0]
    assert after == pytest.approx(before, rel=1e-6)
    assert found.impulse_n_s[0] == pytest.approx(
        mass * (velocity + found.separation_velocity_m_s[0]), rel=1e-9
    )
    nodes = found.shape.course
    phase = np.concatenate(
        [np.linspace(a, b, 5)[:-1] for a, b in zip(nodes.phase[:-1], nodes.phase[1:], strict=True)]
    )
    phase = np.clip(
        np.append(phase, 1.0), 0.0, 1.0
    )  # exact for the cubics between the nodes, by Boole's rule
    force = found.force_at(phase)[0]
    weights = np.zeros(phase.size)
    for i, w in enumerate((7, 32, 12, 32, 7)):
        weights[i : phase.size - 4 + i : 4] += w / 90 * 4 * np.diff(phase)[::4]
    assert weights @ force * found.contact_time_s[0] == pytest.approx(
        found.impulse_n_s[0], rel=1e-6
    )


@settings(max_examples=40, deadline=None)
@given(
    tip=st.sampled_from(MATERIALS),
    velocity=st.floats(0.1, 30.0),
    thickness=st.sampled_from([0.002, 0.005, 0.02]),
    loss=st.floats(0.0, 0.5),
    yields=st.booleans(),
    layer=st.sampled_from([0.0, 1e-8, 1e-6]),
)
def test_no_energy_is_made(tip, velocity, thickness, loss, yields, layer):
    effects = [ViscousLoss(loss), LayerCompliance(layer), *([PlasticYield()] if yields else [])]
    impacts = impacts_of(np.array([velocity]), effects, tip=tip, thickness_m=thickness)
    found = solved(impacts, square_plate(thickness, 5e3), steps=24, cycles=4.0)
    after = 0.25 * found.separation_velocity_m_s[0] ** 2 + found.plate_energy_j[0]
    assert 0 < after < 0.25 * velocity**2 * (1 + 1e-4)
    assert np.all(found.force_n(101) >= 0)


def test_bodies_may_meet_again():
    """A mode throws the impactor off and meets it again: all contacts are one pulse."""
    point = PlatePoint(np.array([900.0]), np.zeros(1), np.array([1.5]), np.inf)
    found = solved(impacts_of(np.array([5.0]), tip="delrin"), point)
    assert found.contacts[0] == 2
    force = found.force_n(2001)[0]
    between = np.flatnonzero(force[1:-1] == 0)
    assert between.size
    assert found.impulse_n_s[0] == pytest.approx(
        np.trapezoid(force) * found.contact_time_s[0] / 2000, rel=1e-3
    )


def test_bar_on_a_wall():
    """Code_Aster's handbook of validation, V5.03.100 (SDNV100), after Gibert: a bar that runs
    against a rigid wall.

    The force is rho c S V for 2 L / c, and the bar comes back as fast as it came (Saint-Venant).
    Bar: 20 cm of steel of 2 cm by 2 cm at 100 m/s, here along one axis alone, c = sqrt(E / rho).
    The bar is the body with modes, the wall an impactor that nothing stops, on a stiff spring.
    """
    modulus, density, length, section, speed = 2e11, 8000.0, 0.2, 4e-4, 100.0
    wave = np.sqrt(modulus / density)
    mass = density * length * section
    count = np.arange(0, 400)
    shape = np.where(count == 0, 1.0, np.sqrt(2)) / np.sqrt(mass)
    bar = PlatePoint(count * wave / (2 * length), np.zeros(400), shape, density * wave * section)
    contact = replace(
        impacts_of(np.array([speed]), mass_kg=1e6),
        exponent=np.ones(1),
        stiffness_n_mp=np.array([1e12]),
    )
    solution = solved(contact, bar, steps=100, cycles=50.0)
    duration, force = 2 * length / wave, density * wave * section * speed
    assert solution.contact_time_s[0] == pytest.approx(duration, rel=0.01)
    assert solution.impulse_n_s[0] == pytest.approx(2 * mass * speed, rel=2e-3)
    middle = solution.force_at(np.linspace(0.2, 0.8, 200))[0]
    assert middle.mean() == pytest.approx(force, rel=2e-3)


@pytest.mark.parametrize(
    "values",
    [
        {"damping_ratio": np.zeros(2)},
        {"impedance_n_s_m": 0.0},
        {"frequency_hz": np.array([-1.0]), "damping_ratio": np.zeros(1), "shape": np.zeros(1)},
    ],
)
def test_impossible_points_and_other_numbers_of_them_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        replace(RIGID, **values)
    with pytest.raises(ValueError, match="1 points of impact for 2 impacts"):
        coupled_impact(impacts_of(np.array([1.0, 2.0])), [RIGID])


BODIES = Bodies.of(
    impactor_radius_m=0.045, impactor_youngs_modulus_pa=200e9, impactor_poisson_ratio=0.3,
    impactor_density_kg_m3=7800.0, target_youngs_modulus_pa=200e9, target_poisson_ratio=0.3,
    target_density_kg_m3=7800.0, impact_velocity_m_s=5.0, impactor_mass_kg=0.5,
    impactor_yield_strength_pa=400e6,
    target_yield_strength_pa=400e6, plate_thickness_m=0.01,
)  # fmt: skip


def on_anvil(
    impacts: Impacts, mass_kg: float, stiffness_n_m: float, mobility_m_n_s: float, phases: int = 401
) -> ForcePulses:
    mass, stiffness, mobility = (
        np.array([value]) for value in (mass_kg, stiffness_n_m, mobility_m_n_s)
    )
    return anvil_pulses(impacts, mass, stiffness, mobility, phases)


def test_anvils_are_hertz_where_they_are_light_and_shield_the_plate_where_heavy() -> None:
    pulse, law = on_anvil(Impacts.of(BODIES), 0.02, 1e11, 0.0), hertz(BODIES)
    assert pulse.peak_force_n[0] == pytest.approx(law.peak_force_n[0], rel=0.01)
    assert pulse.impulse_n_s[0] == pytest.approx(law.impulse_n_s[0], rel=0.01)
    assert pulse.contact_time_s[0] == pytest.approx(law.contact_time_s[0], rel=0.05)
    elastic = Impacts.of(BODIES)
    yielded = PlasticYield(1.6).prepare(elastic)
    soft, hard = (
        on_anvil(impacts, 0.3, 1e10, 0.0).peak_force_n[0] for impacts in (yielded, elastic)
    )
    assert soft < 0.8 * hard
    # A joint that is softer by far than the contact rings at its own frequency with the anvil's
    # momentum. That is 2 m u M / (m + M) after an elastic impact of two free bodies; damping of 5 %
    # takes a part.
    mass, stiffness = 4.0, 1e6
    pulse = on_anvil(Impacts.of(BODIES), mass, stiffness, 0.0)
    momentum = 2 * 0.5 * 5.0 * mass / (mass + 0.5)
    assert pulse.peak_force_n[0] == pytest.approx(
        momentum * np.sqrt(stiffness / mass) * np.exp(-0.05 * np.pi / 2), rel=0.02
    )
    assert pulse.contact_time_s[0] == pytest.approx(np.pi * np.sqrt(mass / stiffness), rel=0.05)


@pytest.mark.parametrize(
    ("mass", "stiffness", "mobility"), [(1.2, 2e9, 1e-4), (0.4, 5e8, 3e-4), (2.0, 1e10, 3e-5)]
)
def test_pulse_is_that_of_another_integration(
    mass: float, stiffness: float, mobility: float
) -> None:
    """Elastic contact; the force on the plate until it first falls to half a per cent of its
    peak."""
    impacts = Impacts.of(BODIES)
    hard, own = float(impacts.stiffness_n_mp[0]), 0.5
    damping = 2 * 0.05 * np.sqrt(stiffness * mass)

    def joint(state: np.ndarray) -> np.ndarray:
        return (stiffness * (state[2] - state[4]) + damping * state[3]) / (1 + damping * mobility)

    def rate(_: float, state: np.ndarray) -> list[float]:
        x, v, y, w, _plate = state
        contact, carried = hard * max(x - y, 0.0) ** 1.5, joint(state)
        return [v, -contact / own, w, (contact - carried) / mass, mobility * carried]

    run = solve_ivp(rate, (0, 2e-3), [0, 5.0, 0, 0, 0], rtol=1e-8, atol=1e-12, max_step=1e-6)
    force = joint(run.y)
    top = int(np.argmax(force))
    last = top + int(np.flatnonzero(force[top:] < 0.005 * force[top])[0])
    first = int(np.flatnonzero(force[:top] < 0.005 * force[top])[-1])
    pulse = on_anvil(impacts, mass, stiffness, mobility)
    assert pulse.peak_force_n[0] == pytest.approx(force[top], rel=0.005)
    assert pulse.contact_time_s[0] == pytest.approx(run.t[last] - run.t[first], rel=0.02)
    assert pulse.impulse_n_s[0] == pytest.approx(
        np.trapezoid(force[first:last], run.t[first:last]), rel=0.01
    )
