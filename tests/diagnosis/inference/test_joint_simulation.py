"""Sets of effects simulated together, once each: against the stages themselves."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference.effect_laws import EffectLaw, LawRanges, laws_of
from pyroshock.diagnosis.inference.problem import JointSimulator, negligible_places
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import catalogue
from support.records.gun_campaigns import gun_record
from support.records.toy_bench import Design, ToyContact, ToyForceGain, ToyGun, ToyLayer, ToyLoss, campaign

STAGE = GunObservables(gun_record())
IDS = ("gun.dead_volume", "gun.blow_by", "gun.sliding_friction", "sensor.velocity_gain")
LAWS = {name: laws_of(catalogue()[name], LawRanges(), {})[0] for name in IDS}


def simulator() -> JointSimulator:
    return JointSimulator([STAGE], list(LAWS.values()))


def pair(name: str, place: float = 0.5) -> tuple[EffectLaw, np.ndarray]:
    return LAWS[name], np.full(LAWS[name].size, place)


@pytest.mark.parametrize("names", [IDS[:1], IDS[1:3], IDS])
def test_changes_are_the_stage_s(names):
    """Effects that are off beside them change nothing."""
    point = tuple(pair(name) for name in names)
    expected = STAGE.changes([[law.effect(u) for law, u in point]])
    np.testing.assert_allclose(simulator().changes([point]), expected, atol=1e-3 * STAGE.observables[0].tolerance)


def test_nothing_is_simulated_twice_or_below_its_negligible_place():
    own = simulator()
    points = [(pair(IDS[0]),), (pair(IDS[1]),), (pair(IDS[0]),)]
    first = own.changes(points)
    assert own.count == 2
    np.testing.assert_array_equal(own.changes(points[::-1]), first[::-1])
    assert own.count == 2
    np.testing.assert_array_equal(simulator().changes([()]), np.zeros((1, *simulator().shape)))
    assert simulator().changes([]).shape == (0, *simulator().shape)
    own.negligible = {LAWS[IDS[0]].key: -1.0}
    low, high = own.changes([(pair(IDS[0], -1.5),), (pair(IDS[0], -0.5),)])
    np.testing.assert_array_equal(low, 0.0)
    assert np.abs(high).max() > 0
    # They are simulated together; the sum of what each does alone is another change.
    points = [(pair(IDS[0], 2.0),), (pair(IDS[1], 2.0),), (pair(IDS[0], 2.0), pair(IDS[1], 2.0))]
    first, second, both = simulator().changes(points)
    assert np.nanmax(np.abs(first + second - both)) > STAGE.observables[0].tolerance


def test_stages_stand_beside_each_other():
    """Every stage is asked for the effects that it shows; a force gain leaves the gun alone."""
    record = campaign([], np.random.default_rng(0), Design(repetitions=1))
    stages = [ToyGun(record), ToyContact(record)]
    laws = [laws_of(kind, LawRanges(), {})[0] for kind in (ToyLoss, ToyLayer, ToyForceGain)]
    own = JointSimulator(stages, laws)
    assert own.shape == (24, 4)
    point = tuple((law, np.full(law.size, 0.5)) for law in laws)
    effects = [law.effect(u) for law, u in point]
    changes = own.changes([point, point[2:]])
    np.testing.assert_allclose(changes[0, :, :1], stages[0].changes([effects[:1]])[0])
    np.testing.assert_allclose(changes[0, :, 1:], stages[1].changes([effects[1:]])[0])
    np.testing.assert_array_equal(changes[1, :, 0], 0.0)
    assert np.abs(changes[1, :, 1]).min() > 0.01


def test_shot_that_stays_in_the_barrel_has_no_answer():
    """Where the seal holds the projectile the velocity is missing; the other shots have theirs."""
    law = next(law for law in laws_of(catalogue()["gun.sliding_friction"], LawRanges(), {}) if "seal" in law.name)
    place = next(c.place(100.0) for c in law.coordinates if c.parameter.name == "seal_force_n")
    u = np.array([place if c.parameter.name == "seal_force_n" else -9.0 for c in law.coordinates])
    changes = JointSimulator([STAGE], [law]).changes([((law, u),)])
    stuck = [float(configuration.factors["tank_pressure"]) < 0.5e5 for configuration in STAGE.record.configurations]
    np.testing.assert_array_equal(np.isnan(changes[0, :, 0]), stuck)


def test_negligible_is_what_moves_nothing_by_a_twentieth_of_its_tolerance():
    own = JointSimulator([STAGE], [law for name in IDS for law in laws_of(catalogue()[name], LawRanges(), {})])
    tolerance = np.array([item.tolerance for item in STAGE.observables])
    places = negligible_places(own, tolerance)
    assert places
    for law in own.laws:
        if law.key in places:
            u = np.zeros(law.size)
            sizes = []
            for place in (places[law.key], places[law.key] + 0.5):
                u[0] = place
                sizes.append(np.nanmax(np.abs(STAGE.changes([[law.effect(u)]])) / tolerance))
            assert sizes[0] < 0.05 <= sizes[1] or places[law.key] == 0.0
    assert all(not key.startswith("sensor.") for key in places)  # an offset of either sign is not near off at -4
