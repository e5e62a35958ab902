"""How contacts end that do not part as a spring does: they creep apart, or stay."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.integrate_contact import LEAST_FORCE, Numbers, march
from scipy.integrate import solve_ivp


def _numbers(exponent: float, **values: list[float]) -> Numbers:
    n = len(next(iter(values.values())))
    nothing = dict.fromkeys(("damping", "inelasticity", "compliance", "stiffening"), np.zeros(n))
    given = {name: np.array(value) for name, value in values.items()}
    return Numbers(**{"exponent": np.full(n, exponent), **nothing, "yield_depth": np.full(n, np.inf), **given})


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_what_is_held_by_its_losses_creeps_apart(exponent: float) -> None:
    """Of phi = f (1 + a x') nothing is left where x' = -1 / a; the way back takes a xi_max, but for the turn."""
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


def test_what_creeps_is_followed_to_its_end() -> None:
    """Slower yet: force and way fall together, and neither is said to have gone."""
    coarse, fine = (march(_numbers(1.5, damping=[1e4]), *steps) for steps in ((), (480,)))
    assert coarse.contact_time == pytest.approx(fine.contact_time, rel=1e-5)
    assert coarse.velocity == pytest.approx([-1e-4], rel=1e-4)


@pytest.mark.parametrize("inelasticity", [10.0, 30.0, 100.0])
def test_what_stays_is_left_when_its_force_has_fallen(inelasticity: float) -> None:
    """xi' = eta - lambda f, eta' = -f, f = xi^1.5, until f is 1e-4 of that at the turn; by scipy, with events."""

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


def test_what_stays_and_what_parts_at_the_same_step_are_each_their_own() -> None:
    """Some 65 steps after the turn both come to their end."""
    damped = [np.linspace(1800.0, 2100.0, 20), np.linspace(5.0, 9.0, 40)]
    both = march(_numbers(1.5, damping=[*np.concatenate(damped)]))
    assert both.parted.tolist() == [False] * 20 + [True] * 40
    apart = [march(_numbers(1.5, damping=[*some])) for some in damped]
    assert both.contact_time == pytest.approx(np.concatenate([one.contact_time for one in apart]), rel=1e-12)
    assert both.velocity == pytest.approx(np.concatenate([one.velocity for one in apart]), rel=1e-12)


def test_contacts_without_an_end_are_counted() -> None:
    numbers = _numbers(1.5, damping=[0.1, np.nan, np.nan])
    with pytest.raises(ArithmeticError, match=r"^2 contacts do not come to their deepest indentation$"):
        march(numbers, 4)
    held = _numbers(1.5, damping=[0.1, 1e4], inelasticity=[0.0, 1e4])
    with pytest.raises(ArithmeticError, match=r"^1 contacts neither part nor come to rest$"):
        march(held, 4)
