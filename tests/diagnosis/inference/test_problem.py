"""A gap as an inference problem: cells, noise, where effects begin to be seen, and sets simulated
together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.effect_laws import EffectLaw, LawRanges, laws_of
from pyroshock.diagnosis.inference.problem import (
    InferenceProblem,
    JointSimulator,
    StageBlock,
    negligible_places,
)
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.twin.effects import catalogue
from support.records.gun_campaigns import gun_record
from support.records.linear_problems import gap_of
from support.records.plate_records import played
from support.records.toy_bench import (
    Design,
    ToyContact,
    ToyForceGain,
    ToyGun,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyVelocityGain,
    campaign,
    stages_of,
)

FACTORS = [{"place": float(i)} for i in range(4)]


def table(scatter: float = 0.2) -> GapTable:
    rng = np.random.default_rng(0)
    return gap_of(rng.standard_normal((9, 2)), [0, 0, 0, 0, 1, 1, 2, 2, 3], FACTORS, scatter)


def test_noise_of_a_mean_falls_with_its_repetitions():
    gap = table()
    doubled = replace(
        gap, observables=tuple(replace(item, tolerance=2.0) for item in gap.observables)
    )
    block = StageBlock.of(doubled, "gun")
    np.testing.assert_allclose(block.z, gap.mean[block.configuration, block.observable] / 2.0)
    # Scatter squared over four, two, two and one runs, beside a fiftieth of a tolerance squared.
    block = StageBlock.of(table(0.2), "gun")
    runs = np.array([4, 2, 2, 1])[block.configuration]
    np.testing.assert_allclose(np.diag(block.covariances[0]), 0.2**2 / runs + 0.02)
    block = StageBlock.of(table(), "gun")
    apart = block.configuration[:, None] != block.configuration[None, :]
    np.testing.assert_array_equal(block.covariances[0][apart], 0.0)
    for matrix in StageBlock.of(table(), "gun").covariances:
        assert np.linalg.eigvalsh(matrix).min() > 0
    part = block.only(np.array([1, 3]))
    kept = np.flatnonzero(np.isin(block.configuration, [1, 3]))
    np.testing.assert_array_equal(part.z, block.z[kept])
    for i, own in enumerate(part.covariances):
        np.testing.assert_array_equal(own, block.covariances[i][np.ix_(kept, kept)])
    count = gap.count.copy()
    count[2, 1] = 0
    block = StageBlock.of(replace(gap, count=count), "gun")
    assert (2, 1) not in set(
        zip(block.configuration.tolist(), block.observable.tolist(), strict=True)
    )
    assert len(block.z) == 7


def test_noise_that_cells_share_is_in_their_covariance():
    # Four runs of one, one of the other: a covariance of one run over the root of four times one.
    gap = table()
    count = gap.count.copy()
    count[0] = (4, 1)
    noise = np.array([[0.09, 0.03], [0.03, 0.16]])
    block = StageBlock.of(
        replace(gap, count=count, noise=replace(gap.noise, covariance=noise)), "gun"
    )
    np.testing.assert_allclose(
        block.covariances[0][:2, :2], [[0.09 / 4 + 0.02, 0.03 / 2], [0.03 / 2, 0.16 + 0.02]]
    )
    moved = np.random.default_rng(1).standard_normal((1, 4, 2))
    block = StageBlock.of(replace(gap, nuisances=moved), "gun")
    own = moved[0, block.configuration, block.observable]
    difference = block.covariances[0] - StageBlock.of(gap, "gun").covariances[0]
    np.testing.assert_allclose(difference, np.outer(own, own), atol=1e-12)


def test_laws_are_those_of_effects_that_a_stage_shows():
    record = campaign([], np.random.default_rng(0), Design(repetitions=2))
    stages = stages_of(record)[:1]
    problem = InferenceProblem.of(
        GapTable.of(record, stages), stages, (ToyLayer, ToyLeak, ToyLoss, ToyVelocityGain)
    )
    assert set(problem.effects) == {"gun.toy_leak", "gun.toy_loss", "sensor.toy_velocity_gain"}
    record = campaign([], np.random.default_rng(0), Design(repetitions=2))
    stages = stages_of(record)[:2]
    problem = InferenceProblem.of(GapTable.of(record, stages), stages, (ToyLoss,))
    law = problem.laws[0]
    gun, contact = problem.changes([((law, np.array([0.5])),)])
    loss = law.values(np.array([0.5]))["loss"]
    np.testing.assert_allclose(gun[0], -loss / 0.01)
    np.testing.assert_array_equal(contact[0], 0.0)


@pytest.mark.parametrize("name", ["gun.dead_volume", "gun.blow_by"])
def test_search_of_an_effect_begins_where_it_moves_the_gap_by_a_tolerance(name: str):
    """At u = -2 it does, rms over configurations; at a third of that parameter it does not."""
    record = gun_record()
    stage = GunObservables(record)
    problem = InferenceProblem.of(GapTable.of(record, [stage]), [stage], [catalogue()[name]])
    law = problem.laws[0]
    size = float(law.coordinates[0].value(np.array(-2.0)))
    rest = dict(law.fixed)
    for value, beyond in ((size, True), (size / 3, False)):
        effect = law.kind(**{**rest, law.coordinates[0].parameter.name: value})
        rms = float(
            np.sqrt(np.mean((stage.changes([[effect]]) / stage.observables[0].tolerance) ** 2))
        )
        assert (rms > 1.0) == beyond


def test_law_by_channel_tells_of_the_plate_s_cells_alone():
    """In a chain the gun's cells belong to no channel of the plate, and changes of both stages are
    simulated."""
    played_record, gun = played(noise=0.003), gun_record()
    runs = tuple(
        replace(
            run, tank_pressure_pa=1e5, bullet_mass_kg=0.5, velocity_m_s=10.0 + 0.1 * run.repetition
        )
        for run in played_record.runs
    )
    record = replace(played_record, gun=gun.gun, runs=runs)
    stages = [GunObservables(record), PlateObservables(record)]
    kinds = [
        catalogue()[name]
        for name in ("gun.valve_flow", "sensor.acceleration_gain", "plate.damping")
    ]
    gap = GapTable.of(record, stages)
    problem = InferenceProblem.of(gap, stages, kinds)
    law = next(law for law in problem.laws if law.owner == "channel")
    for block in problem.blocks:
        channels = [gap.observables[column].channel for column in block.observable]
        expected = [
            law.level_names.index(name) if name in law.level_names else -1 for name in channels
        ]
        assert problem.cell_levels(law, block).tolist() == expected
    gun_change, plate_change = problem.changes([((law, law.level_start(np.array([1.0, -1.0]))),)])
    assert np.all(gun_change == 0)
    assert plate_change.min() < -0.3 and plate_change.max() > 0.3


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
    np.testing.assert_allclose(
        simulator().changes([point]), expected, atol=1e-3 * STAGE.observables[0].tolerance
    )


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
    law = next(
        law
        for law in laws_of(catalogue()["gun.sliding_friction"], LawRanges(), {})
        if "seal" in law.name
    )
    place = next(c.place(100.0) for c in law.coordinates if c.parameter.name == "seal_force_n")
    u = np.array([place if c.parameter.name == "seal_force_n" else -9.0 for c in law.coordinates])
    changes = JointSimulator([STAGE], [law]).changes([((law, u),)])
    stuck = [
        float(configuration.factors["tank_pressure"]) < 0.5e5
        for configuration in STAGE.record.configurations
    ]
    np.testing.assert_array_equal(np.isnan(changes[0, :, 0]), stuck)


def test_negligible_is_what_moves_nothing_by_a_twentieth_of_its_tolerance():
    own = JointSimulator(
        [STAGE], [law for name in IDS for law in laws_of(catalogue()[name], LawRanges(), {})]
    )
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
    assert all(
        not key.startswith("sensor.") for key in places
    )  # an offset of either sign is not near off at -4
