"""Which settings there are."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.twin.tune.space import ContinuousRange, Levels, mount_of, unlike
from support.records.tuning_toy import SPACE


def test_grid_is_every_mount_with_every_amount():
    assert len(list(SPACE.mounts())) == 3 * 2 * (1 + 2) * 2  # no anvil; anvil with and without
    assert all(mount.anvil is not None for mount in SPACE.mounts() if mount.insulator != "none")
    settings = SPACE.grid(4, 3)
    assert len(set(settings)) == len(settings) == 36 * 12
    assert {s.plate.name for s in settings} == {"aluminum"}
    assert ContinuousRange(1.0, 16.0).grid(5) == pytest.approx([1, 2, 4, 8, 16])


def test_settings_around_one_stay_on_its_mount_and_among_the_bullets_of_the_lab():
    setting = SPACE.setting(next(SPACE.mounts()), 7.9e5, 0.21)
    around = SPACE.around(setting, 1.3)
    assert setting in around
    assert {mount_of(s) for s in around} == {mount_of(setting)}
    assert max(s.tank_pressure_pa for s in around) == 8e5
    assert min(s.impactor_mass_kg for s in around) == 0.2
    space = replace(SPACE, impactor_mass_kg=Levels((1.0, 0.2, 0.5)))
    assert {s.impactor_mass_kg for s in space.grid(2, 6)} == {0.2, 0.5, 1.0}
    setting = space.setting(next(space.mounts()), 2e5, 0.5)
    assert {s.impactor_mass_kg for s in space.around(setting, 1.3)} == {0.5}
    assert {s.impactor_mass_kg for s in space.around(setting, 2.0)} == {0.5, 1.0}


def test_work_between_two_settings_is_the_parts_that_differ():
    first, *_, last = SPACE.mounts()
    one, other = SPACE.setting(first, 1e5, 0.5), SPACE.setting(last, 2e5, 0.5)
    assert unlike(one, SPACE.setting(first, 3e5, 0.2)) == 0
    assert unlike(one, other) == 5


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda: ContinuousRange(0.0, 1.0), "expected positive and rising"),
        (lambda: ContinuousRange(2.0, 1.0), "expected positive and rising"),
        (lambda: Levels(()), "expected at least one"),
        (lambda: Levels((0.5, -1.0)), "positive"),
        (lambda: replace(SPACE, tips=()), "tips is empty"),
        (lambda: replace(SPACE, insulators=("none", "felt")), "'felt'"),
    ],
)
def test_what_no_lab_has_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        change()
