"""Settings to choose from: the best one, and those that are better than it at something."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.tune.choices import Choice, choices
from pyroshock.twin.tune.goal import Goal
from pyroshock.twin.tune.probability import Proposal
from pyroshock.twin.tune.search import Effort
from pyroshock.twin.tune.space import set_alike
from pyroshock.twin.tune.tuner import FiredShots, tune
from support.records.tuning_toy import LINES, SPACE, Toy, spectrum

MOUNTS = list(SPACE.mounts())
BEST = SPACE.setting(MOUNTS[0], 3e5, 0.4)


def proposal(setting, met=0.8, margin=1.0, band=2.0):
    level = np.zeros(3)
    return Proposal(setting, met, met, met, 0.0, 1.0, margin, 100.0, level, level - band,
                    level + band)  # fmt: skip


def chosen(*ranked: Proposal, fired=(), level_db=None) -> tuple[Choice, ...]:
    levels = np.zeros((len(fired), 3)) if level_db is None else level_db
    return choices(ranked, fired, levels, 10)


def test_a_setting_that_is_better_at_nothing_is_no_choice():
    """The best setting is set up as it was fired last; another mount has to be changed to."""
    other_setting = SPACE.setting(MOUNTS[5], 3e5, 0.4)
    choices = chosen(proposal(BEST), proposal(other_setting), fired=(BEST,))
    assert [own.proposal.setting for own in choices] == [BEST]


@pytest.mark.parametrize(("more", "merit"), [
    ({"margin": 1.5}, "margin"),
    ({"band": 1.5}, "certainty"),
])  # fmt: skip
def test_a_larger_margin_or_a_narrower_band_is_a_reason(more, merit):
    other_setting = SPACE.setting(MOUNTS[5], 3e5, 0.4)
    _, second = chosen(proposal(BEST), proposal(other_setting, met=0.6, **more), fired=(BEST,))
    assert second.better_at == (merit,)


def test_a_setting_that_was_fired_is_told_with_the_scatter_of_its_shots():
    """Two shots 1 dB apart at every line: their standard deviation is 0.707 dB."""
    fired = (SPACE.setting(MOUNTS[5], 3e5, 0.4),) * 2
    levels = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    _, second = chosen(proposal(BEST), proposal(fired[0], met=0.6), fired=fired, level_db=levels)
    assert second.merits.scatter_db == pytest.approx(np.sqrt(0.5))
    assert (second.merits.shots, second.merits.changes) == (2, 0)
    assert set(second.better_at) == {"repeatability", "measured", "effort"}


def test_changes_count_parts_and_bullets_but_no_pressure():
    louder = replace(BEST, tank_pressure_pa=4e5)
    heavier = replace(BEST, impactor_mass_kg=0.5)
    choices = chosen(proposal(heavier), proposal(louder, met=0.6), fired=(BEST,))
    assert [own.merits.changes for own in choices] == [1, 0]


def test_a_setting_that_is_far_less_likely_is_no_choice():
    other_setting = SPACE.setting(MOUNTS[5], 3e5, 0.4)
    choices = chosen(proposal(BEST, met=0.8), proposal(other_setting, met=0.3, margin=5.0))
    assert len(choices) == 1
    choices = chosen(
        proposal(BEST, met=0.0, margin=-5.0), proposal(other_setting, met=0.0, margin=-9.0, band=1)
    )
    assert len(choices) == 1  # nobody is likely, and it lies 4 dB farther out


def test_choices_of_a_search_can_be_told_apart_at_the_bench_and_each_has_a_reason():
    """Ten proposals with one pressure and one mass were no choice."""
    goal = Goal.even(LINES, spectrum(SPACE.setting(MOUNTS[7], 3.3e5, 0.41)), 9.0)
    fired = tuple(SPACE.setting(mount, 3e5, 0.5) for mount in MOUNTS[::4] for _ in range(2))
    rng = np.random.default_rng(3)
    levels = 20 * np.log10(Toy().spectra(fired)) + 0.5 * rng.standard_normal(
        (len(fired), LINES.size)
    )
    effort = Effort(pressures=6, masses=3, finalists=12)
    tuned = tune(Toy(1.0), SPACE, goal, np.random.default_rng(0), effort=effort,
                 measured=FiredShots(fired, levels))  # fmt: skip
    settings = [own.proposal.setting for own in tuned.choices]
    assert len(settings) > 1 and settings[0] == tuned.proposals[0].setting
    assert not any(set_alike(a, b) for place, a in enumerate(settings) for b in settings[:place])
    assert all(own.better_at for own in tuned.choices[1:])
    masses = {round(own.setting.impactor_mass_kg, 1) for own in tuned.proposals}
    assert len(masses) > 1
