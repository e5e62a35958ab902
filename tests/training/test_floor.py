"""The repeatability floor of a table whose noise is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable, concatenate
from pyroshock.training.evaluation.floor import repeatability_floor
from pyroshock.training.evaluation.metrics import METRICS
from support.records.pulse_tables import held_out, pulse_table

NOISE = 0.02
#: Mean of |error| of the log-normal time.
MEAN = np.sqrt(2 / np.pi) * NOISE


@pytest.fixture(scope="module")
def split() -> tuple[PulseTable, PulseTable]:
    """1,440 pulses to learn from and 360 held out: three positions, which make no difference
    here."""
    rng = np.random.default_rng(0)
    return held_out(pulse_table(rng, positions=3, noise=NOISE), rng)


def time_error(
    split: tuple[PulseTable, PulseTable],
    scope: Literal["configuration", "treatment"],
    corrected: bool,
) -> float:
    return float(
        repeatability_floor(*split, scope, corrected=corrected).errors.contact_time_error.mean()
    )


@pytest.mark.parametrize("scope", ["configuration", "treatment"])
def test_corrected_floor_is_the_noise(
    split: tuple[PulseTable, PulseTable], scope: Literal["configuration", "treatment"]
) -> None:
    """The mean of 360 |errors| scatters by 0.756 / sqrt(360) = 4 %."""
    assert abs(time_error(split, scope, corrected=True) / MEAN - 1) < 3 * 0.04


def test_plain_floor_pays_for_eight_repetitions(split: tuple[PulseTable, PulseTable]) -> None:
    # A line through eight points has a leverage of 2 / 8 on average, through 48 hardly any.
    plain, corrected = (
        time_error(split, "configuration", corrected) for corrected in (False, True)
    )
    assert 1.08 < plain / corrected < 1.22
    assert time_error(split, "treatment", False) < plain
    # Within a treatment velocities differ by a factor of two: without them the time would be 16 %
    # off (u^-0.2).
    floor = repeatability_floor(*split, "treatment")
    assert floor.time_degree > 0
    assert floor.errors.contact_time_error.mean() < 1.2 * MEAN


def test_configurations_without_training_rows_predict_themselves(
    split: tuple[PulseTable, PulseTable],
) -> None:
    table = concatenate(split)
    out = np.char.startswith(table.configuration, "#2")
    floor = repeatability_floor(table.take(~out), table.take(out))
    assert floor.left_out == 600 and len(floor.errors) == 600
    assert "600 of 600 leave-one-out" in floor.note
    assert 1.0 < floor.errors.contact_time_error.mean() / MEAN < 1.25
    # The closed form against learning from the others, for one configuration.
    table = table.take(table.configuration == table.configuration[0])
    nobody = table.take(slice(0, 0))
    together = repeatability_floor(nobody, table, corrected=True)
    compared = 0
    for row in range(len(table)):
        others = np.arange(len(table)) != row
        alone = repeatability_floor(table.take(others), table.take(~others), corrected=True)
        if (alone.force_degree, alone.time_degree) == (together.force_degree, together.time_degree):
            compared += 1
            for name in METRICS:
                assert np.isclose(
                    getattr(alone.errors, name)[0], getattr(together.errors, name)[row], rtol=1e-6
                ), name
    assert compared >= 5


def test_rows_are_the_held_out_ones_in_order(split: tuple[PulseTable, PulseTable]) -> None:
    training, test = split
    shuffled = np.random.default_rng(1).permutation(len(test))
    straight, mixed = (
        repeatability_floor(training, test),
        repeatability_floor(training, test.take(shuffled)),
    )
    assert np.array_equal(straight.rows, np.arange(len(test)))
    assert np.allclose(straight.errors.cost[shuffled], mixed.errors.cost, rtol=1e-9)
    renamed = test.configuration.copy().astype("U60")
    renamed[4] = "never repeated"
    floor = repeatability_floor(training, replace(test, configuration=renamed))
    assert floor.lonely == 1
    assert 4 not in floor.rows and len(floor.errors) == len(test) - 1


def test_what_has_no_floor_is_refused(split: tuple[PulseTable, PulseTable]) -> None:
    table = split[1]
    each = replace(table, configuration=table.key)
    with pytest.raises(ValueError, match="repeat runs"):
        repeatability_floor(each.take(slice(0, 0)), each)
    training, test = split
    x = test.x.copy()
    x[0, 5] = 0.0
    with pytest.raises(ValueError, match=f"{test.key[0]} has impact_velocity = 0 m/s"):
        repeatability_floor(training, replace(test, x=x))
