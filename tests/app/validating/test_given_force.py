"""Shots without mass or velocity of the impactor: accelerations and spectra are predicted from the
measured force."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.validate.request import ValidationRequest
from pyroshock.app.operations.validate.validation import predicted_folds
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.chain import Twin
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.spectrum_calibration import SpectrumCalibration
from pyroshock.validation.prediction_scores.shot_comparison import (
    QuantityComparison,
    compared_shots,
)
from support.records.twin_parts import HalfSine, setting
from support.stores.stores import pyroshock

RATE, SAMPLES, PHASES = 100_000.0, 10_000, 201
LINES = 200 * 2.0 ** (np.arange(10) / 2)
SENSORS = ("a1", "a2")
#: Contact times (s) and peaks (N) of the configurations.
BLOWS = [(time, peak) for time in (0.1e-3, 0.2e-3, 0.4e-3, 0.8e-3) for peak in (300.0, 900.0)]
REPETITIONS = 3


def plate() -> ModalPlate:
    """Ten modes that the twin's table has as they are."""
    rng = np.random.default_rng(4)
    return ModalPlate(
        frequency_hz=np.geomspace(230.0, 5e3, 10),
        damping_ratio=np.full(10, 0.008),
        shape_impact=0.5 * rng.standard_normal((1, 10)),
        shapes=0.5 * rng.standard_normal((2, 10)),
        impact_points=("#1",),
        sensors=SENSORS,
    )


def response(table: ModalPlate, force: Any) -> Any:
    """Accelerations (sensors, samples): each mode's equation of motion, exact for a force that is
    straight between samples."""
    from scipy.signal import cont2discrete, lfilter

    out = np.zeros((len(SENSORS), force.size))
    for mode, (frequency, damping) in enumerate(
        zip(table.frequency_hz, table.damping_ratio, strict=True)
    ):
        omega = 2 * np.pi * frequency
        system = ([1.0, 0.0, 0.0], [1.0, 2 * damping * omega, omega**2])
        b, a, _ = cont2discrete(system, 1 / RATE, method="foh")
        out += np.outer(
            table.shapes[:, mode], lfilter(b.ravel(), a, table.shape_impact[0, mode] * force)
        )
    return out


def measured(seed: int = 0) -> MeasuredShots:
    """Hits on the plate, of which force and accelerations are known; a shot's gain and force
    scatter by 2 %."""
    rng = np.random.default_rng(seed)
    phases, time = np.linspace(0.0, 1.0, PHASES), np.arange(SAMPLES) / RATE
    forces, contact, figures = [], [], []
    for contact_time, peak in BLOWS:
        for _ in range(REPETITIONS):
            own_time, own_peak = np.array([contact_time, peak]) * np.exp(
                0.02 * rng.standard_normal(2)
            )
            force = own_peak * np.sin(np.pi * phases) ** 1.4
            force[-1] = 0.0
            felt = response(plate(), np.interp(time / own_time, phases, force, right=0.0))
            felt *= np.exp(0.02 * rng.standard_normal((2, 1)))
            spectra = [
                shock_response_spectrum(record, RATE, LINES, q=10.0).maximax for record in felt
            ]
            figures.append(np.column_stack([np.abs(felt).max(axis=1), spectra]))
            forces.append(force)
            contact.append(own_time)
    force, contact_time_s, values = np.array(forces), np.array(contact), np.array(figures)
    impulse = np.trapezoid(force, axis=1) * contact_time_s / (PHASES - 1)
    unknown = np.full(len(force), np.nan)
    masses = (
        contact_time_s / 2e-4
    ) ** 2  # as of a spring: what tells the calibration of the contact time
    return MeasuredShots(
        settings=tuple(
            setting(impactor_mass_kg=float(mass), impact_velocity_m_s=float(value / mass))
            for mass, value in zip(masses, impulse, strict=True)
        ),
        configuration=np.repeat(np.arange(len(BLOWS)), REPETITIONS),
        impact_velocity_m_s=unknown,
        impact_velocity_u_m_s=unknown,
        contact_time_s=contact_time_s,
        peak_force_n=force.max(axis=1),
        impulse_n_s=impulse,
        sensors=SENSORS,
        peak_acceleration_m_s2=values[..., 0],
        frequency_hz=LINES,
        q=10.0,
        spectra_m_s2=values[..., 1:],
        given_force_n=force,
    )


