"""Proposals that the bench cannot set apart, or a sensor cannot tell apart, are one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.tune.probability import Proposal
from pyroshock.twin.tune.tuner import SAME_SPECTRUM_DB, distinct
from support.records.tuning_toy import LINES, SPACE

MOUNTS = list(SPACE.mounts())
FIRST = SPACE.setting(MOUNTS[0], 3e5, 0.5)


def proposal(setting, level_db=0.0, outside=()):
    levels = np.full(LINES.size, level_db)
    return Proposal(setting, 0.5, 0.5, 0.5, 0.0, 1.0, 1.0, 100.0, levels, levels - 1, levels + 1, outside)


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


@pytest.mark.parametrize(("apart_db", "count"), [(0.9 * SAME_SPECTRUM_DB, 1), (1.1 * SAME_SPECTRUM_DB, 2)])
def test_same_spectrum_of_another_mount_is_the_same_proposal(apart_db, count):
    other = SPACE.setting(MOUNTS[8], 6e5, 0.9)
    assert len(distinct([proposal(FIRST), proposal(other, apart_db)])) == count


def test_one_line_apart_is_another_spectrum_and_inside_and_outside_of_the_domain_are_never_one():
    bent = proposal(SPACE.setting(MOUNTS[8], 6e5, 0.9))
    bent.level_db[17] += 2 * SAME_SPECTRUM_DB
    for other in (bent, proposal(FIRST, 0.0, ("tip unknown",))):
        assert len(distinct([proposal(FIRST), other])) == 2


def test_order_stays_and_the_first_of_a_group_keeps_the_others():
    settings = [SPACE.setting(MOUNTS[i], 3e5, 0.5) for i in (0, 4, 8, 12)]
    ranked = distinct([proposal(s, level) for s, level in zip(settings, (0.0, 5.0, 0.1, 5.1), strict=True)])
    assert [p.setting for p in ranked] == settings[:2]
    assert [p.alternatives for p in ranked] == [(settings[2],), (settings[3],)]
