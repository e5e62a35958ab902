"""Impacts solved as motions: against scipy's solver, closed forms, balances and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.twin.contact import kernel
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.hertz import hertz, matched_damping
from pyroshock.twin.contact.impact import ImpactPulse, impact, solve
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact.laws import hunt_crossley
from pyroshock.twin.contact.restitution_laws import constant, inelasticity, zener
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from support.records.contact_bodies import any_impacts, ball, impacts, impulse

ONE = impacts()
FORCE = float(hertz(ONE).peak_force_n[0])
DURATION = float(hertz(ONE).contact_time_s[0])
DEPTH = 1.2 * float(hertz(ONE).compression_time_s[0])  # about the deepest indentation


def _impacts(bodies: Bodies = ONE, **quantities: float) -> Impacts:
    given = {name: np.full(len(bodies), value) for name, value in quantities.items()}
    return replace(Impacts.of(bodies), **given)


CASES = {
    "hertz": _impacts(),
    "viscous": _impacts(rate_loss_s_m=0.6),
    "very viscous": _impacts(rate_loss_s_m=15.0),
    "yield": _impacts(yield_load_n=0.2 * FORCE),
    "early yield": _impacts(yield_load_n=0.003 * FORCE),
    "hardly hardens": _impacts(yield_load_n=0.2 * FORCE, hardening_exponent=0.4),
    "hardens": _impacts(yield_load_n=0.05 * FORCE, hardening_exponent=1.2),
    "layer": _impacts(layer_compliance_m_n=0.5 * DEPTH / FORCE),
    "soft layer": _impacts(layer_compliance_m_n=50 * DEPTH / FORCE),
    "stiffening layer": _impacts(
        layer_compliance_m_n=5 * DEPTH / FORCE, layer_stiffening_1_n=8 / FORCE
    ),
    "crushed layer": _impacts(
        layer_compliance_m_n=30 * DEPTH / FORCE, layer_stiffening_1_n=100 / FORCE
    ),
    "plate": _impacts(plate_mobility_m_n_s=0.4 * 1.2 / FORCE),
    "thin plate": _impacts(plate_mobility_m_n_s=2 * 1.2 / FORCE),
    "flat": _impacts(exponent=1.0, stiffness_n_mp=2 * FORCE / DEPTH),
    "cone": _impacts(exponent=2.0, stiffness_n_mp=2 * FORCE / DEPTH**2),
    "worn, all at once": _impacts(
        exponent=1.3,
        stiffness_n_mp=FORCE / DEPTH**1.3,
        rate_loss_s_m=0.2,
        yield_load_n=0.3 * FORCE,
        hardening_exponent=0.8,
        layer_compliance_m_n=0.2 * DEPTH / FORCE,
        layer_stiffening_1_n=2 / FORCE,
        plate_mobility_m_n_s=0.1 * 1.2 / FORCE,
    ),
}
every_case = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())


def _by_scipy(case: Impacts) -> dict[str, float]:
    """One impact in SI, by a Runge-Kutta method of order 8 with events; its own writing of the same
    equations."""
    m, k, p = (float(v[0]) for v in (case.mass_kg, case.stiffness_n_mp, case.exponent))
    chi, load = float(case.rate_loss_s_m[0]), float(case.yield_load_n[0])
    layer, mobility = float(case.layer_compliance_m_n[0]), float(case.plate_mobility_m_n_s[0])
    stiffening = float(case.layer_stiffening_1_n[0])
    u = float(case.bodies.impact_velocity_m_s[0])
    yields, hardening = (load / k) ** (1 / p), float(case.hardening_exponent[0])

    def loading(d):
        if d <= yields:
            return k * max(d, 0) ** p, p * k * max(d, 0) ** (p - 1)
        slope = p * load / yields
        beyond = yields * ((d / yields) ** hardening - 1) / hardening
        return load + slope * beyond, slope * (d / yields) ** (hardening - 1)

    def force_and_approach(law, d, v):
        static, slope = law(d)
        approach = (v - mobility * static) / (1 + chi * mobility * static)
        return (
            static * (1 + chi * approach),
            approach,
            approach / (1 + layer / (1 + stiffening * static) * slope),
        )

    def run(law, start, event, time):
        def rate(_, state):
            force, _approach, indentation = force_and_approach(law, state[0], state[1])
            return [indentation, -force / m]

        event.terminal, event.direction = True, -1
        # Short steps: the place of an event is only as good as the polynomial between two of them.
        options = {"rtol": 1e-11, "atol": 1e-15, "max_step": DURATION / 20}
        found = solve_ivp(
            rate, (time, time + 1), start, "DOP853", events=event, dense_output=True, **options
        )
        return found.t[-1], found.y[:, -1], found.sol

    turn, (deepest, velocity), sol = run(
        loading, [0.0, u], lambda _, s: force_and_approach(loading, s[0], s[1])[1], 0.0
    )
    top = loading(deepest)[0]
    recovered = deepest * top / (k * deepest**p) if deepest > yields else deepest

    def unloading(d):
        share = max((d - deepest + recovered) / recovered, 0)
        return top * share**p, p * top / recovered * share ** (p - 1)

    end, (_, velocity), _ = run(
        unloading, [deepest, velocity], lambda _, s: s[0] - deepest + recovered, turn
    )

    def negative(t):
        return -force_and_approach(loading, *sol(t))[0]

    coarse = np.linspace(0, turn, 400)
    best = coarse[np.argmin([negative(t) for t in coarse])]
    near = minimize_scalar(
        negative,
        bounds=(best - turn / 400, min(best + turn / 400, turn)),
        method="bounded",
        options={"xatol": 1e-13},
    )
    return {
        "peak_force_n": max(-near.fun, -negative(turn)),
        "contact_time_s": end,
        "compression_time_s": turn,
        "deepest_indentation_m": deepest,
        "impulse_n_s": m * (u - velocity),
        "separation_velocity_m_s": -velocity,
    }


@every_case
def test_scipys_solver_finds_the_same(case: Impacts) -> None:
    found, expected = solve(case), _by_scipy(case)
    values = {name: float(getattr(found, name)[0]) for name in expected}
    assert values == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert found.parted.all()


SMOOTH = {name: case for name, case in CASES.items() if name != "worn, all at once"}


@pytest.mark.parametrize("case", SMOOTH.values(), ids=SMOOTH.keys())
def test_error_falls_with_the_fourth_power_of_the_step(case: Impacts) -> None:
    """With a layer and an exponent that is no multiple of 1/2 it falls more slowly, from less than
    1e-6."""

    def errors(steps: int) -> float:
        one = solve(case, steps)
        return max(
            float(abs(getattr(one, name) / getattr(exact, name) - 1)[0])
            for name in (
                "contact_time_s",
                "compression_time_s",
                "impulse_n_s",
                "deepest_indentation_m",
            )
        )

    exact = solve(case, 384)
    assert errors(48) / errors(96) > 2**3.5


def test_without_effects_it_is_hertz_and_nothing_is_clipped() -> None:
    bodies = impacts(impact_velocity_m_s=[0.2, 1.0, 30.0], impactor_mass_kg=[0.1, 1.0, 3.0])
    ours, closed = impact(bodies), hertz(bodies)
    for name in ("contact_time_s", "compression_time_s", "peak_force_n", "impulse_n_s"):
        assert getattr(ours, name) == pytest.approx(getattr(closed, name), rel=1e-7)
    assert ours.force_n(101) == pytest.approx(
        closed.force_n(101), abs=1e-6 * closed.peak_force_n.max()
    )
    bodies = impacts(impact_velocity_m_s=np.geomspace(0.1, 10, 40))
    for exponent in (1.0, 1.5, 2.2):
        restitution = solve(_impacts(bodies, exponent=exponent)).restitution
        assert not restitution.clipped.any()
        assert restitution.value == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("restitution", [0.02, 0.1, 0.5, 0.9])
def test_rate_loss_is_hunt_and_crossley(restitution: float) -> None:
    loss = float(matched_damping(np.array([restitution]))[0]) / 1.2
    ours, closed = solve(_impacts(rate_loss_s_m=loss)), hunt_crossley(ONE, constant(restitution))
    assert ours.restitution.value == pytest.approx([restitution], rel=1e-6)
    for name in ("contact_time_s", "compression_time_s", "peak_force_n", "impulse_n_s"):
        assert getattr(ours, name) == pytest.approx(getattr(closed, name), rel=2e-6)
    phase = np.linspace(0, 1, 101)
    assert ours.force_at(phase) == pytest.approx(
        closed.force_at(phase), abs=2e-4 * closed.peak_force_n[0]
    )


@pytest.mark.parametrize("parameter", [0.02, 0.1, 0.5, 1.0, 1.4])
def test_giving_plate_is_zeners_equation(parameter: float) -> None:
    """xi'' + (1 + lambda d/ds) xi^1.5 = 0 from first contact to the loss of it; his exponential
    within 0.014."""
    thickness = 0.01 * np.sqrt(inelasticity(ball()) / parameter)
    bodies = ball(plate_thickness_m=thickness)
    assert inelasticity(bodies) == pytest.approx(parameter)
    nominal = Impacts.of(bodies)
    assert nominal.plate_impedance_n_s_m is not None
    found = solve(
        replace(nominal, plate_mobility_m_n_s=1 / nominal.plate_impedance_n_s_m)
    ).restitution.value

    def parted(_, state):
        return state[0]

    parted.terminal, parted.direction = True, -1  # type: ignore[attr-defined]

    def rate(_, state):
        root = np.sqrt(abs(state[0]))
        return [state[1], -state[0] * root - 1.5 * parameter * root * state[1]]

    run = solve_ivp(rate, (0, 100), [0, 1], events=parted, rtol=1e-10, atol=1e-13)
    assert found == pytest.approx([-run.y[1, -1]], abs=1e-6)
    assert zener(bodies).value == pytest.approx([-run.y[1, -1]], abs=0.014)


any_case = st.builds(
    lambda bodies, viscous, load, layer, plate, exponent: _relative(
        bodies, viscous, load, layer, plate, exponent
    ),
    any_impacts,
    st.floats(0, 3),
    st.floats(0.01, 2),
    st.floats(0, 3),
    st.floats(0, 1),
    st.floats(1, 2.5),
)


def _relative(
    bodies: Bodies, viscous: float, load: float, layer: float, plate: float, exponent: float
) -> Impacts:
    """Each mechanism as strong as told, for any bodies: in units of Hertz' impact."""
    peak, u = hertz(bodies).peak_force_n, bodies.impact_velocity_m_s
    depth = (peak / bodies.hertz_stiffness_n_m15) ** (2 / 3)
    return replace(
        Impacts.of(bodies),
        exponent=np.full(1, exponent),
        stiffness_n_mp=peak / depth**exponent,
        rate_loss_s_m=viscous / u,
        yield_load_n=load * peak,
        layer_compliance_m_n=layer * depth / peak,
        plate_mobility_m_n_s=plate * u / peak,
    )


