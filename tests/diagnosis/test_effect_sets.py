"""Sets of effects as a report has them: their share, the path that they make, and what would tell
them apart."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from pyroshock.app.common.number_format import percent
from pyroshock.app.operations.diagnose.statements import summary
from pyroshock.diagnosis.diagnose import Options, diagnose
from pyroshock.diagnosis.effect_sets import _settled_by, least_distance
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.posterior import HypothesisPosterior
from pyroshock.diagnosis.inference.shares import gap_shares
from pyroshock.diagnosis.observables.base import PossibleObservables, Stage
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.parameter_limits import exceeded_limit, exceeded_limits
from pyroshock.diagnosis.verdict import OTHERS, Pictures, Verdict
from pyroshock.twin.effects import Effect, catalogue, effect
from support.records.gun_campaigns import gun_record

VALVE = effect(
    "gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=4.5
)
TWINS = ("gun.barrel_loss", "gun.valve_flow")


@cache
def alike() -> Verdict:
    """A loss of the valve at the projectile's speed, which a drag in the barrel does as well."""
    pressures, masses = (0.5e5, 1.0e5, 2.0e5, 4.0e5), (0.1, 0.2, 0.5)
    record = gun_record([VALVE], seed=5, scatter=0.001, pressures_pa=pressures, masses_kg=masses)
    names = (*TWINS, "gun.dead_volume", "sensor.velocity_gain")
    options = Options(
        tolerances={"gun": 0.002}, catalogue=names, rate_pulses=False, plan=False, where=False
    )
    return diagnose(record, options=options, draw=drawn)


def drawn(
    gap: GapTable, stages: Sequence[Stage], choices: Sequence[tuple[Sequence[Effect], float]]
) -> Pictures:
    """What would be drawn, by the ids alone."""
    del gap, stages
    assert sum(weight for _, weight in choices) == pytest.approx(1.0)
    return Pictures(
        drawn_effects=tuple(tuple(effect.id for effect in effects) for effects, _ in choices)
    )


def test_laws_that_do_the_same_are_one_set_with_a_narrow_share() -> None:
    verdict = alike()
    (own,) = [own for own in verdict.sets if "gun.valve_flow" in own.effects]
    assert set(own.effects) == set(TWINS)
    rows = {row.effect: row for row in verdict.effects}
    assert own.inclusion > 0.9 > max(rows[name].inclusion for name in TWINS)
    assert own.share == pytest.approx(sum(rows[name].share for name in TWINS))
    width = own.ci90[1] - own.ci90[0]
    assert all(width < 0.7 * (rows[name].ci90[1] - rows[name].ci90[0]) for name in TWINS)
    # Each takes the error away in the place of the other, and the set does so.
    assert min(rows[name].held_out_gain for name in TWINS) > 0.7
    assert own.held_out_gain == pytest.approx(
        np.mean([rows[name].held_out_gain for name in TWINS]), abs=0.1
    )
    assert {rows[name].credible_set for name in TWINS} == {1 + verdict.sets.index(own)}
    assert all(rows[name].named for name in TWINS)
    # A channel that would tell is not known.
    assert own.settled_by is None
    assert set(verdict.as_json()["sets"][0]) == {
        "effects", "inclusion", "share", "ci90", "held_out_gain", "settled_by"
    }  # fmt: skip


def test_path_adds_sets_and_ends_at_the_shrinkage() -> None:
    verdict = alike()
    first = verdict.path[0]
    assert set(first.effects) == set(verdict.sets[0].effects) and first.added == " or ".join(
        verdict.sets[0].effects
    )
    assert first.fraction > 0.8
    entry = next(entry for entry in verdict.shrinkage if entry.held_out_by == "configuration")
    assert verdict.path[-1].fraction == entry.fraction
    assert verdict.path[-1].after == pytest.approx(entry.after)
    assert all(step.effects or step.added == OTHERS for step in verdict.path)


def test_first_entry_and_averaged_choices_are_of_the_sets() -> None:
    verdict = alike()
    members = {name for own in verdict.sets for name in own.effects}
    assert {part for name in verdict.first.effects for part in name.split("+")} <= members
    assert verdict.averaged is not None
    assert sum(own.weight for own in verdict.averaged.choices) == pytest.approx(1.0)
    assert not any(exceeded_limits(own.effects) for own in verdict.averaged.choices)
    assert {effect.id for own in verdict.averaged.choices for effect in own.effects} <= members
    assert verdict.averaged.after < 0.4 * verdict.gap.before


def test_effects_that_can_be_adopted_are_those_that_are_drawn() -> None:
    """Not the likeliest of all sets of effects, which has others beside them."""
    verdict = alike()
    assert verdict.averaged is not None
    adoptable = tuple(
        tuple(effect.id for effect in own.effects) for own in verdict.averaged.choices
    )
    assert verdict.pictures.drawn_effects == adoptable


def test_effect_that_hides_a_part_of_the_error_is_named_by_what_it_adds_held_out() -> None:
    """A bore that brakes and a light gate that reads too much: without the gate's error there would
    be more to explain, so that its share is negative; but no velocity is predicted well without
    it."""
    brake = effect(
        "gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=20.0
    )
    pressures, masses = (0.5e5, 1.0e5, 2.0e5, 4.0e5), (0.1, 0.2, 0.5)
    gate = effect("sensor.velocity_gain", gain=1.03)
    record = gun_record(
        [brake, gate], seed=5, scatter=0.001, pressures_pa=pressures, masses_kg=masses
    )
    names = ("gun.barrel_loss", "gun.dead_volume", "sensor.velocity_gain")
    options = Options(
        tolerances={"gun": 0.002}, catalogue=names, rate_pulses=False, plan=False, where=False
    )
    verdict = diagnose(record, options=options)
    assert verdict.first.effects == ("gun.barrel_loss+sensor.velocity_gain",)
    loss, gain = verdict.sets
    assert (loss.effects, gain.effects) == (("gun.barrel_loss",), ("sensor.velocity_gain",))
    assert gain.inclusion > 0.9 and gain.share < -0.1 and gain.held_out_gain > 0.1
    words = summary(verdict)
    assert "The sensitivity of the velocity measurement acts, too, and hides a part of it" in words
    assert f"causes {percent(loss.share)} of it" in words


