"""Labels of pulses."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.comparison import comparison_groups, level_names, speed_terciles
from support.records.pulse_tables import pulse_table

TABLE = pulse_table(np.random.default_rng(0), repetitions=2)


def test_groups_of_a_hammer_campaign() -> None:
    groups = comparison_groups(TABLE)
    assert set(groups) == {
        "tip_material",
        "target_material",
        "anvil_material",
        "insulator",
        "boundary_conditions",
        "impact_velocity",
    }
    assert all(len(labels) == len(TABLE) for labels in groups.values())


def test_one_tip_is_no_grouping() -> None:
    assert "tip_material" not in comparison_groups(TABLE.take(TABLE.tip_material == "delrin"))


def test_levels_have_their_names() -> None:
    soft = level_names(TABLE, "insulator") == "polymeric"
    assert np.array_equal(soft, np.char.find(TABLE.treatment, "/polymeric/") > 0)


def test_a_third_of_the_pulses_is_slow() -> None:
    speed, velocity = speed_terciles(TABLE), TABLE.column("impact_velocity")
    assert [int(np.count_nonzero(speed == name)) for name in ("slow", "middle", "fast")] == [40, 40, 40]
    assert velocity[speed == "slow"].max() < velocity[speed == "fast"].min()


def test_a_number_has_no_levels() -> None:
    with pytest.raises(LookupError, match="'tip_radius' has no levels"):
        level_names(TABLE, "tip_radius")
