"""Which settings there are, and which proposals are one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.tune.probability import Proposal
from pyroshock.twin.tune.space import ContinuousRange, Levels, mount_of, unlike
from pyroshock.twin.tune.tuner import SAME_SPECTRUM_DB, distinct
from support.records.tuning_toy import LINES, SPACE


def test_grid_is_every_mount_with_every_amount():
    assert len(list(SPACE.mounts())) == 3 * 2 * (1 + 2) * 2  # no anvil; anvil with and without
    assert all(mount.anvil is not None for mount in SPACE.mounts() if mount.insulator != "none")
    settings = SPACE.grid(4, 3)
    assert len(set(settings)) == len(settings) == 36 * 12
    assert {s.plate.name for s in settings} == {"aluminum"}
    assert ContinuousRange(1.0, 16.0).grid(5) == pytest.approx([1, 2, 4, 8, 16])


def test_settings_around_one_stay_on_its_mount_and_work_is_the_parts_that_differ():
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


MOUNTS = list(SPACE.mounts())
FIRST = SPACE.setting(MOUNTS[0], 3e5, 0.5)


def proposal(setting, level_db=0.0, outside=()):
    levels = np.full(LINES.size, level_db)
    return Proposal(
        setting, 0.5, 0.5, 0.5, 0.0, 1.0, 1.0, 100.0, levels, levels - 1, levels + 1, outside
    )


@pytest.mark.parametrize(
    ("other", "merged"),
    [
        (replace(FIRST, tank_pressure_pa=3.05e5), True),  # the next step of the regulator
        (replace(FIRST, tank_pressure_pa=3.06e5), False),
        (replace(FIRST, impactor_mass_kg=0.51), True),
        (replace(FIRST, impactor_mass_kg=0.52), False),
        (replace(FIRST, tip_radius_m=0.0304), True),
        (replace(FIRST, tip_radius_m=0.031), False),
        (SPACE.setting(MOUNTS[1], 3e5, 0.5), False),  # another place of impact
    ],
)
def test_steps_of_the_bench_decide_what_is_set_alike(other, merged):
    """Levels 10 dB apart: only the settings can be alike."""
    ranked = distinct([proposal(FIRST), proposal(other, 10.0)])
    assert [p.setting for p in ranked] == ([FIRST] if merged else [FIRST, other])
    assert ranked[0].alternatives == ((other,) if merged else ())


def test_same_spectrum_of_another_mount_is_the_same_proposal():
    """One line apart is another one; inside and outside of the domain are never one."""
    elsewhere = SPACE.setting(MOUNTS[8], 6e5, 0.9)
    bent = proposal(elsewhere)
    bent.level_db[17] += 2 * SAME_SPECTRUM_DB
    for other, count in (
        (proposal(elsewhere, 0.9 * SAME_SPECTRUM_DB), 1),
        (proposal(elsewhere, 1.1 * SAME_SPECTRUM_DB), 2),
        (bent, 2),
        (proposal(FIRST, 0.0, ("tip unknown",)), 2),
    ):
        assert len(distinct([proposal(FIRST), other])) == count


def test_order_stays_and_the_first_of_a_group_keeps_the_others():
    settings = [SPACE.setting(MOUNTS[i], 3e5, 0.5) for i in (0, 4, 8, 12)]
    ranked = distinct(
        [proposal(s, level) for s, level in zip(settings, (0.0, 5.0, 0.1, 5.1), strict=True)]
    )
    assert [p.setting for p in ranked] == settings[:2]
    assert [p.alternatives for p in ranked] == [(settings[2],), (settings[3],)]
