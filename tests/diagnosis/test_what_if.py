"""What a page shows of a diagnosis beside its report agrees with the report: the points of the
residuals have the error of the waterfall, and the map of places that of the whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.diagnose import Options, diagnose
from pyroshock.diagnosis.gap import means
from pyroshock.diagnosis.localisation.error_map import error_map
from pyroshock.diagnosis.verdict import Verdict
from pyroshock.diagnosis.what_if import ErrorMap, WhatIf
from pyroshock.twin.effects import effect
from support.records.gun_campaigns import gun_record

SCATTER = 0.004
EFFECTS = ("gun.valve_flow", "gun.back_pressure", "sensor.velocity_gain")


@cache
def explored(explore: bool = True) -> Verdict:
    """A gun whose valve throttles, and three effects to choose from."""
    record = gun_record([effect("gun.valve_flow", loss_coefficient=8.0)], scatter=SCATTER)
    return diagnose(record, options=Options(catalogue=EFFECTS, explore=explore))


def what_if() -> WhatIf:
    own = explored().what_if
    assert own is not None
    return own


def places() -> ErrorMap:
    own = explored().error_map
    assert own is not None
    return own


def rms_of_means(values: np.ndarray) -> float:
    """Over configurations, of the means of their runs: the size of the error of one observable."""
    rows = np.array([run.configuration for run in what_if().runs])
    table, _ = means(values[:, None], rows, int(rows.max()) + 1)
    return float(np.sqrt(np.nanmean(table**2)))


def test_the_report_is_the_same_with_and_without_what_the_page_shows() -> None:
    with_page, without = (explored(explore).as_json() for explore in (True, False))
    assert {**with_page, "seconds": 0.0} == {**without, "seconds": 0.0}
    assert explored(False).what_if is None and explored(False).error_map is None


def test_points_without_effects_have_the_size_of_the_error() -> None:
    (velocity,) = what_if().residuals
    assert rms_of_means(velocity.before) == pytest.approx(explored().gap.before, rel=1e-3)
    assert velocity.family == "velocity" and not velocity.is_rms
    assert velocity.tolerance == pytest.approx(explored().gap.tolerance)


def test_points_with_each_set_have_the_error_of_its_waterfall() -> None:
    assert len(what_if().sets) > 6
    for own in what_if().sets:
        assert rms_of_means(own.residuals[0]) == pytest.approx(own.after, rel=1e-3), own.effects


def test_every_choice_of_the_effects_was_computed() -> None:
    for names in ({"gun.valve_flow"}, {"gun.back_pressure", "sensor.velocity_gain"}, set(EFFECTS)):
        assert what_if().find(frozenset(names)) is not None
    assert what_if().find(frozenset({"gun.blow_by"})) is None


def test_the_path_is_among_the_sets_with_its_own_numbers() -> None:
    names = [step.added for step in explored().path]
    for i, step in enumerate(explored().path):
        own = what_if().find(frozenset(names[: i + 1]))
        assert own is not None
        assert (own.after, own.fraction) == (step.after, step.fraction)
        assert own.ci90 is not None and own.ci90[0] <= own.after <= own.ci90[1]


def test_the_planted_effect_leaves_the_scatter_and_another_does_not() -> None:
    planted, wrong = (
        what_if().find(frozenset({name})) for name in ("gun.valve_flow", "gun.back_pressure")
    )
    assert planted is not None and wrong is not None
    assert planted.after < 3 * SCATTER / np.sqrt(3)
    assert wrong.after > 2 * planted.after
    assert planted.fraction is not None and planted.fraction > 0.9


def test_the_map_has_the_error_of_all_runs_and_of_each_level() -> None:
    own, gap = places(), explored().gap
    assert [column.factor for column in own.columns].count("bullet_mass") == 2
    assert [column.factor for column in own.columns].count("tank_pressure") == 3
    (velocity,) = own.values
    assert velocity[0] == pytest.approx(gap.before / gap.tolerance)
    for factor in ("bullet_mass", "tank_pressure"):
        levels = [
            value
            for value, column in zip(velocity, own.columns, strict=True)
            if column.factor == factor
        ]
        # every level has as many configurations: the mean square of all is that of the levels
        assert np.sqrt(np.mean(np.square(levels))) == pytest.approx(velocity[0])


def test_a_pulse_that_is_too_long_is_off_at_its_end_and_not_before_it_begins() -> None:
    from pyroshock.diagnosis.chain import stages_of
    from pyroshock.diagnosis.gap import GapTable
    from support.records.contact_campaigns import hammer_record

    record = hammer_record([effect("contact.effective_mass", mass_factor=1.4)])
    stages, _ = stages_of(record, Options())
    own = error_map(GapTable.of(record, stages), stages)
    times = [
        (row.low, values[0])
        for row, values in zip(own.rows, own.values, strict=True)
        if row.kind == "time"
    ]
    starts = [low for low, _ in times if low is not None]
    assert len(times) == 8 and starts == sorted(starts)
    assert max(value for _, value in times[4:]) > 3 * times[0][1]
    assert {row.kind for row in own.rows} == {"family", "time", "frequency"}