def _work(case: Impacts, pulse: ImpactPulse, points: int = 4001) -> tuple[np.ndarray, np.ndarray]:
    """Work on the impactor, from the force alone, and the kinetic energy that it lost."""
    force, time = pulse.force_n(points), pulse.contact_time_s
    step = time[:, None] / (points - 1)
    momentum = np.concatenate(
        [np.zeros((len(time), 1)), np.cumsum((force[:, 1:] + force[:, :-1]) / 2 * step, 1)], 1
    )
    velocity = case.bodies.impact_velocity_m_s[:, None] - momentum / case.mass_kg[:, None]
    lost = (
        case.mass_kg / 2 * (case.bodies.impact_velocity_m_s**2 - pulse.separation_velocity_m_s**2)
    )
    return impulse(time, force * velocity), lost


@settings(max_examples=15)
@given(case=any_case)
def test_force_balances_momentum_and_energy_and_gains_none(case: Impacts) -> None:
    pulse = solve(
        case, 96
    )  # a paraboloid behind a layer converges slowly: 3e-4 at 48 steps, 6e-6 at 96
    momentum = case.mass_kg * (case.bodies.impact_velocity_m_s + pulse.separation_velocity_m_s)
    assert pulse.impulse_n_s == pytest.approx(momentum, rel=1e-12)
    assert impulse(pulse.contact_time_s, pulse.force_n(4001)) == pytest.approx(momentum, rel=1e-4)
    spent, lost = _work(case, pulse)
    assert np.all(lost >= -1e-5 * case.mass_kg * case.bodies.impact_velocity_m_s**2)
    assert spent == pytest.approx(
        lost, abs=2e-4 * float(case.mass_kg[0] * case.bodies.impact_velocity_m_s[0] ** 2)
    )


