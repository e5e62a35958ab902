"""Campaigns that must be refused: one line that names the trouble, exit code 2, nothing stored."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.records.campaigns import (
    gun_rows,
    hammer_rows,
    recording_name,
    replace_in,
    with_cell,
    write_runs,
)
from support.stores.stores import counts, ingest, ingested

Refused = Callable[..., str]
Change = Callable[[Path], object]


def test_folder_that_is_none(tmp_path: Path, refused: Refused) -> None:
    refused(tmp_path / "nowhere", "nowhere", "no such folder")
    (tmp_path / "campaign.csv").write_text("run\n")
    refused(tmp_path / "campaign.csv", "campaign.csv", "expected a campaign folder")
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", "campaign.toml")


def _without(name: str) -> Change:
    return lambda folder: (folder / name).unlink()


def _in_place(name: str) -> Change:
    """A folder of the file's name."""
    return lambda folder: ((folder / name).unlink(), (folder / name).mkdir())


def _in_latin_1(name: str) -> Change:
    return lambda folder: (folder / name).write_bytes(
        (folder / name).read_bytes() + "# Prüfstand".encode("latin-1")
    )


def _row(column: str, value: object, row: int = 0) -> Change:
    return lambda folder: write_runs(folder, with_cell(hammer_rows(), column, value, row=row))


def _toml(old: str, new: str) -> Change:
    return lambda folder: replace_in(folder / "campaign.toml", old, new)


_PLATE = '[bench.plate]\nmaterial = "unobtainium"\nthickness_m = 0.01\n[channels.force]'
#: What is done to a good folder of a hammer, and words of the refusal.
CHANGES: dict[str, tuple[Change, tuple[str, ...]]] = {
    **{f"no {n}": (_without(n), (n,)) for n in ("campaign.toml", "runs.csv")},
    **{f"folder {n}": (_in_place(n), (n, "cannot be read")) for n in ("campaign.toml", "runs.csv")},
    **{f"latin-1 {n}": (_in_latin_1(n), (n, "not UTF-8")) for n in ("campaign.toml", "runs.csv")},
    "missing recording": (
        _without(recording_name(2)),
        ("runs.csv", "row 4", "'recording'", recording_name(2)),
    ),
    "unit": (
        _toml('unit = "N"', 'unit = "kg"'),
        ("campaign.toml", "channels.force", "'kg'", "force", "'N'"),
    ),
    "material": (
        _row("tip_material", "unobtainium", row=2),
        ("runs.csv", "row 4", "'tip_material'", "'unobtainium'", "material"),
    ),
    "plate": (
        _toml("[channels.force]", _PLATE),
        ("campaign.toml", "bench.plate.material", "'unobtainium'"),
    ),
    "mass": (
        _toml("= 0.32", "= -0.32"),
        ("campaign.toml", "bench.hammer.mass_kg", "-0.32", "above zero"),
    ),
    "duplicate run": (
        _row("repetition", 1, row=1),
        ("runs.csv", "row 3", "duplicate run 1, repetition 1", "row 2"),
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_folder_with_one_fault(hammer_folder: Path, refused: Refused, name: str) -> None:
    change, words = CHANGES[name]
    change(hammer_folder)
    refused(hammer_folder, *words)


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        *(
            ("measured_velocity_m_s", velocity, "a number of zero or more")
            for velocity in ("NaN", "nan", "inf", "-1", "fast", "1e999", "12.3.4", "0x1p3", "1_0")
        ),
        ("bullet_mass_kg", "-0.14", "above zero"),
    ],
)
def test_cell_of_a_gun_that_is_no_such_number(
    gun_folder: Path, refused: Refused, column, value, expected
) -> None:
    write_runs(gun_folder, with_cell(gun_rows(), column, value, row=1))
    refused(gun_folder, "runs.csv", "row 3", f"'{column}'", repr(value), expected)


@pytest.mark.parametrize(
    "path",
    ["../outside.npz", "recordings/../../outside.npz", "{outside}", "link.npz", "away/outside.npz"],
)
def test_recording_that_leaves_the_folder(hammer_folder: Path, refused: Refused, path: str) -> None:
    outside = hammer_folder.parent / "outside.npz"
    shutil.copy(hammer_folder / recording_name(1), outside)
    (hammer_folder / "link.npz").symlink_to(outside)
    (hammer_folder / "away").symlink_to(outside.parent)
    path = path.format(outside=outside)
    write_runs(hammer_folder, with_cell(hammer_rows(), "recording", path))
    refused(
        hammer_folder, "runs.csv", "row 2", "'recording'", repr(path), "inside the campaign folder"
    )


def test_link_inside_the_folder_is_followed(hammer_folder: Path, sqlite_url: str) -> None:
    (hammer_folder / "recordings").rename(hammer_folder / "disk-2")
    (hammer_folder / "recordings").symlink_to("disk-2")
    ingested(sqlite_url, hammer_folder)
    assert counts(sqlite_url)["recordings"] == 2


def test_recording_that_is_no_file_or_of_no_known_format(
    hammer_folder: Path, refused: Refused
) -> None:
    (hammer_folder / "folder.npz").mkdir()
    (hammer_folder / "loop.npz").symlink_to("loop.npz")
    os.mkfifo(hammer_folder / "fifo.npz")
    (hammer_folder / "notes.docx").write_bytes(b"PK")
    for name, words in (
        ("folder.npz", ()),
        ("loop.npz", ()),
        ("fifo.npz", ()),
        ("notes.docx", (".mat", ".npz")),
    ):
        write_runs(hammer_folder, with_cell(hammer_rows(), "recording", name))
        refused(hammer_folder, "runs.csv", "row 2", "'recording'", name, *words)


@pytest.mark.parametrize("suffix", ["mat", "npz", "tdms"])
def test_only_recording_is_truncated(hammer_folder: Path, refused: Refused, suffix: str) -> None:
    from nptdms import ChannelObject, TdmsWriter

    path = hammer_folder / f"recordings/only.{suffix}"
    if suffix == "tdms":
        with TdmsWriter(path) as writer:
            writer.write_segment(
                [ChannelObject("scope", "force", np.zeros(4096, "f4"), {"wf_increment": 1 / 51200})]
            )
    else:
        shutil.copy(hammer_folder / recording_name(2 if suffix == "mat" else 1), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    write_runs(hammer_folder, with_cell(hammer_rows(1, 1), "recording", f"recordings/{path.name}"))
    refused(hammer_folder, f"recordings/{path.name}", "no usable recording")


def test_zip_bomb(hammer_folder: Path, refused: Refused) -> None:
    """64 KB that unpack to 100 MB of zeros."""
    file = hammer_folder / recording_name(1)
    with (
        zipfile.ZipFile(file, "w", zipfile.ZIP_BZIP2) as archive,
        archive.open("force.npy", "w") as member,
    ):
        np.lib.format.write_array_header_1_0(
            member, {"descr": "<f4", "fortran_order": False, "shape": (25_000_000,)}
        )
        for _ in range(100):
            member.write(bytes(1_000_000))
    assert file.stat().st_size < 100_000
    write_runs(hammer_folder, hammer_rows(1, 1))
    refused(hammer_folder, recording_name(1), "100000000 bytes")


def test_store_in_a_missing_folder(hammer_folder: Path, tmp_path: Path) -> None:
    result = ingest(f"sqlite:///{tmp_path}/nowhere/lab.db", hammer_folder)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "no folder" in result.stderr and "nowhere" in result.stderr
    assert not (tmp_path / "nowhere").exists()
