"""The campaigns of the virtual bench that ship for the demo are what their plans and seeds give."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.demo.virtual_campaign import (
    CHANGED,
    REHEARSAL,
    VirtualCampaign,
    make_campaign_plan,
    simulate_runs,
)
from pyroshock.app.operations.plan.rehearsal import rows_of_stored
from pyroshock.doe.plans import StoredPlan
from pyroshock.examples.virtual_campaigns.packing import AFTER_IMPACT_S, FROM_S, step_of, unpacked
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Pulse
from pyroshock.virtualbench.campaigns.gun import SENSORS
from pyroshock.virtualbench.recorder import open_seal
from sqlalchemy import select
from support.stores.stores import opened

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = pytest.mark.parametrize("campaign", [REHEARSAL, CHANGED], ids=lambda c: c.name)


def plan_of(campaign: VirtualCampaign, folder: Path) -> StoredPlan:
    with opened(f"sqlite:///{folder / 'plan.db'}", create=True) as store:
        return make_campaign_plan(store, campaign)


def runs_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@CAMPAIGNS
def test_rows_are_those_of_the_plan(campaign, tmp_path):
    plan = plan_of(campaign, tmp_path)
    runs, rows = campaign.shipped_runs(plan), runs_of(EXAMPLES / campaign.name)
    assert [(int(row["run"]), int(row["repetition"])) for row in rows] == [
        (run, repetition) for run in runs for repetition in range(1, campaign.repetitions + 1)
    ]
    assert len(runs) + len(campaign.open_runs(plan)) == len(plan.runs)
    planned = rows_of_stored(plan)[1]
    for row, run in zip(rows[:: campaign.repetitions], planned[: len(runs)], strict=True):
        assert {name: row[name] for name in run} == run
    recordings = EXAMPLES / campaign.name / "recordings"
    assert {row["recording"] for row in rows} == {
        f"recordings/{path.name}" for path in recordings.iterdir()
    }


def test_a_step_is_at_most_twice_the_noise_of_its_sensor():
    for sensor in SENSORS:
        assert 0 < step_of(sensor.name) <= 2 * sensor.noise


#: Between processors the instant of an impact differs by less.
INSTANT_S = 1e-7


@CAMPAIGNS
def test_a_recording_is_the_simulated_one_to_half_a_step(campaign, tmp_path):
    """For another processor one step more, and what 0.1 µs change in a sample: the flight through
    the barrel is solved to a tolerance, and ends some 0.04 µs earlier or later there."""
    plan = plan_of(campaign, tmp_path)
    run = campaign.shipped_runs(plan)[4]
    simulated = simulate_runs(plan, campaign, [run], tmp_path / "campaign")
    truth = open_seal(simulated.seal).runs[0]
    packed_path = EXAMPLES / campaign.name / truth["recording"]
    channels = unpacked(packed_path.with_suffix(".h5"))
    impact_s = truth["hits"][0]["start_s"]
    with np.load(simulated.folder / truth["recording"]) as archive:
        rate_hz = float(archive["fs"])
        kept_samples = slice(round(FROM_S * rate_hz), round((impact_s + AFTER_IMPACT_S) * rate_hz))
        assert set(channels) == set(archive.files) - {"fs"}
        for name, values in channels.items():
            difference = np.abs(values - archive[name][kept_samples])
            slope = np.abs(np.gradient(archive[name][kept_samples])) * rate_hz
            steepest_near = np.max([np.roll(slope, shift) for shift in (-2, -1, 0, 1, 2)], axis=0)
            assert np.all(difference <= 1.5 * step_of(name) + INSTANT_S * steepest_near)
            assert np.median(difference) <= 0.5 * step_of(name)
            assert np.ptp(values) > 20 * step_of(name)


def test_pulse_of_a_packed_recording_is_the_sealed_one(tmp_path):
    """Against the truth of the simulation: contact time to 5 %, peak force to the load cells' gain
    faults, which reach some percent."""
    plan = plan_of(REHEARSAL, tmp_path)
    run = REHEARSAL.shipped_runs(plan)[0]
    simulated = simulate_runs(plan, REHEARSAL, [run], tmp_path / "campaign")
    (truth,) = open_seal(simulated.seal).runs[0]["hits"]
    with opened(f"sqlite:///{tmp_path / 'store.db'}", create=True) as store:
        ingest_folder(store, EXAMPLES / REHEARSAL.name)
        with store.reading() as session:
            pulse = session.scalars(select(Pulse).where(Pulse.current).order_by(Pulse.id)).first()
    assert pulse is not None
    assert pulse.contact_time_s == pytest.approx(truth["contact_time_s"], rel=0.05)
    assert pulse.peak_force_n == pytest.approx(truth["peak_plate_force_n"], rel=0.05)