@pytest.fixture(scope="module")
def shots() -> MeasuredShots:
    return measured()


def twin_of_table(table: ModalPlate) -> Twin:
    return Twin(HalfSine(), plate=PlateStage({"aluminum": table}), frequency_hz=LINES)


def folds_of(shots: MeasuredShots, twin: Twin) -> dict[str, QuantityComparison]:
    """Each fold predicted after the shots of the others."""

    def twin_without(configurations: Sequence[int], _: str) -> Any:
        others = shots.without(configurations)
        return SimpleNamespace(
            twin=replace(twin, calibration=SpectrumCalibration.of(others, twin.replayed_db(others)))
        )

    _, draws, missing = predicted_folds(
        shots, twin_without, ValidationRequest(campaign="x", folds=len(BLOWS))
    )
    assert missing == []
    return {
        item.measure.name: item for item in compared_shots(shots, draws, np.random.default_rng(1))
    }


def test_plate_under_measured_forces_is_that_of_its_equation_and_covers(
    shots: MeasuredShots,
) -> None:
    values = np.concatenate([shots.peak_acceleration_m_s2[..., None], shots.spectra_m_s2], axis=-1)
    residual = 20 * np.log10(values) - twin_of_table(plate()).replayed_db(shots)
    assert np.abs(residual).max() < 20 * np.log10(
        np.exp(0.08)
    )  # four standard deviations of the gain
    comparisons = folds_of(shots, twin_of_table(plate()))
    assert set(comparisons) == {
        f"{kind}_{name}" for kind in ("peak_acceleration", "srs") for name in SENSORS
    }
    for comparison in comparisons.values():
        assert comparison.score.shots == len(shots) and np.mean(comparison.values.inside90) >= 0.85
        assert np.median(np.abs(comparison.values.residual)) < (
            0.35 if comparison.is_spectrum else 0.04
        )


def test_table_with_other_modes_is_seen_and_shots_without_a_force_told_apart(
    shots: MeasuredShots,
) -> None:
    """Modes a third too high, nothing learned: the spectra are not those of the bench."""
    wrong = twin_of_table(replace(plate(), frequency_hz=1.33 * plate().frequency_hz))
    draws = {
        row: wrong.predict(s, measured_force=shots.given_force(row)).draws
        for row, s in enumerate(shots.settings)
    }
    comparisons = compared_shots(shots, draws, np.random.default_rng(1))
    assert all(np.mean(item.values.inside90) < 0.7 for item in comparisons if item.is_spectrum)
    assert shots.given_force_n is not None
    force = shots.given_force_n.copy()
    force[0] = np.nan
    mixed = replace(shots, given_force_n=force)
    assert (
        mixed.force_is_given.tolist() == [False] + [True] * (len(shots) - 1)
        and mixed.given_force(0) is None
    )
    with pytest.raises(ValueError, match="1 of 2 shots are not predicted from their force"):
        mixed.given_pulses(np.array([0, 1]))
    pulses = shots.given_pulses(np.array([3, 5]))
    np.testing.assert_allclose(pulses.contact_time_s, shots.contact_time_s[[3, 5]])
    np.testing.assert_allclose(pulses.impulse_n_s, shots.impulse_n_s[[3, 5]])
    with pytest.raises(ValueError, match="given_force_n has shape"):
        replace(shots, given_force_n=force[1:])


def test_campaign_without_mass_is_validated(examples: Path, tmp_path: Path) -> None:
    """An example campaign whose impacts have force and accelerations alone."""
    db = f"sqlite:///{tmp_path / 'lab.db'}"
    assert pyroshock("ingest", examples / "plate-damping", "--db", db).exit_code == 0
    result = pyroshock("validate", "plate-damping", "--db", db, "--json")
    data = json.loads(result.stdout)
    assert result.exit_code == 0, result.stderr
    assert "it was given the measured force of every shot" in data["seen"]
    scores = {row["name"]: row for row in data["quantities"]}
    sensors = ("acceleration_1", "acceleration_2")
    assert set(scores) == {
        f"{kind}_{name}" for kind in ("peak_acceleration", "srs") for name in sensors
    }
    assert all(row["shots"] == 20 and row["coverage90"] >= 0.85 for row in scores.values())
    assert data["left_out"] == []
