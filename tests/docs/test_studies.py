"""What the studies of two real guns say, from their own functions."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.diagnose import Options, diagnose
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import effect

from docs.studies.first_shots import clearance_leak, corner_leakage, predicted, shots_needed
from docs.studies.gun_causes import distances, fit, gap
from docs.studies.real_guns import first_shots_record, trettel_record, write_folder
from docs.studies.small_gun import constant_factor, held_out, stuck_stays


@pytest.fixture(scope="module")
def first() -> GunObservables:
    return GunObservables(first_shots_record())


@pytest.fixture(scope="module")
def small(real_data: Path) -> GunObservables:
    return GunObservables(trettel_record(real_data / "trettel-blastersim" / "shots.csv"))


def test_first_shots_are_table_5_1_with_its_factor_and_uncertainties(first: GunObservables) -> None:
    assert GunObservables(first_shots_record(0.5)).output() == pytest.approx(
        [10.58, 11.35, 17.53, 14.13, 16.98], abs=0.01
    )
    stated = [run.velocity_u_m_s for run in first.record.runs]
    assert stated == pytest.approx([0.13, 0.15, 0.28, 0.18, 0.23], abs=0.01)
    of = gap(first)
    assert np.exp(of.y.mean()) == pytest.approx(0.504, abs=0.001)
    assert np.sum(((of.y - of.y.mean()) / of.s) ** 2) == pytest.approx(57, abs=1)
    assert of.y.std(ddof=1) == pytest.approx(0.051, abs=0.001)


def test_corner_takes_thirty_to_forty_seven_percent_for_the_thesis_range() -> None:
    assert corner_leakage(1 - np.array([0.30, 0.47])) == pytest.approx([0.4, 0.6], abs=0.005)
    assert corner_leakage(np.array([0.0, 0.5, 1.0])) == pytest.approx(
        [1.0, 1 - 0.5 ** (10 / 7), 0.0], rel=1e-12
    )


def test_leak_is_a_part_of_the_gap_and_all_of_it_with_the_atmosphere_at_low_pressure(
    first: GunObservables,
) -> None:
    leak = clearance_leak(first, 0.6)
    assert (
        leak.share == pytest.approx([0.05, 0.05, 0.03, 0.04, 0.03], abs=0.006)
        and leak.psi.max() < 0.25
    )
    assert clearance_leak(first, 1.0).share.max() < 0.1
    both = clearance_leak(first, 0.6, [effect("gun.back_pressure")])
    assert both.share == pytest.approx([1.13, 0.95, 0.30, 0.44, 0.27], abs=0.01)


@pytest.mark.parametrize("identity", ["gun.back_pressure", "sensor.pressure_offset"])
def test_no_constant_force_makes_a_constant_factor(first: GunObservables, identity: str) -> None:
    assert fit(first, gap(first, 0.05), [identity], anywhere=True).chi2 > 100


def test_no_constant_drag_makes_a_constant_factor_and_what_does_is_on_no_bench(
    first: GunObservables,
) -> None:
    of = gap(first, 0.05)
    drags = [
        [effect("gun.sliding_friction", added_coefficient=0.0, seal_force_n=f)]
        for f in np.linspace(0, 40, 81)
    ]
    misfit = (of.y - first.changes(drags)[:, :, 0]) / of.s
    assert np.nanmin((misfit**2).sum(axis=1)) == pytest.approx(269, abs=1)
    found = fit(first, gap(first, 0.05), ["gun.sliding_friction"], anywhere=True)
    assert found.chi2 == pytest.approx(4.6, abs=0.1) and not found.likely
    found = fit(first, gap(first, 0.05), ["sensor.velocity_gain"], anywhere=True)
    assert found.chi2 == pytest.approx(4.1, abs=0.1) and not found.likely


def test_planted_effect_comes_back_and_a_folder_holds_the_record(
    first: GunObservables, tmp_path: Path
) -> None:
    planted = effect("gun.sliding_friction", added_coefficient=0.0, seal_force_n=8.0)
    runs = tuple(
        replace(run, velocity_m_s=v)
        for run, v in zip(first.record.runs, first.output([planted]), strict=True)
    )
    stage = GunObservables(replace(first.record, runs=runs))
    found = fit(stage, gap(stage), ["gun.sliding_friction"])
    assert found.chi2 < 0.01 and found.change == pytest.approx(gap(stage).y, abs=1e-3)
    record = first_shots_record()
    folder = write_folder(record, tmp_path / "shots", "1970-01-01")
    with (folder / "campaign.toml").open("rb") as handle:
        assert tomllib.load(handle)["bench"]["gun"] == vars(record.gun)
    with (folder / "runs.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    assert [float(row["measured_velocity_m_s"]) for row in rows] == [
        run.velocity_m_s for run in record.runs
    ]
    assert [float(row["tank_pressure_bar"]) for row in rows] == pytest.approx(
        [0.2319, 0.2651, 0.6158, 0.4042, 0.5784]
    )


def test_distances_are_in_standard_errors_and_predictions_are_the_fits(
    first: GunObservables,
) -> None:
    of = gap(first, 0.05)
    fits = [
        fit(first, of, [identity]) for identity in ("gun.heat_exchange", "sensor.velocity_gain")
    ]
    expected = np.linalg.norm(fits[0].change - fits[1].change) / 0.05
    assert distances(fits, of.s) == pytest.approx(np.array([[0, expected], [expected, 0]]))
    found = fit(first, gap(first), ["sensor.pressure_offset"])
    settings = [
        (run.tank_pressure_pa or 0.0, run.bullet_mass_kg or 0.0) for run in first.record.runs
    ]
    assert predicted(first, [found], settings)[0] == pytest.approx(
        np.exp(first.simulated()[:, 0] + found.change), rel=1e-9
    )
    needed = shots_needed(np.exp([[0.0, 0.0], [0.05, 0.4]]), scatter=0.05)
    assert needed[0, 1] == pytest.approx([16, 1]) and np.all(np.isinf(needed[0, 0]))


def test_atmosphere_and_dead_volume_predict_an_unseen_pressure_better_than_a_factor(
    small: GunObservables,
) -> None:
    assert len(small.record.runs) == 74 and list(gap(small).shots) == [14, 15, 15, 15, 15]
    assert constant_factor(gap(small)).rms(gap(small)) == pytest.approx(0.162, abs=0.002)
    of = gap(small)
    told = held_out(small, of, ("gun.back_pressure", "gun.dead_volume"))
    assert told.rms(of) == pytest.approx(0.037, abs=0.003)


def test_named_pair_lets_the_dart_leave_and_a_free_atmosphere_makes_volume_and_factor_one(
    small: GunObservables,
):
    """It predicts velocities, and is not the cause: the volume is many times the 9 to 18 ml that
    were measured."""
    found = fit(small, gap(small), ("gun.back_pressure", "gun.dead_volume"))
    assert not stuck_stays(found) and found.effects[1].as_json()["volume_m3"] > 6 * 18e-6
    of = gap(small)
    fits = [
        fit(small, of, ("gun.back_pressure", other), anywhere=True)
        for other in ("gun.dead_volume", "sensor.velocity_gain")
    ]
    assert [effect_fit.chi2 for effect_fit in fits] == pytest.approx(
        [37.2, 37.2], abs=0.2
    ) and distances(fits, of.s)[0, 1] < 0.2


def test_diagnosis_predicts_an_unseen_pressure_with_atmosphere_and_dead_volume(
    small: GunObservables,
) -> None:
    """74 shots with one dart: the pair that the table has as the best on a pressure that it was not
    fitted to."""
    said = diagnose(small.record, options=Options(where=False, plan=False, rate_pulses=False))
    assert set(said.first.effects[0].split("+")) == {"gun.back_pressure", "gun.dead_volume"}
    assert said.shrinkage[0].held_out_by == "configuration"
    assert said.shrinkage[0].fraction is not None and said.shrinkage[0].fraction > 0.9
    assert said.shrinkage[0].after < 0.07