@pytest.mark.parametrize(
    ("quantity", "unit"),
    [
        ("rate_loss_s_m", 1 / 1.2),
        ("plate_mobility_m_n_s", 1.2 / FORCE),
        ("layer_compliance_m_n", DEPTH / FORCE),
    ],
)
def test_next_to_nothing_of_a_mechanism_is_none_of_it_and_more_acts_more(
    quantity: str, unit: float
) -> None:
    """As little as a number can hold, whose inverse none can; of a spring, as its depth is the
    inverse itself."""
    little = np.array([0.0, 5e-324, 1e-320, 1e-316, 1e-312, 1e-308])
    plain = Impacts.of(impacts(impact_velocity_m_s=np.full(6, 1.2)))
    spring = replace(plain, exponent=np.ones(6), stiffness_n_mp=FORCE / DEPTH)
    pulse = solve(replace(spring, **{quantity: little}))
    assert pulse.contact_time_s == pytest.approx(np.full(6, pulse.contact_time_s[0]), rel=1e-6)
    assert pulse.restitution.value == pytest.approx(1, abs=1e-6)
    bodies = impacts(impact_velocity_m_s=np.full(12, 1.2))
    pulse = solve(replace(Impacts.of(bodies), **{quantity: np.geomspace(0.01, 3, 12) * unit}))
    if quantity == "layer_compliance_m_n":
        assert np.all(np.diff(pulse.peak_force_n) < 0)
        assert np.all(np.diff(pulse.contact_time_s) > 0)
        assert pulse.restitution.value == pytest.approx(1, abs=1e-6)
    else:
        assert np.all(np.diff(pulse.restitution.value) < 0)


