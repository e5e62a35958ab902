"""A campaign folder as a record: its files' own numbers, and nothing left behind."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.reading import campaign as folders
from pyroshock.diagnosis.reading import read_folder
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.ingest.errors import IngestError
from support.records.campaigns import (
    FS_HZ,
    gun_campaign,
    gun_rows,
    hammer_campaign,
    replace_in,
    write_recording,
    write_runs,
)
from support.records.plate_folders import CHANNELS, PlateCampaign, plate_campaign, small_plate


@pytest.fixture(scope="module")
def struck_plate(tmp_path_factory: pytest.TempPathFactory) -> tuple[PlateCampaign, CampaignRecord]:
    """A campaign as it was written, and its record; tests change neither."""
    campaign = plate_campaign(tmp_path_factory.mktemp("plate") / "c")
    return campaign, read_folder(campaign.folder)


def test_runs_and_factors_are_those_of_the_table(tmp_path: Path) -> None:
    record = read_folder(hammer_campaign(tmp_path / "c", recordings=3, hits=2))
    assert [(run.run, run.repetition, run.order) for run in record.runs] == [
        (1, 1, 0), (1, 2, 1), (2, 1, 2), (2, 2, 3), (3, 1, 4), (3, 2, 5),
    ]  # fmt: skip
    assert record.configuration_of.tolist() == [0, 0, 1, 1, 2, 2]
    assert (record.hammer_mass_kg, record.plate) == (0.32, None)
    first = record.configurations[0]
    assert first.factors == {"tip_material": "aluminum", "tip_radius": 0.01, "hammer_speed": "low"}
    assert first.label == "tip_material aluminum, tip_radius_mm 10"
    for configuration in record.configurations:
        assert record.materials[str(configuration.factors["tip_material"])].youngs_modulus_pa > 0


def test_series_are_the_files_own_samples_on_the_clock_of_the_force(
    struck_plate: tuple[PlateCampaign, CampaignRecord],
) -> None:
    campaign, record = struck_plate
    for run in record.runs:
        blow, written = campaign.blows[run.run][run.repetition - 1], campaign.written[run.run]
        assert run.force.start_s * FS_HZ == pytest.approx(-64, abs=1e-6)
        assert run.force.time_s[-1] >= 1.5 * blow.width_s
        begin = _find(run.force.values, written["force"])
        assert (begin + 64) / FS_HZ == pytest.approx(blow.start_s, abs=3 / FS_HZ)
        contact = begin - run.force.start_s * FS_HZ
        assert tuple(run.accelerations) == CHANNELS
        for name, series in run.accelerations.items():
            first = round(contact + series.start_s * FS_HZ)
            np.testing.assert_array_equal(
                series.values, written[name][first : first + series.values.size]
            )
    far = record.runs[0].accelerations["acceleration_1"]
    assert far.time_s[-1] == pytest.approx(0.1, abs=1 / FS_HZ)
    assert far.time_s[0] == pytest.approx(-64 / FS_HZ, abs=1e-9)
    assert record.plate.sensors == CHANNELS
    np.testing.assert_allclose(record.plate.shapes, small_plate().shapes, rtol=1e-9)
    np.testing.assert_array_equal(record.plate.frequency_hz, small_plate().frequency_hz)


def test_cells_of_an_array_are_summed(
    struck_plate: tuple[PlateCampaign, CampaignRecord], tmp_path: Path
) -> None:
    shared = read_folder(plate_campaign(tmp_path / "three", cells=3).folder)
    for single, array in zip(struck_plate[1].runs, shared.runs, strict=True):
        np.testing.assert_allclose(array.force.values, single.force.values, rtol=1e-5, atol=1e-3)
    assert any("sum of 3 force channels" in text for text in shared.assumptions)


def test_clipped_channels_are_left_out_and_said(tmp_path: Path) -> None:
    record = read_folder(plate_campaign(tmp_path / "force", clip={"force": 1150.0}).folder)
    assert [run.force is None for run in record.runs] == [False, False, True, True, True, True]
    assert all(run.accelerations for run in record.runs)
    assert any(
        text.startswith("force: left out in 4 of 6 hits") and "(clipping" in text
        for text in record.assumptions
    )
    # Also where the contact is over: the pulse is whole, but what is compared with the plate is
    # not.
    record = read_folder(
        plate_campaign(tmp_path / "acceleration", clip={"acceleration_2": 400.0}).folder
    )
    assert {tuple(run.accelerations) for run in record.runs} == {CHANNELS[:1]}
    assert all(run.force is not None for run in record.runs)
    assert any(
        text.startswith("acceleration_2: left out in 6 of 6 hits") for text in record.assumptions
    )
    record = read_folder(plate_campaign(tmp_path / "sign", sign=-1).folder)
    assert all(run.force is not None and run.force.values.max() > 1000 for run in record.runs)
    assert any("compression as negative in 6 of 6" in text for text in record.assumptions)


def test_a_gun_s_table_alone_gives_its_velocities(tmp_path: Path) -> None:
    record = read_folder(gun_campaign(tmp_path / "c", shots=4))
    assert record.kind == "gun"
    assert record.gun.efficiency == 0.5
    for run, row in zip(record.runs, gun_rows(4), strict=True):
        assert run.tank_pressure_pa == pytest.approx(float(str(row["tank_pressure_bar"])) * 1e5)
        assert (run.velocity_m_s, run.velocity_u_m_s) == (row["measured_velocity_m_s"], 0.1)
        assert (run.bullet_mass_kg, run.force, dict(run.accelerations)) == (0.1428, None, {})
    assert any("the set one" in text for text in record.assumptions)
    assert {run.travel_m for run in record.runs} == {None}
    assert not any("travel" in text for text in record.assumptions)


def test_remarks_make_no_configurations(tmp_path: Path) -> None:
    rows = [
        dict(row, run=i, tank_pressure_bar=0.3 + 0.1 * (i % 2)) for i, row in enumerate(gun_rows(8))
    ]
    noted = [dict(row, note=f"shot at {i} o'clock", angle=i % 3) for i, row in enumerate(rows)]
    folder = gun_campaign(tmp_path / "c")
    write_runs(folder, noted)
    record = read_folder(folder)
    assert len(record.configurations) == 6
    assert all(
        "note" not in each.factors and "angle" in each.factors for each in record.configurations
    )
    assert "note: a note on each run, and not a setting" in record.assumptions


def test_a_recording_or_channel_that_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    campaign = plate_campaign(tmp_path / "recording")
    (campaign.folder / "2.npz").write_bytes(b"no archive")
    record = read_folder(campaign.folder)
    assert [run.run for run in record.runs] == [1, 1, 3, 3]
    assert "recordings that could not be read and are left out: 1" in record.assumptions
    campaign = plate_campaign(tmp_path / "channel")
    broken = campaign.written[1]
    write_recording(
        campaign.folder / "1.npz", {**broken, "acceleration_1": broken["acceleration_1"] * np.nan}
    )
    record = read_folder(campaign.folder)
    assert [len(run.accelerations) for run in record.runs] == [1, 1, 2, 2, 2, 2]


def test_nothing_is_left_behind_and_a_large_folder_gives_the_same_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = plate_campaign(tmp_path / "c").folder
    before = sorted(campaign.rglob("*"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    small = read_folder(campaign)
    monkeypatch.setattr(folders, "IN_MEMORY_BYTES", 0)
    large = read_folder(campaign)
    assert sorted(campaign.rglob("*")) == before
    assert not list((tmp_path / "temporary").iterdir())
    assert large.configurations == small.configurations
    for from_memory, from_file in zip(small.runs, large.runs, strict=True):
        np.testing.assert_array_equal(from_memory.force.values, from_file.force.values)


def test_a_refused_folder_leaves_nothing_to_the_next_one(tmp_path: Path) -> None:
    """The same name with another content would be refused, if the store still knew it."""
    refused = hammer_campaign(tmp_path / "refused")
    replace_in(refused / "runs.csv", "low", "fast")
    with pytest.raises(IngestError, match="hammer_speed"):
        read_folder(refused)
    read_folder(hammer_campaign(tmp_path / "first", seed=1))
    other = hammer_campaign(tmp_path / "second", recordings=1, seed=2)
    replace_in(other / "campaign.toml", "mass_kg = 0.32", "mass_kg = 0.4")
    record = read_folder(other)
    assert (record.hammer_mass_kg, len(record.runs)) == (0.4, 2)


@pytest.mark.parametrize(
    ("name", "configurations", "runs"),
    [("gun-valve-flow", 16, 32), ("hammer-effective-mass", 16, 32), ("plate-damping", 10, 20)],
)
def test_examples_are_read_whole(examples: Path, name: str, configurations: int, runs: int) -> None:
    record = read_folder(examples / name)
    assert (len(record.configurations), len(record.runs)) == (configurations, runs)
    assert all((run.velocity_m_s is not None) == (name != "plate-damping") for run in record.runs)
    assert all((run.force is None) == (name == "gun-valve-flow") for run in record.runs)


def _find(piece: np.ndarray, whole: np.ndarray) -> int:
    """Where the samples of `piece` begin in `whole`; they must be there, exactly."""
    candidates = np.flatnonzero(whole[: whole.size - piece.size + 1] == piece[0])
    places = [int(i) for i in candidates if np.array_equal(whole[i : i + piece.size], piece)]
    assert len(places) == 1
    return places[0]


def test_a_travel_or_plate_is_that_of_the_bench(tmp_path: Path) -> None:
    folder = hammer_campaign(tmp_path / "c")
    drawing = (
        'material = "aluminium"\nthickness_m = 0.012\noutline_m = [[0, 0], [0.5, 0], [0.5, 0.4]]'
    )
    replace_in(
        folder / "campaign.toml",
        "[channels.force]",
        f"[bench.plate]\n{drawing}\n\n[channels.force]",
    )
    record = read_folder(folder)
    assert record.plate_material == "aluminum"
    assert record.plate_thickness_m == 0.012
    assert record.plate_outline_m == ((0.0, 0.0), (0.5, 0.0), (0.5, 0.4))
    folder = gun_campaign(tmp_path / "gun", shots=4)
    write_runs(folder, [{**row, "travel_mm": "long"} for row in gun_rows(4)])
    with pytest.raises(ValueError, match=r"travel_mm is 'long' .* expected a number above 0"):
        read_folder(folder)


def test_accelerations_need_a_contact_or_their_own_ringing(tmp_path: Path) -> None:
    campaign = plate_campaign(tmp_path / "without", hits=1, with_force=False)
    record = read_folder(campaign.folder)
    for run in record.runs:
        blow = campaign.blows[run.run][0]
        assert run.force is None
        assert tuple(run.accelerations) == CHANNELS
        for name, series in run.accelerations.items():
            first = _find(series.values, campaign.written[run.run][name])
            begin = first / FS_HZ - series.start_s
            assert begin == pytest.approx(blow.start_s, abs=0.3 * blow.width_s)
            assert series.time_s[-1] == pytest.approx(0.1, abs=0.01)
    assert any("no force was recorded with 3 of 3 hits" in text for text in record.assumptions)
    campaign = plate_campaign(tmp_path / "silent", hits=1)
    for number, channels in campaign.written.items():
        silent = {**channels, "force": np.zeros_like(channels["force"])}
        write_recording(campaign.folder / f"{number}.npz", silent)
    record = read_folder(campaign.folder)
    assert not any(run.accelerations for run in record.runs)
    assert any(
        "no contact force in the recordings of 3 of 3 hits" in text for text in record.assumptions
    )


@pytest.mark.parametrize(
    ("column", "values"), [("travel_mm", (885, 600)), ("travel_m", (0.885, 0.6))]
)
def test_a_projectile_s_own_travel_is_read_with_its_run(
    tmp_path: Path, column: str, values: tuple[float, float]
) -> None:
    folder = gun_campaign(tmp_path / "c", shots=4)
    write_runs(folder, [{**row, column: values[i % 2]} for i, row in enumerate(gun_rows(4))])
    record = read_folder(folder)
    assert [run.travel_m for run in record.runs] == pytest.approx([0.885, 0.6] * 2)
    sentence = (
        f"travel to the vent holes: 600 to 885 mm, as the column {column} has it for 4 of 4 runs"
    )
    assert f"{sentence}; [bench.gun] has 900 mm" in record.assumptions


@pytest.mark.parametrize("channel", ["force", "acceleration_1"])
def test_a_channel_without_a_number_is_refused_by_name(tmp_path: Path, channel: str) -> None:
    campaign = plate_campaign(tmp_path / "c")
    for number, channels in campaign.written.items():
        write_recording(
            campaign.folder / f"{number}.npz", {**channels, channel: channels[channel] * np.nan}
        )
    with pytest.raises(
        ValueError, match=f"channel {channel} holds no number in any of its 3 recordings"
    ):
        read_folder(campaign.folder)
