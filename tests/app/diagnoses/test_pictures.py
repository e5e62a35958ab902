"""What is drawn of a gap: the observables that lie furthest out, and the records that show it."""

from __future__ import annotations

import numpy as np
from pyroshock.app.operations.diagnose.plot_builder import pictures_of, residual_pictures
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.nominal import muzzle_velocity
from support.records.contact_campaigns import hammer_record
from support.records.plate_records import played
from support.records.twin_parts import BENCH


def observable(name: str, tolerance: float = 0.01, unit: str = "1") -> Observable:
    return Observable(name, "contact", "force", unit, tolerance, 0.001)


def drawn(gaps: list[float], units: list[str] | None = None, most: int = 6) -> list[str]:
    """Names of what is drawn of gaps in tolerances, alike in four configurations."""
    units = units or ["1"] * len(gaps)
    observables = [observable(f"o{i}", unit=unit) for i, unit in enumerate(units)]
    gap = 0.01 * np.tile(gaps, (4, 1))
    return [
        each.name
        for each in residual_pictures(observables, gap, None, np.full(gap.shape, 1e-4), most)
    ]


def test_largest_gaps_are_drawn_in_their_order_and_what_agrees_is_left_out_but_for_one() -> None:
    assert drawn([2.0, 9.0, 4.0, 5.0], most=2) == ["o1", "o3"] and drawn([0.2, 9.0, 0.3]) == ["o1"]
    assert drawn([0.2, 0.1, 0.3]) == ["o2"]
    assert drawn([9.0, 8.0, 7.0, 3.0], ["1", "1", "1", "dB"], most=2) == [
        "o0",
        "o3",
    ]  # no unit takes all the room
    assert drawn([float("nan"), 2.0]) == ["o1"] and drawn([]) == []


def test_planted_effect_closes_the_gap_that_is_drawn() -> None:
    """A gun whose readings of velocity are 5 % high: after the effect the residuals are gone."""
    gain = effect("sensor.velocity_gain", gain=1.05)
    pressures = (0.3e5, 0.6e5, 1.2e5)
    configurations = tuple(
        RunConfiguration(f"{p / 1e5:g} bar", {"tank_pressure": p}) for p in pressures
    )
    runs = tuple(
        Run(i, i, 1, i, p, 0.5, 1.05 * float(muzzle_velocity(BENCH, p, 0.5)), 0.01)
        for i, p in enumerate(pressures)
    )
    record = CampaignRecord("made", "gun", configurations, runs, gun=BENCH)
    stage = GunObservables(record)
    pictures = pictures_of(GapTable.of(record, [stage]), [stage], [([gain], 1.0)])
    (picture,) = pictures.residuals
    assert pictures.configurations == ("0.3 bar", "0.6 bar", "1.2 bar")
    np.testing.assert_allclose(picture.before, np.log(1.05), rtol=1e-6)
    assert picture.after is not None
    np.testing.assert_allclose(picture.after, 0.0, atol=1e-6)


def test_pulse_after_the_true_effect_is_the_measured_one() -> None:
    """A heavier hammer's pulse is longer: before, the clock of the simulation after was another
    one."""
    heavy = effect("contact.effective_mass", mass_factor=1.3)
    record = hammer_record([heavy], repetitions=2)
    stage = ContactObservables(record)
    without = pictures_of(GapTable.of(record, [stage]), [stage])
    assert all(residual.after is None for residual in without.residuals)
    assert all(curve.after is None for curve in without.curves)  # no cause, no after
    (curve,) = pictures_of(GapTable.of(record, [stage]), [stage], [([heavy], 1.0)]).curves
    assert curve.after is not None
    peak = curve.measured.max()
    assert np.abs(curve.after - curve.measured).max() < 0.03 * peak
    assert np.abs(curve.before - curve.measured).max() > 0.1 * peak
    pressed = np.flatnonzero(curve.measured > 0.02 * peak)
    assert pressed[0] > 0 and pressed[-1] < curve.x.size - 1 and pressed.size > 0.4 * curve.x.size


def test_spectra_are_drawn_for_each_channel() -> None:
    gain = effect("sensor.acceleration_gain", gain=1.3)
    record = played([gain])
    stage = PlateObservables(record)
    pictures = pictures_of(GapTable.of(record, [stage]), [stage], [([gain], 1.0)])
    assert [curve.title.split(",")[0] for curve in pictures.curves] == [
        "acceleration 1",
        "acceleration 2",
    ]
    for curve in pictures.curves:
        assert curve.after is not None and curve.logarithmic
        np.testing.assert_allclose(curve.measured / curve.before, 1.3, rtol=0.02)
        np.testing.assert_allclose(curve.after / curve.measured, 1.0, rtol=0.02)


def test_mean_of_choices_is_drawn_by_their_weights_and_its_effects_are_told() -> None:
    """A quarter of a gain of 1.05 and three quarters of 1.01: residuals fall by the mean of their
    logarithms."""
    gains = [effect("sensor.velocity_gain", gain=1.05), effect("sensor.velocity_gain", gain=1.01)]
    configurations = (RunConfiguration("0.3 bar", {"tank_pressure": 0.3e5}),)
    run = Run(0, 0, 1, 0, 0.3e5, 0.5, 1.1 * float(muzzle_velocity(BENCH, 0.3e5, 0.5)), 0.01)
    record = CampaignRecord("made", "gun", configurations, (run,), gun=BENCH)
    stage = GunObservables(record)
    pictures = pictures_of(
        GapTable.of(record, [stage]), [stage], [([gains[0]], 0.25), ([gains[1]], 0.75)]
    )
    assert pictures.drawn_effects == (("sensor.velocity_gain",), ("sensor.velocity_gain",))
    (picture,) = pictures.residuals
    assert picture.after is not None
    mean = 0.25 * np.log(1.05) + 0.75 * np.log(1.01)
    np.testing.assert_allclose(picture.after, picture.before - mean, atol=1e-9)


def test_mean_pulse_and_mean_spectrum_are_drawn() -> None:
    contact = ContactObservables(hammer_record(repetitions=2))
    heavy = [effect("contact.effective_mass", mass_factor=factor) for factor in (1.1, 1.3)]
    plate = PlateObservables(played([effect("sensor.acceleration_gain", gain=1.3)]))
    gains = [effect("sensor.acceleration_gain", gain=gain) for gain in (1.2, 1.44)]
    for stage, effects in ((contact, heavy), (plate, gains)):
        gap = GapTable.of(stage.record, [stage])
        first, second, both = (
            pictures_of(gap, [stage], choices).curves[0].after
            for choices in (
                [([effects[0]], 1.0)],
                [([effects[1]], 1.0)],
                [([own], 0.5) for own in effects],
            )
        )
        assert first is not None and second is not None and both is not None
        mean = 0.5 * (first + second) if stage is contact else np.sqrt(first * second)
        np.testing.assert_allclose(both, mean, rtol=1e-9, atol=1e-9)
        assert np.abs(first - both).max() > 0.01 * np.abs(both).max()