def test_restitution_falls_with_yield_as_thornton_says() -> None:
    """e^2 = (6 sqrt(3) / 5) (1 - w^2 / 6) (w / (w + 2 sqrt(6/5 - w^2/5)))^(1/2), Thornton 1997.

    w is yield velocity over impact velocity.
    """
    share = np.array([0.9999, 0.999, 0.99, 0.9, 0.5, 0.2, 0.05])
    bodies = impacts(impact_velocity_m_s=1 / share)
    slow = impacts(impact_velocity_m_s=1.0)  # the velocity at which they yield
    load = float(hertz(slow).peak_force_n[0])
    found = solve(replace(Impacts.of(bodies), yield_load_n=np.full(7, load)))
    root = share / (share + 2 * np.sqrt(6 / 5 - share**2 / 5))
    thornton = np.sqrt(6 * np.sqrt(3) / 5) * np.sqrt(1 - share**2 / 6) * root**0.25
    assert found.restitution.value == pytest.approx(thornton, rel=1e-6)


def test_soft_layer_and_flat_punch_are_linear_springs_and_a_rigid_layer_is_none() -> None:
    """Half a period of m on the spring, and of a layer C the peak u sqrt(m / C)."""
    compliance, stiffness = 1e5 * DEPTH / FORCE, 2 * FORCE / DEPTH
    layer, flat = (
        solve(_impacts(layer_compliance_m_n=compliance)),
        solve(_impacts(exponent=1.0, stiffness_n_mp=stiffness)),
    )
    assert layer.contact_time_s == pytest.approx([np.pi * np.sqrt(0.32 * compliance)], rel=2e-3)
    assert layer.peak_force_n == pytest.approx([1.2 * np.sqrt(0.32 / compliance)], rel=2e-3)
    assert flat.contact_time_s == pytest.approx([np.pi * np.sqrt(0.32 / stiffness)], rel=1e-7)
    phase = np.linspace(0, 1, 33)
    assert flat.force_at(phase)[0] / flat.peak_force_n == pytest.approx(
        np.sin(np.pi * phase), abs=1e-6
    )
    rigid = solve(
        _impacts(layer_compliance_m_n=1e-9 * DEPTH / FORCE, plate_mobility_m_n_s=1e-9 * 1.2 / FORCE)
    )
    assert rigid.peak_force_n == pytest.approx(hertz(ONE).peak_force_n, rel=1e-7)


def test_impactor_that_stays_with_a_sheet_is_told() -> None:
    """Nothing comes back: the plate takes m u, and the force's end is an exponential of m / Z."""
    mobility = 20 * 1.2 / FORCE
    pulse = solve(_impacts(plate_mobility_m_n_s=mobility), 48)
    assert not pulse.parted[0]
    assert pulse.restitution.clipped[0]
    assert pulse.impulse_n_s == pytest.approx([0.32 * 1.2], rel=2e-3)
    late = pulse.force_at(np.array([0.5, 0.9]))[0]
    decay = np.log(late[0] / late[1]) / (0.4 * pulse.contact_time_s[0])
    assert decay == pytest.approx(1 / (0.32 * mobility), rel=0.05)


def test_impacts_do_not_meet_and_flags_are_one_for_each() -> None:
    bodies = impacts(impact_velocity_m_s=[0.3, 1.2, 30.0])
    loss = np.array([0.0, 3.0, 0.1])
    load = np.array([np.inf, 100.0, 5.0])
    together = solve(replace(Impacts.of(bodies), rate_loss_s_m=loss, yield_load_n=load)).force_n(33)
    for row in range(3):
        one = impacts(impact_velocity_m_s=bodies.impact_velocity_m_s[row])
        alone = solve(_impacts(one, rate_loss_s_m=loss[row], yield_load_n=load[row])).force_n(33)
        assert together[row] == pytest.approx(alone[0], rel=1e-9)
    with pytest.raises(ValueError, match=r"insulated has shape \(2,\): expected \(1,\)"):
        impact(ONE, insulated=np.ones(2, dtype=bool))


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7])
def test_a_step_ends_at_the_depth_of_yield(share: float) -> None:
    law, size = kernel.Law(1.5, 1.0, 0.0, share, 0.3, 0.0, 0.0, 0.0), 1 / 96
    end, depth, velocity = kernel.to_the_yield(
        law, 1.0, 2.0, 1.0, size, share - 0.01, 0.9
    )  # T = 1, q = 2, s = 1
    assert depth == pytest.approx(share, rel=1e-13)
    assert end**2 - 1 == pytest.approx(0.01 / 0.9, rel=0.01)
    assert velocity < 0.9