def test_set_of_one_has_the_share_of_its_effect_and_all_together_the_rest() -> None:
    record = gun_record([VALVE], seed=5)
    stage = GunObservables(record)
    kinds = [catalogue()[name] for name in (*TWINS, "sensor.velocity_gain")]
    posterior = HypothesisPosterior.of(GapTable.of(record, [stage]), [stage], kinds)
    shares = gap_shares(
        posterior.library, posterior.weights, posterior.floor, np.random.default_rng(0)
    )
    for name in posterior.effects:
        assert shares.of_set([name]) == (
            pytest.approx(shares.share[name]),
            pytest.approx(shares.interval[name]),
        )
    assert shares.of_set(posterior.effects)[0] == pytest.approx(1 - shares.unexplained)


class RecordedGun(GunObservables):
    """A gun of which a channel that was not recorded is known: it shows `size` where the valve
    acts, else nothing."""

    size = 3.0
    possible_channels = ("muzzle_pressure", "tank_pressure")

    def possible_observables(
        self, channel: str, sets: Sequence[Sequence[Effect]]
    ) -> PossibleObservables:
        shape = (len(sets), len(self.record.configurations), 2)
        predicted = np.zeros(shape)
        for row, effects in zip(predicted, sets, strict=True):
            if channel == "tank_pressure" and any(own.id == "gun.valve_flow" for own in effects):
                row[:] = self.size
        return PossibleObservables(predicted, np.diag([4.0, 9.0]))


@pytest.mark.parametrize(("size", "settles"), [(3.0, True), (0.1, False)])
def test_channel_that_tells_the_effects_apart_is_named_with_its_distance(
    size: float, settles: bool
) -> None:
    record = gun_record([VALVE], seed=5)
    stage = RecordedGun(record)
    stage.size = size
    posterior = HypothesisPosterior.of(
        GapTable.of(record, [stage]), [stage], [catalogue()[name] for name in TWINS]
    )
    settled_by = _settled_by(posterior, TWINS, [stage])
    if settles:
        assert settled_by is not None and settled_by.channel == "tank_pressure"
        wanted = size * np.sqrt(len(record.configurations) * (1 / 4 + 1 / 9))
        assert settled_by.d_prime == pytest.approx(wanted)
    else:
        assert settled_by is None
    assert _settled_by(posterior, TWINS[:1], [stage]) is None
    assert _settled_by(posterior, TWINS, [GunObservables(record)]) is None
    with pytest.raises(LookupError, match="the gun cannot say what 'gas_temperature' would show"):
        GunObservables(record).possible_observables("gas_temperature", [])


def test_least_distance_is_that_of_the_pair_that_is_nearest() -> None:
    predicted = np.array([[[0.0, 0.0]], [[3.0, 4.0]], [[3.0, np.nan]]])
    assert least_distance(PossibleObservables(predicted[:2], np.eye(2))) == pytest.approx(5.0)
    assert least_distance(PossibleObservables(predicted, np.eye(2))) == pytest.approx(
        0.0
    )  # alike where both answer
    noise = np.array([[1.0, 0.9], [0.9, 1.0]])
    difference = predicted[1, 0]
    wanted = np.sqrt(difference @ np.linalg.solve(noise, difference))
    assert least_distance(PossibleObservables(predicted[:2], noise)) == pytest.approx(wanted)


@pytest.mark.parametrize(("identity", "name", "value", "limit", "beyond"), [
    ("gun.barrel_loss", "drag_coefficient", 21.7, 5.0, True),
    ("gun.barrel_loss", "drag_coefficient", 4.98, 5.0, False),
    ("gun.barrel_loss", "drag_coefficient", 1.2, None, False),
    ("gun.sliding_friction", "added_coefficient", 1.4, 1.0, True),
    ("gun.valve_flow", "loss_coefficient", 10000.0, 1000.0, True),
    ("gun.valve_flow", "loss_coefficient", 995.0, 1000.0, False),
    ("gun.valve_flow", "loss_coefficient", 31.0, None, False),
    ("gun.valve_flow", "loss_coefficient", 0.001, None, False),  # it grows from nothing
    ("gun.valve_flow", "loss_coefficient", 0.0, None, False),  # off: it does nothing
    ("sensor.velocity_gain", "gain", 1.3, None, False),  # a gross error of a sensor is what it is
    ("gun.valve_flow", "colour", 1.0, None, False),
    ("gun.magic", "loss_coefficient", 1.0, None, False),
])  # fmt: skip
def test_values_that_no_part_has_are_known(
    identity: str, name: str, value: float, limit: float | None, beyond: bool
) -> None:
    exceeded = exceeded_limit(identity, name, value)
    assert (None if exceeded is None else exceeded.limit) == limit
    assert exceeded is None or exceeded.is_beyond == beyond


def test_level_that_lies_furthest_decides() -> None:
    friction = effect("gun.sliding_friction", added_coefficient=np.array([0.2, 1.6, 0.4]))
    (exceeded,) = exceeded_limits([VALVE, friction])
    assert (exceeded.effect, exceeded.value, exceeded.limit) == ("gun.sliding_friction", 1.6, 1.0)
