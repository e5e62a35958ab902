"""The plate's stage of a diagnosis against played campaigns: planted effects come back, by sign,
size and order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.observables.plate.signals import on_clock, true_force
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.diagnosis.record import Run, Series
from pyroshock.twin.effects import Effect, catalogue, effect
from pyroshock.twin.plate.response import PlateResponse
from support.records.plate_records import plate, played

#: Each effect at a size that benches have, and one of the other sign or a harder one.
PLANTED = [
    effect("plate.damping", factor=2.0),
    effect("plate.damping", factor=0.5),
    effect("plate.stiffness", frequency_factor=0.94),
    effect("plate.stiffness", frequency_factor=1.08),
    effect("plate.sensor_mass", mass_kg=0.15),
    effect("plate.boundary", support_frequency_hz=110.0),
    effect("sensor.acceleration_gain", gain=0.8),
    effect("sensor.mount_resonance", period_s=1e-4),
    effect("sensor.zero_shift", share=0.03, decay_time_s=0.25),
    effect("sensor.force_gain", gain=1.2),
    effect("sensor.force_bandwidth", time_constant_s=3e-5),
    effect("sensor.force_bandwidth", time_constant_s=0.0, corner_period_s=2e-4),
]
NOISE = 0.003


def in_tolerances(stage: PlateObservables, gap: np.ndarray, part: str = "") -> np.ndarray:
    """(R, d') of the columns whose name has `part`."""
    columns = [i for i, each in enumerate(stage.observables) if part in each.name]
    assert columns
    return gap[:, columns] / [stage.observables[i].tolerance for i in columns]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def left(
    record_effects: Sequence[Effect], noise: float = NOISE
) -> tuple[PlateObservables, np.ndarray, np.ndarray]:
    """Stage, gap before and gap after the planted effects are added, both in tolerances."""
    stage = PlateObservables(played(record_effects, noise=noise))
    after = stage.measured() - stage.simulated(record_effects)
    return stage, in_tolerances(stage, stage.residuals()), in_tolerances(stage, after)


@pytest.fixture(scope="module")
def nominal() -> PlateObservables:
    return PlateObservables(played(noise=NOISE))


def test_plate_without_effects_leaves_no_gap(nominal: PlateObservables) -> None:
    stage = PlateObservables(played())
    assert np.nanmax(np.abs(in_tolerances(stage, stage.residuals()))) < 0.3
    assert rms(in_tolerances(nominal, nominal.residuals())) < 0.3
    names = [observable.name for observable in nominal.observables]
    assert len(set(names)) == len(names) == nominal.measured().shape[1] <= 80


@pytest.mark.parametrize("planted", PLANTED, ids=lambda each: each.id)
def test_planted_effect_closes_its_own_gap_and_changes_are_differences(
    planted: Effect, nominal: PlateObservables
) -> None:
    _, before, after = left([planted])
    assert rms(after) < 0.35
    assert rms(before) > 2 * rms(after)
    rows, _ = nominal.representative
    expected = nominal.simulated([planted])[rows] - nominal.simulated()[rows]
    assert nominal.changes([[planted]])[0] == pytest.approx(expected, abs=1e-9)


def test_two_effects_close_their_gap() -> None:
    _, before, after = left(
        [
            effect("plate.stiffness", frequency_factor=1.07),
            effect("sensor.acceleration_gain", gain=1.2),
        ]
    )
    assert rms(after) < 0.35 < 5 < rms(before)


@pytest.mark.parametrize(
    ("name", "parameter", "values", "part", "rising"),
    [
        ("plate.damping", "factor", (0.5, 3.0), "ln damping", True),
        ("plate.stiffness", "frequency_factor", (0.92, 1.09), "ln frequency", True),
        ("plate.sensor_mass", "mass_kg", (0.05, 0.25), "ln frequency", False),
        ("plate.boundary", "support_frequency_hz", (40.0, 140.0), "ln frequency", True),
        ("sensor.acceleration_gain", "gain", (0.7, 1.4), "ln amplitude", True),
        ("sensor.force_gain", "gain", (0.7, 1.4), "ln amplitude", False),
        ("sensor.mount_resonance", "period_s", (5e-5, 1.2e-4), "ln amplitude", True),
        ("sensor.zero_shift", "share", (-0.04, 0.04), "rest", True),
    ],
)
def test_gap_goes_the_effects_way(
    name: str, parameter: str, values: tuple[float, float], part: str, rising: bool
) -> None:
    stages = [
        PlateObservables(played([effect(name, **{parameter: value})], noise=NOISE))
        for value in values
    ]
    sizes = [float(np.nanmean(in_tolerances(stage, stage.residuals(), part))) for stage in stages]
    assert np.all(np.diff(sizes) > 0) == rising
    assert np.all(np.diff(sizes) < 0) != rising


@pytest.mark.parametrize(
    "identity", ["plate.damping", "plate.stiffness", "plate.boundary", "sensor.acceleration_gain"]
)
def test_changes_are_monotone_over_what_is_likely(nominal: PlateObservables, identity: str) -> None:
    kind = catalogue()[identity]
    name, likely = next(
        (item.name, item.likely) for item in kind.parameters() if item.likely is not None
    )
    changes = nominal.changes([[kind(**{name: float(value)})] for value in np.linspace(*likely, 9)])
    part = {"plate.damping": "ln damping", "sensor.acceleration_gain": "spectrum"}.get(
        identity, "ln frequency"
    )
    columns = [i for i, each in enumerate(nominal.observables) if part in each.name]
    assert np.all(np.diff(changes[:, :, columns], axis=0) > 0)


def test_sets_at_once_are_those_one_by_one(nominal: PlateObservables) -> None:
    sets = [[each] for each in PLANTED] + [PLANTED[:1] + PLANTED[6:7], []]
    together = nominal.changes(sets)
    assert np.array_equal(together, np.concatenate([nominal.changes([each]) for each in sets]))


def test_effects_that_do_nothing_here_change_nothing(nominal: PlateObservables) -> None:
    others = [
        effect("gun.blow_by"),
        effect("contact.viscous_loss"),
        effect("sensor.velocity_gain", gain=1.1),
    ]
    assert np.all(nominal.changes([others]) == 0)
    off = [
        catalogue()[identity](
            **{item.name: item.off for item in catalogue()[identity].parameters()}
        )
        for identity in nominal.shows
    ]
    assert nominal.changes([[each] for each in off]) == pytest.approx(0, abs=1e-9)


def test_true_force_from_upstream_passes_no_sensor(nominal: PlateObservables) -> None:
    forces = [run.force for run in nominal.record.runs]
    gain = [effect("sensor.force_gain", gain=1.3)]
    assert nominal.simulated(gain, forces) == pytest.approx(nominal.simulated((), forces))
    twice = [
        None if run.force is None else replace(run.force, values=2 * run.force.values)
        for run in nominal.record.runs
    ]
    gap = nominal.simulated((), twice) - nominal.simulated(
        (), [run.force for run in nominal.record.runs]
    )
    columns = [i for i, each in enumerate(nominal.observables) if each.unit == "dB"]
    assert gap[:, columns] == pytest.approx(20 * np.log10(2))
    coarse = [run.force for run in nominal.record.runs]
    fine = [_resampled(force, 7.3) for force in coarse if force is not None]
    gap = nominal.simulated((), fine) - nominal.simulated((), coarse)
    assert np.nanmax(np.abs(in_tolerances(nominal, gap, "spectrum"))) < 0.4


def test_missing_channels_and_runs_leave_the_others() -> None:
    record = played()
    bare = replace(record.runs[1], accelerations={})
    stage = PlateObservables(replace(record, runs=(record.runs[0], bare, *record.runs[2:])))
    assert np.all(np.isnan(stage.measured()[1]))
    assert np.isfinite(stage.residuals()[0]).any()
    runs = tuple(_without(run, "acceleration_2") if run.order == 2 else run for run in record.runs)
    stage = PlateObservables(replace(record, runs=runs))
    of_second = [i for i, each in enumerate(stage.observables) if each.channel == "acceleration_2"]
    of_first = [i for i, each in enumerate(stage.observables) if each.channel == "acceleration_1"]
    assert np.all(np.isnan(stage.measured()[2, of_second]))
    assert np.isfinite(stage.measured()[2, of_first]).any()
    # In one run of the record; a sample of it would stand at another time than the other channel's.
    first = record.runs[0]
    slow = first.accelerations["acceleration_2"]
    half = Series(slow.values[::2], slow.sampling_rate_hz / 2, slow.start_s)
    changed = replace(first, accelerations={**first.accelerations, "acceleration_2": half})
    stage = PlateObservables(replace(record, runs=(changed, *record.runs[1:])))
    told = (
        f"1 accelerations of another sampling rate than {slow.sampling_rate_hz:g} Hz are left out"
    )
    assert told in stage.assumptions
    stage = PlateObservables(played(rate_hz=10_000.0))
    assert "1 modes of the plate above 4500 Hz are left out: records end there" in stage.assumptions


def test_record_that_does_not_fit_the_plate_is_refused() -> None:
    with pytest.raises(ValueError, match="no plate"):
        PlateObservables(replace(played(), plate=None))
    record = played()
    runs = tuple(
        replace(run, accelerations={"a": run.accelerations["acceleration_1"]})
        for run in record.runs
    )
    with pytest.raises(ValueError, match="name the channels as the modal table does"):
        PlateObservables(replace(record, runs=runs))
    table = plate()
    two = replace(
        table, shape_impact=np.vstack([table.shape_impact] * 2), impact_points=("#1", "#2")
    )
    record = played(bench=two)
    wrong = replace(record.configurations[0], factors={"impact_position": "#7"})
    with pytest.raises(ValueError, match="'#7' is not on the plate; it has #1, #2"):
        PlateObservables(replace(record, configurations=(wrong, *record.configurations[1:])))


def test_force_sensors_are_undone() -> None:
    effects = [
        effect("sensor.force_gain", gain=0.8),
        effect("sensor.force_bandwidth", time_constant_s=2e-5),
    ]
    force = _resampled(played().runs[0].force, 8.0)
    reading = force.values
    for each in effects:
        reading = each.measured_force_n(reading, 1 / force.sampling_rate_hz)  # type: ignore[attr-defined]
    back = true_force(Series(reading, force.sampling_rate_hz, force.start_s), effects)
    assert back.values == pytest.approx(force.values, abs=5e-3 * force.values.max())
    force = Series(np.array([0.0, 1e4, 0.0]), 1e6, 3.3e-6)
    got = on_clock(force, 0.0, 2e-5, 10)
    assert got.sum() * 2e-5 == pytest.approx(1e4 / 1e6)


def test_slow_force_channel_makes_the_plate_early() -> None:
    """It tells it from a mounting that resonates, which lifts the same lines."""
    slow = PlateObservables(
        played([effect("sensor.force_bandwidth", time_constant_s=4e-5)], noise=NOISE)
    )
    mounted = PlateObservables(
        played([effect("sensor.mount_resonance", period_s=1.2e-4)], noise=NOISE)
    )
    # a low pass delays what oscillates at w by atan(w tau) / w: at high modes by less than tau
    omega, weight = 2 * np.pi * slow.modes.frequency_hz, slow.modes.weight
    early = -(weight * omega * np.arctan(4e-5 * omega)).sum(axis=1) / (weight * omega**2).sum(
        axis=1
    )
    assert np.nanmedian(slow.modes.delay_s, axis=0) == pytest.approx(early, rel=0.03)
    late = [i for i, each in enumerate(slow.observables) if "delay" in each.name]
    assert slow.residuals()[:, late] * slow.signals.contact_s == pytest.approx(
        np.tile(early, (6, 1)), rel=0.05
    )
    assert np.all(np.abs(in_tolerances(mounted, mounted.residuals(), "delay")) < 0.1)


def test_long_uneven_contact_is_no_delay() -> None:
    """Beside short ones, whose modes are all read: the phase of a force is no mode that begins the
    other way."""
    contacts = [(2e-4, 900.0 + 200 * i) for i in range(4)] + [
        (c, 2000.0) for c in (4e-4, 5e-4, 6e-4, 8e-4)
    ]
    bench = [effect("plate.stiffness", frequency_factor=1.003)]
    for skew in (1.3, 1.5):
        stage = PlateObservables(played(bench, contacts=contacts, skew=skew, noise=1e-4))
        late = in_tolerances(stage, stage.residuals(), "delay")
        assert np.isfinite(late).all()
        assert np.abs(late).max() < 0.1


def test_damping_example_says_more_damping(examples: Path) -> None:
    from pyroshock.diagnosis.reading import read_folder

    stage = PlateObservables(read_folder(examples / "plate-damping"))
    assert np.nanmin(in_tolerances(stage, stage.residuals(), "ln damping")) > 3
    after = stage.measured() - stage.simulated([effect("plate.damping", factor=1.95)])
    assert rms(in_tolerances(stage, after)) < 0.35 * rms(in_tolerances(stage, stage.residuals()))


def _resampled(force: Series | None, finer: float) -> Series:
    rate = force.sampling_rate_hz * finer
    count = int((force.values.size - 1) * finer)
    time = force.start_s + np.arange(count) / rate
    return Series(np.interp(time, force.time_s, force.values), rate, force.start_s)


def _without(run: Run, channel: str) -> Run:
    return replace(
        run,
        accelerations={name: each for name, each in run.accelerations.items() if name != channel},
    )


def test_simulated_records_under_the_true_effect_are_the_measured_ones() -> None:
    gain = effect("sensor.acceleration_gain", gain=10 ** (4 / 20))
    stage = PlateObservables(played([gain]))
    measured = stage.signals.acceleration
    assert np.abs(measured - stage.records([gain])).max() < 0.03 * np.abs(measured).max()
    levels = [stage.columns.spectra.levels_db(records) for records in (measured, stage.records())]
    assert levels[0] - levels[1] == pytest.approx(4.0, abs=0.15)


BY_PART = [
    effect("plate.damping", factor=np.repeat([0.7, 1.6, 2.4], (3, 3, 4))),
    effect("plate.sensor_mass", mass_kg=np.array([0.02, 0.12])),
    effect("sensor.acceleration_gain", gain=np.array([1.15, 0.85])),
    effect("sensor.mount_resonance", period_s=np.array([0.0, 1e-4])),
    effect("sensor.zero_shift", share=np.array([-0.02, 0.03]), decay_time_s=0.25),
]


@pytest.mark.parametrize("planted", BY_PART, ids=[item.id for item in BY_PART])
def test_effect_that_differs_between_parts_closes_its_own_gap(planted: Effect) -> None:
    """Damping by band of modes, errors of accelerometers by channel."""
    _, before, after = left([planted])
    assert rms(after) < 0.3 * rms(before)
    assert rms(after) < 0.6


def test_gain_of_a_channel_moves_that_channel_alone(nominal: PlateObservables) -> None:
    moved = nominal.changes([[effect("sensor.acceleration_gain", gain=np.array([1.0, 1.25]))]])[0]
    channel = np.array([item.channel for item in nominal.observables])
    lines = np.array([item.unit == "dB" for item in nominal.observables])
    assert np.nanmax(np.abs(moved[:, channel == "acceleration_1"])) == pytest.approx(0.0, abs=1e-9)
    assert moved[:, lines & (channel == "acceleration_2")] == pytest.approx(
        20 * np.log10(1.25), abs=1e-6
    )
    # Ten modes in three bands; an observable tells of the band of its frequency and of its own
    # channel.
    damping, gain, force = (
        catalogue()[name]
        for name in ("plate.damping", "sensor.acceleration_gain", "sensor.force_gain")
    )
    levels, names = nominal.parts(damping)["mode band"]
    assert np.bincount(levels).tolist() == [4, 3, 3]
    assert names[0] == "modes up to 905 Hz"
    assert nominal.parts(gain) == {"channel": ((0, 1), ("acceleration_1", "acceleration_2"))}
    assert nominal.parts(force) == {}
    bands = nominal.part_of_observables("mode band", names)
    channels = nominal.part_of_observables("channel", ("acceleration_1", "acceleration_2"))
    for item, band, channel in zip(nominal.observables, bands, channels, strict=True):
        assert channel == {"acceleration_1": 0, "acceleration_2": 1}.get(item.channel, -1)
        if item.frequency_hz is not None:
            assert band == np.searchsorted([905.0, 2400.0], item.frequency_hz)


def test_what_is_kept_of_a_plate_changes_no_answer() -> None:
    """Sets that share a plate and forces, and others in between, against a stage that simulates one
    set alone."""
    stiffness, force = (
        effect("plate.stiffness", frequency_factor=0.97),
        effect("sensor.force_gain", gain=1.1),
    )
    sets = [
        [stiffness],
        [stiffness, effect("sensor.mount_resonance", period_s=1e-4)],
        [force, effect("sensor.mount_resonance", period_s=5e-5)],
        [stiffness, force],
        [effect("plate.stiffness", frequency_factor=0.98)],
        [stiffness, effect("sensor.acceleration_gain", gain=1.1)],
    ]
    record = played(noise=NOISE)
    together = PlateObservables(record).changes([*sets, *reversed(sets)])
    alone = [PlateObservables(record).changes([own])[0] for own in sets]
    np.testing.assert_array_equal(together[: len(sets)], together[: len(sets) - 1 : -1])
    np.testing.assert_allclose(together[: len(sets)], alone, rtol=0, atol=1e-12)


def test_effects_of_accelerometers_drive_no_plate_again(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = PlateObservables(played(noise=NOISE))
    stage.changes([[effect("plate.damping", factor=1.5)]])
    monkeypatch.setattr(
        PlateResponse, "accelerations", lambda *_: pytest.fail("the plate was driven again")
    )
    gains = [effect("sensor.acceleration_gain", gain=gain) for gain in (0.9, 1.1)]
    stage.changes([[effect("plate.damping", factor=1.5), gain] for gain in gains])
