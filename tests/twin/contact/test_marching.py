"""Steps in each contact's own time, and how contacts end that do not part as a spring does: they
creep, or stay."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact import kernel
from pyroshock.twin.contact.integrate_contact import (
    LEAST_FORCE,
    Numbers,
    march,
    own_time,
    power_of_time,
)
from scipy.integrate import solve_ivp


def _numbers(exponent: float, **values: list[float]) -> Numbers:
    n = len(next(iter(values.values())))
    nothing = dict.fromkeys(("damping", "inelasticity", "compliance", "stiffening"), np.zeros(n))
    given = {name: np.array(value) for name, value in values.items()}
    never = {"yield_depth": np.full(n, np.inf), "hardening": np.ones(n)}
    return Numbers(**{"exponent": np.full(n, exponent), **nothing, **never, **given})


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_what_is_held_by_its_losses_creeps_apart(exponent: float) -> None:
    """Of phi = f (1 + a x') nothing is left where x' = -1 / a; the way back takes a xi_max, but for
    the turn."""
    damping = np.array([100.0, 1e3])
    numbers = _numbers(exponent, damping=[*damping])
    found, finer = march(numbers), march(numbers, 480)
    assert found.parted.all()
    assert found.velocity == pytest.approx(-1 / damping, rel=1e-9)
    assert found.contact_time == pytest.approx(finer.contact_time, rel=2e-8)
    back = found.contact_time - found.compression_time
    assert back == pytest.approx(damping * found.deepest, rel=0.04)
    last = found.nodes.first[1:] - 1
    assert found.nodes.time[last].tolist() == found.contact_time.tolist()
    assert found.nodes.force[last].tolist() == found.nodes.force_rate[last].tolist() == [0, 0]


def test_what_creeps_stays_or_parts_at_one_step_comes_to_its_own_end() -> None:
    """Slower yet: force and way fall together, and neither is said to have gone."""
    coarse, fine = (march(_numbers(1.5, damping=[1e4]), *steps) for steps in ((), (480,)))
    assert coarse.contact_time == pytest.approx(fine.contact_time, rel=1e-5)
    assert coarse.velocity == pytest.approx([-1e-4], rel=1e-4)
    numbers = _numbers(1.5, damping=[0.1, np.nan, np.nan])
    with pytest.raises(
        ArithmeticError, match=r"^2 contacts do not come to their deepest indentation$"
    ):
        march(numbers, 4)
    held = _numbers(1.5, damping=[0.1, 1e4], inelasticity=[0.0, 1e4])
    with pytest.raises(ArithmeticError, match=r"^1 contacts neither part nor come to rest$"):
        march(held, 4)
    # Some 65 steps after the turn both come to their end.
    damped = [np.linspace(1800.0, 2100.0, 20), np.linspace(5.0, 9.0, 40)]
    both = march(_numbers(1.5, damping=[*np.concatenate(damped)]))
    assert both.parted.tolist() == [False] * 20 + [True] * 40
    apart = [march(_numbers(1.5, damping=[*some])) for some in damped]
    assert both.contact_time == pytest.approx(
        np.concatenate([single.contact_time for single in apart]), rel=1e-12
    )
    assert both.velocity == pytest.approx(
        np.concatenate([single.velocity for single in apart]), rel=1e-12
    )


@pytest.mark.parametrize("inelasticity", [10.0, 30.0, 100.0])
def test_what_stays_is_left_when_its_force_has_fallen(inelasticity: float) -> None:
    """xi' = eta - lambda f, eta' = -f, f = xi^1.5, until f is 1e-4 of that at the turn; by scipy,
    with events."""

    def rate(_: float, state: np.ndarray) -> list[float]:
        force = max(state[0], 0.0) ** 1.5
        return [state[1] - inelasticity * force, -force]

    def turns(_: float, state: np.ndarray) -> float:
        return state[1] - inelasticity * max(state[0], 0.0) ** 1.5

    turns.terminal, turns.direction = True, -1  # type: ignore[attr-defined]
    options = {"method": "LSODA", "rtol": 1e-12, "atol": 1e-16}
    turn = solve_ivp(rate, (0, 1e4), [0.0, 1.0], events=turns, **options)
    deepest, velocity = turn.y[:, -1]

    def left(_: float, state: np.ndarray) -> float:
        return state[0] - LEAST_FORCE ** (1 / 1.5) * deepest

    left.terminal, left.direction = True, -1  # type: ignore[attr-defined]
    end = solve_ivp(rate, (turn.t[-1], 1e4), [deepest, velocity], events=left, **options)
    found = march(_numbers(1.5, inelasticity=[inelasticity]))
    assert not found.parted.any()
    assert found.deepest == pytest.approx([deepest], rel=1e-6)
    assert found.contact_time == pytest.approx([end.t[-1]], rel=3e-6)
    assert found.velocity == pytest.approx([end.y[1, -1]], abs=3e-6)


HIT = {
    "exponent": 1.5,
    "damping": 0.0,
    "inelasticity": 1e-12,
    "compliance": 0.0,
    "stiffening": 0.0,
    "hardening": 1.0,
}


def _contacts(**values: float | list[float]) -> Numbers:
    """Elastic contacts of spheres, but for what is given."""
    columns = {**HIT, "yield_depth": np.inf, **values}
    n = max(np.size(value) for value in columns.values())
    return Numbers(
        **{
            name: np.broadcast_to(np.asarray(value, float), n).copy()
            for name, value in columns.items()
        }
    )


@pytest.mark.parametrize(
    ("numbers", "within"),
    [
        pytest.param(_contacts(exponent=[1.0, 1.3, 1.5, 2.0, 2.5]), 1e-6, id="any shape"),
        pytest.param(_contacts(damping=[0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0]), 0.05, id="losses"),
        pytest.param(
            _contacts(compliance=[0.01, 100.0, 1e3, 1e4]), 0.01, id="hard and soft layers"
        ),
        pytest.param(
            _contacts(compliance=[0.01, 100.0, 1e3, 1e4], exponent=1.0), 0.006, id="of a flat"
        ),
        pytest.param(
            _contacts(compliance=[0.01, 0.1, 10.0, 100.0, 1e3], stiffening=1.0),
            0.025,
            id="stiffening layers",
        ),
        pytest.param(
            _contacts(compliance=[0.01, 0.1, 1.0, 10.0], stiffening=10.0),
            0.1,
            id="that stiffen more",
        ),
        pytest.param(_contacts(yield_depth=[1e-2, 1e-3, 1e-4]), 0.004, id="early yield"),
        pytest.param(
            _contacts(yield_depth=1e-4, hardening=[0.6, 0.8, 1.2, 1.5]),
            0.1,
            id="early yield that hardens",
        ),
        pytest.param(
            _contacts(inelasticity=[0.01, 10.0, 100.0], yield_depth=10.0), 0.24, id="plates"
        ),
        pytest.param(_contacts(inelasticity=[30.0, 100.0]), 0.02, id="thin plates"),
        pytest.param(
            _contacts(compliance=1.0, exponent=[1.0, 1.5, 2.0]), 0.42, id="as soft as the sphere"
        ),
    ],
)
def test_own_time_follows_the_way_of_the_loading(numbers: Numbers, within: float) -> None:
    """1.4 times the deepest approach, where one thing governs it: there the balance of energy has a
    closed form."""
    march_end = march(numbers, 24)
    forces = march_end.deepest**numbers.exponent
    layers = [
        kernel.layer(kernel.Law(1.5, 1.0, 0.0, np.inf, 0.0, 0.0, beta, h), force)
        for beta, h, force in zip(numbers.compliance, numbers.stiffening, forces, strict=True)
    ]
    approach = march_end.deepest + layers
    assert own_time(numbers) / 1.4 == pytest.approx(approach, rel=within)


def test_own_time_grows_from_yield_on_and_steps_are_equal_in_its_power() -> None:
    deepest = 1.25**0.4
    short, long = own_time(_contacts(yield_depth=[deepest * 1.0001, deepest * 0.9999]))
    assert short == pytest.approx(1.4 * deepest, rel=1e-12)
    assert long == pytest.approx(1.4 * (deepest + np.sqrt(1 / (1.5 * deepest**0.5))), rel=1e-3)
    # As t^p without a layer; as t^(1/p) below one, so that 2 p is wanted, within reason.
    assert power_of_time(_contacts(exponent=[1.0, 1.5, 2.5])).tolist() == [2, 2, 2]
    below = power_of_time(_contacts(exponent=[0.8, 1.0, 1.5, 1.9, 2.5], compliance=1e-3))
    assert below.tolist() == pytest.approx([2, 2, 3, 3.8, 4])
