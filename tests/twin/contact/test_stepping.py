"""Units of the steps: each contact's own time, and the power of it that they are equal in."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact import kernel
from pyroshock.twin.contact.integrate_contact import Numbers, march, own_time, power_of_time

HIT = {"exponent": 1.5, "damping": 0.0, "inelasticity": 1e-12, "compliance": 0.0, "stiffening": 0.0}


def _numbers(**values: float | list[float]) -> Numbers:
    """Elastic contacts of spheres, but for what is given."""
    columns = {**HIT, "yield_depth": np.inf, **values}
    n = max(np.size(value) for value in columns.values())
    return Numbers(**{name: np.broadcast_to(np.asarray(value, float), n).copy() for name, value in columns.items()})


@pytest.mark.parametrize(
    ("numbers", "within"),
    [
        pytest.param(_numbers(exponent=[1.0, 1.3, 1.5, 2.0, 2.5]), 1e-6, id="any shape"),
        pytest.param(_numbers(damping=[0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0]), 0.05, id="losses"),
        pytest.param(_numbers(compliance=[0.01, 100.0, 1e3, 1e4]), 0.01, id="hard and soft layers"),
        pytest.param(_numbers(compliance=[0.01, 100.0, 1e3, 1e4], exponent=1.0), 0.006, id="of a flat"),
        pytest.param(_numbers(compliance=[0.01, 0.1, 10.0, 100.0, 1e3], stiffening=1.0), 0.025, id="stiffening layers"),
        pytest.param(_numbers(compliance=[0.01, 0.1, 1.0, 10.0], stiffening=10.0), 0.1, id="that stiffen more"),
        pytest.param(_numbers(yield_depth=[1e-2, 1e-3, 1e-4]), 0.004, id="early yield"),
        pytest.param(_numbers(inelasticity=[0.01, 10.0, 100.0], yield_depth=10.0), 0.24, id="plates"),
        pytest.param(_numbers(inelasticity=[30.0, 100.0]), 0.02, id="thin plates"),
        pytest.param(_numbers(compliance=1.0, exponent=[1.0, 1.5, 2.0]), 0.42, id="as soft as the sphere"),
    ],
)
def test_own_time_follows_the_way_of_the_loading(numbers: Numbers, within: float) -> None:
    """1.4 times the deepest approach, where one thing governs it: there the balance of energy has a closed form."""
    found = march(numbers, 24)
    forces = found.deepest**numbers.exponent
    layers = [
        kernel.layer(kernel.Law(1.5, 1.0, 0.0, np.inf, 0.0, 0.0, beta, h), force)
        for beta, h, force in zip(numbers.compliance, numbers.stiffening, forces, strict=True)
    ]
    way = found.deepest + layers
    assert own_time(numbers) / 1.4 == pytest.approx(way, rel=within)


def test_yield_makes_the_own_time_longer_from_where_it_is_reached() -> None:
    deepest = 1.25**0.4
    short, long = own_time(_numbers(yield_depth=[deepest * 1.0001, deepest * 0.9999]))
    assert short == pytest.approx(1.4 * deepest, rel=1e-12)
    assert long == pytest.approx(1.4 * (deepest + np.sqrt(1 / (1.5 * deepest**0.5))), rel=1e-3)


def test_steps_are_equal_in_that_power_of_time_in_which_force_begins_smoothly() -> None:
    """As t^p without a layer; as t^(1/p) below one, so that 2 p is wanted, within reason."""
    assert power_of_time(_numbers(exponent=[1.0, 1.5, 2.5])).tolist() == [2, 2, 2]
    below = power_of_time(_numbers(exponent=[0.8, 1.0, 1.5, 1.9, 2.5], compliance=1e-3))
    assert below.tolist() == pytest.approx([2, 2, 3, 3.8, 4])
