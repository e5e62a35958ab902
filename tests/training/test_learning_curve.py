"""The learning curve, of a model whose error is known for every number of configurations."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.learning_curve import learning_curve
from pyroshock.training.models.base import ContactPrediction
from support.records.pulse_tables import pulse_table


class Counting:
    """Its force is off by 1 / (configurations that it learned from); it needs `least` of them."""

    def __init__(self, held_out, least=1):
        self.held_out, self.least = held_out, least
        self.learned: list[set[str]] = []

    def relearn(self, pulses, rng):
        names = set(pulses.configuration.tolist())
        if len(names) < self.least:
            raise ValueError(f"{len(names)} configurations are too few")
        self.learned.append(names)
        return self

    def predict(self, inputs):
        force = self.held_out.force_n * (1 + 1 / len(self.learned[-1]))
        return ContactPrediction(force, self.held_out.contact_time_s, None, None)


@pytest.fixture(scope="module")
def sides():
    table = pulse_table(np.random.default_rng(4), repetitions=2)
    held = np.isin(table.configuration, np.unique(table.configuration)[::3])
    return table.take(~held), table.take(held)


def test_each_point_is_learned_from_its_part_of_the_configurations(sides):
    training, held_out = sides
    model = Counting(held_out)
    points = learning_curve(model, training, held_out, np.random.default_rng(0))
    every = len(np.unique(training.configuration))
    assert [point.configurations for point in points] == [
        round(share * every) for share in (0.25, 0.5, 0.75, 1.0)
    ]
    assert [point.orders for point in points] == [3, 3, 3, 1] and len(model.learned) == 10
    size = np.sqrt(np.mean(held_out.force_n**2, axis=1)) / np.ptp(held_out.force_n, axis=1)
    for point in points:
        assert point.error == pytest.approx(size.mean() / point.configurations)
        assert point.low is not None and point.high is not None
        assert point.low <= point.error <= point.high


def test_parts_of_one_order_are_nested(sides):
    training, held_out = sides
    model = Counting(held_out)
    learning_curve(model, training, held_out, np.random.default_rng(0))
    quarters, halves, most = model.learned[:3], model.learned[3:6], model.learned[6:9]
    for small, middle, large in zip(quarters, halves, most, strict=True):
        assert small < middle < large
    assert len({frozenset(names) for names in quarters}) > 1  # the orders differ


def test_the_same_seed_gives_the_same_curve(sides):
    training, held_out = sides
    first, second = (
        learning_curve(Counting(held_out), training, held_out, np.random.default_rng(7))
        for _ in range(2)
    )
    assert first == second


def test_a_part_that_is_too_small_to_learn_from_is_left_out(sides):
    training, held_out = sides
    half = len(np.unique(training.configuration)) // 2
    points = learning_curve(
        Counting(held_out, least=half), training, held_out, np.random.default_rng(0)
    )
    assert [point.share for point in points] == [0.5, 0.75, 1.0]
    with pytest.raises(ValueError, match="no part of its configurations"):
        learning_curve(Counting(held_out, least=1000), training, held_out, np.random.default_rng(0))
