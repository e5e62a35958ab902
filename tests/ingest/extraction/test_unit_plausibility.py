"""A unit that is wrong throughout a campaign is one refusal with the factor; correct campaigns are
never refused."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.extraction.impulse_plausibility import (
    MomentumRatio,
    refuse_wrong_clock,
    refuse_wrong_unit,
)
from pyroshock.ingest.folder.bench_rules import UNIT_FACTOR
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact
from sqlalchemy import func, select
from support.records.campaigns import FS_HZ, HAMMER_TOML, write_folder

#: Half sines of 1 ms whose impulse is 1.5 times 0.32 kg times the row's velocity.
MASS_KG, WIDTH_S, RATIO = 0.32, 1e-3, 1.5


def campaign(folder, factor, wrong=None, rate_factor=1.0):
    """A hammer campaign with a hit a recording; the force is written in a unit that reads `factor`
    times newtons, the sampling rate in one that reads `rate_factor` times hertz."""
    rows, files = ["run,repetition,tip_material,tip_radius_mm,impact_velocity_m_s,recording"], {}
    rng = np.random.default_rng(0)
    time_s = np.arange(round(0.1 * FS_HZ)) / FS_HZ - 0.04
    for i, velocity in enumerate(np.linspace(0.5, 2.0, 6), 1):
        peak = RATIO * MASS_KG * velocity * np.pi / (2 * WIDTH_S)
        inside = (time_s > 0) & (time_s < WIDTH_S)
        force = np.where(
            inside, peak * np.sin(np.pi * time_s / WIDTH_S), 0.0
        ) + 0.05 * rng.standard_normal(time_s.size)
        scale = factor if wrong is None or i in wrong else 1.0
        files[f"{i}.npz"] = {"force": scale * force, "fs": rate_factor * FS_HZ}
        rows.append(f"{i},1,steel,20,{velocity:.4f},{i}.npz")
    card = HAMMER_TOML.format(name="units").replace("range = 10000.0\n", "")
    return write_folder(folder, card, rows, files)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1 / 4.4482216, "force: values in lbf where N is declared"),
        (1e-3, "force: values in kN where N is declared"),
        (1 / 9.80665, "force: values in kgf where N is declared"),
        (100.0, "force: an amplifier's gain of 100"),
        (4.4482216, "force: values in N where lbf is declared"),
    ],
)
def test_a_force_in_another_unit_is_one_refusal_with_the_factor(store, tmp_path, factor, words):
    with pytest.raises(IngestError) as caught:
        ingest_folder(store, campaign(tmp_path / "c", factor), jobs=1)
    (fault,) = caught.value.faults
    assert (
        words in fault
        and f"--confirm {UNIT_FACTOR}" in fault
        and "in the median of 6 impacts" in fault
    )
    with store.reading() as session:
        assert session.scalar(select(func.count()).select_from(Impact)) == 0


@pytest.mark.parametrize(
    ("rate_factor", "words"),
    [
        (1e-3, "values in kHz where Hz is declared, or times in ms"),
        (1e3, "values in Hz where kHz is declared"),
    ],
)
def test_a_sampling_rate_in_another_unit_is_one_refusal(store, tmp_path, rate_factor, words):
    with pytest.raises(IngestError) as caught:
        ingest_folder(store, campaign(tmp_path / "c", 1.0, rate_factor=rate_factor), jobs=1)
    (fault,) = caught.value.faults
    assert (
        f"sampling rate: {words}" in fault
        and "which no impact does" in fault
        and f"--confirm {UNIT_FACTOR}" in fault
    )


def test_contacts_of_soft_and_of_hard_tips_have_a_right_sampling_rate():
    refuse_wrong_clock("c", [30e-3] * 5)
    refuse_wrong_clock("c", [20e-6] * 5)
    refuse_wrong_clock("c", [0.3] * 2)  # too few to tell


def test_a_length_of_the_bullet_in_metres_is_named_where_the_laser_gives_the_velocity():
    with pytest.raises(IngestError, match="bullet length: values in m where mm is declared"):
        refuse_wrong_unit("c", [MomentumRatio(1500.0, False, by_laser=True)] * 5)


def test_the_laboratory_may_say_that_the_unit_is_right(store, tmp_path):
    report = ingest_folder(
        store, campaign(tmp_path / "c", 1 / 4.4482216), jobs=1, confirmed=[UNIT_FACTOR]
    )
    assert report.impacts == 6
    assert {f["check"] for f in report.findings} >= {"implausible-impulse"}


def test_one_wrong_recording_is_its_own_finding(store, tmp_path):
    report = ingest_folder(store, campaign(tmp_path / "c", 1e-1, wrong={2}), jobs=1)
    doubted = [f["recording"] for f in report.findings if f["check"] == "implausible-impulse"]
    assert report.impacts == 6 and doubted == ["2.npz"]


def test_a_correct_campaign_has_no_finding(store, tmp_path):
    report = ingest_folder(store, campaign(tmp_path / "c", 1.0), jobs=1)
    assert report.impacts == 6
    assert not [f for f in report.findings if f["severity"] != "note"]


def test_ratios_of_correct_benches_are_never_refused():
    """Of 168 impacts of virtual hammer campaigns by integrated velocities: 1.8 to 4.6; of guns 1 to
    2."""
    rng = np.random.default_rng(0)
    for _ in range(500):
        refuse_wrong_unit("c", [MomentumRatio(r, True) for r in rng.uniform(1.8, 4.6, 12)])
        refuse_wrong_unit("c", [MomentumRatio(r, False) for r in rng.uniform(0.9, 2.1, 12)])
        refuse_wrong_unit(
            "c", [MomentumRatio(r, False, behind_anvil=True) for r in rng.uniform(2.9, 3.7, 12)]
        )


@pytest.mark.parametrize("factor", [1 / 4.4482216, 1 / 9.80665, 1e-3, 9.80665])
def test_integrated_velocities_tell_the_factor_as_well(factor):
    rng = np.random.default_rng(0)
    for _ in range(100):
        with pytest.raises(IngestError, match="a factor of"):
            refuse_wrong_unit(
                "c", [MomentumRatio(factor * r, True) for r in rng.uniform(1.84, 4.2, 12)]
            )
