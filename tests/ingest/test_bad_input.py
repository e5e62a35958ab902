"""Campaigns that must be refused: one line that names the trouble, exit code 2, nothing stored."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.records.campaigns import gun_rows, hammer_rows, recording_name, replace_in, with_cell, write_runs
from support.stores.stores import counts, ingested

Refused = Callable[..., str]


def test_missing_folder(tmp_path: Path, refused: Refused) -> None:
    refused(tmp_path / "nowhere", "nowhere", "no such folder")


def test_file_instead_of_folder(tmp_path: Path, refused: Refused) -> None:
    file = tmp_path / "campaign.csv"
    file.write_text("run\n")
    refused(file, "campaign.csv", "expected a campaign folder")


def test_empty_campaign(tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", "campaign.toml")


@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv"])
def test_missing_file(hammer_folder: Path, refused: Refused, name: str) -> None:
    (hammer_folder / name).unlink()
    refused(hammer_folder, name)


@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv"])
def test_folder_in_place_of_a_file(hammer_folder: Path, refused: Refused, name: str) -> None:
    (hammer_folder / name).unlink()
    (hammer_folder / name).mkdir()
    refused(hammer_folder, name, "cannot be read")


@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv"])
def test_text_that_is_not_utf_8(hammer_folder: Path, refused: Refused, name: str) -> None:
    file = hammer_folder / name
    file.write_bytes(file.read_bytes() + "# Prüfstand".encode("latin-1"))
    refused(hammer_folder, name, "not UTF-8")


def test_missing_recording(hammer_folder: Path, refused: Refused) -> None:
    (hammer_folder / recording_name(2)).unlink()
    refused(hammer_folder, "runs.csv", "row 4", "'recording'", recording_name(2))


def test_wrong_unit(hammer_folder: Path, refused: Refused) -> None:
    replace_in(hammer_folder / "campaign.toml", 'unit = "N"', 'unit = "kg"')
    refused(hammer_folder, "campaign.toml", "channels.force", "'kg'", "force", "'N'")


def test_unknown_material(hammer_folder: Path, refused: Refused) -> None:
    write_runs(hammer_folder, with_cell(hammer_rows(), "tip_material", "unobtainium", row=2))
    refused(hammer_folder, "runs.csv", "row 4", "'tip_material'", "'unobtainium'", "material")


def test_unknown_material_of_the_plate(hammer_folder: Path, refused: Refused) -> None:
    with (hammer_folder / "campaign.toml").open("a") as file:
        file.write('[bench.plate]\nmaterial = "unobtainium"\nthickness_m = 0.01\n')
    refused(hammer_folder, "campaign.toml", "bench.plate.material", "'unobtainium'")


def test_negative_mass_of_the_hammer(hammer_folder: Path, refused: Refused) -> None:
    replace_in(hammer_folder / "campaign.toml", "mass_kg = 0.32", "mass_kg = -0.32")
    refused(hammer_folder, "campaign.toml", "bench.hammer.mass_kg", "-0.32", "above zero")


def test_negative_mass_of_the_bullet(gun_folder: Path, refused: Refused) -> None:
    write_runs(gun_folder, with_cell(gun_rows(), "bullet_mass_kg", "-0.14", row=1))
    refused(gun_folder, "runs.csv", "row 3", "'bullet_mass_kg'", "'-0.14'", "above zero")


def test_duplicate_run(hammer_folder: Path, refused: Refused) -> None:
    write_runs(hammer_folder, with_cell(hammer_rows(), "repetition", 1, row=1))
    refused(hammer_folder, "runs.csv", "row 3", "duplicate run 1, repetition 1", "row 2")


@pytest.mark.parametrize("velocity", ["NaN", "nan", "inf", "-1", "fast", "1e999", "12.3.4", "0x1p3", "1_0"])
def test_velocity_that_is_no_number(gun_folder: Path, refused: Refused, velocity: str) -> None:
    write_runs(gun_folder, with_cell(gun_rows(), "measured_velocity_m_s", velocity))
    refused(gun_folder, "runs.csv", "row 2", "'measured_velocity_m_s'", repr(velocity), "a number of zero or more")


@pytest.mark.parametrize(
    "path", ["../outside.npz", "recordings/../../outside.npz", "{outside}", "link.npz", "away/outside.npz"]
)
def test_recording_that_leaves_the_folder(hammer_folder: Path, refused: Refused, path: str) -> None:
    outside = hammer_folder.parent / "outside.npz"
    shutil.copy(hammer_folder / recording_name(1), outside)
    (hammer_folder / "link.npz").symlink_to(outside)
    (hammer_folder / "away").symlink_to(outside.parent)
    path = path.format(outside=outside)
    write_runs(hammer_folder, with_cell(hammer_rows(), "recording", path))
    refused(hammer_folder, "runs.csv", "row 2", "'recording'", repr(path), "inside the campaign folder")


def test_link_inside_the_folder_is_followed(hammer_folder: Path, sqlite_url: str) -> None:
    (hammer_folder / "recordings").rename(hammer_folder / "disk-2")
    (hammer_folder / "recordings").symlink_to("disk-2")
    ingested(sqlite_url, hammer_folder)
    assert counts(sqlite_url)["recordings"] == 2


@pytest.mark.parametrize("make", ["mkdir", "loop", "fifo"])
def test_recording_that_is_no_file(hammer_folder: Path, refused: Refused, make: str) -> None:
    import os

    path = hammer_folder / "odd.npz"
    {"mkdir": path.mkdir, "loop": lambda: path.symlink_to("odd.npz"), "fifo": lambda: os.mkfifo(path)}[make]()
    write_runs(hammer_folder, with_cell(hammer_rows(), "recording", "odd.npz"))
    refused(hammer_folder, "runs.csv", "row 2", "'recording'", "'odd.npz'")


def test_recording_of_an_unknown_format(hammer_folder: Path, refused: Refused) -> None:
    (hammer_folder / "notes.docx").write_bytes(b"PK")
    write_runs(hammer_folder, with_cell(hammer_rows(), "recording", "notes.docx"))
    refused(hammer_folder, "runs.csv", "row 2", "'recording'", "notes.docx", ".mat", ".npz")


@pytest.mark.parametrize("suffix", ["mat", "npz", "tdms"])
def test_only_recording_is_truncated(hammer_folder: Path, refused: Refused, suffix: str) -> None:
    name = f"recordings/only.{suffix}"
    _write_tdms(hammer_folder / name) if suffix == "tdms" else shutil.copy(
        hammer_folder / recording_name(2 if suffix == "mat" else 1), hammer_folder / name
    )
    whole = (hammer_folder / name).read_bytes()
    (hammer_folder / name).write_bytes(whole[: len(whole) * 2 // 3])
    write_runs(hammer_folder, with_cell(hammer_rows(1, 1), "recording", name))
    refused(hammer_folder, name, "no usable recording")


def test_zip_bomb(hammer_folder: Path, refused: Refused) -> None:
    """64 KB that unpack to 100 MB of zeros."""
    file = hammer_folder / recording_name(1)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_BZIP2) as archive, archive.open("force.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f4", "fortran_order": False, "shape": (25_000_000,)})
        for _ in range(100):
            member.write(bytes(1_000_000))
    assert file.stat().st_size < 100_000
    write_runs(hammer_folder, hammer_rows(1, 1))
    refused(hammer_folder, recording_name(1), "100000000 bytes")


def test_store_in_a_missing_folder(hammer_folder: Path, tmp_path: Path) -> None:
    from support.stores.stores import ingest

    result = ingest(f"sqlite:///{tmp_path}/nowhere/lab.db", hammer_folder)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "no folder" in result.stderr and "nowhere" in result.stderr
    assert not (tmp_path / "nowhere").exists()


def _write_tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("scope", "force", np.zeros(4096, "f4"), {"wf_increment": 1 / 51200})])
