"""What the recorder writes is what the ingest reads, byte for byte the same each time, and whole or
not there."""

from __future__ import annotations

import errno
import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.folder.tables import read_table
from pyroshock.ingest.readers import open_recording
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.recorder import (
    CampaignCard,
    Seal,
    SealError,
    folder_hash,
    open_seal,
    seal_path,
    write_card,
    write_recording,
    write_runs,
    write_seal,
)
from pyroshock.virtualbench.sensors import SensorBuild

TANK = SensorBuild("tank", "pressure", "bar", 16.0, 1e5, 16, 0.5621, 0.3624)
FORCE = SensorBuild("force", "force", "N", 1e4, position="tip")
CARD = CampaignCard(
    'the "first" one',
    "gun",
    "2026-11-21",
    (TANK, FORCE),
    "Vögel",
    {
        "plate": {
            "material": "steel",
            "thickness_m": 0.01,
            "outline_m": [[0.0, 0.0], [1.0, 0.0], [0.5, 0.7]],
        },
        "hammer": {"mass_kg": 0.32},
    },
)


def channels(n=1000):
    rng = np.random.default_rng(3)
    return {
        "tank": rng.integers(-100, 100, n).astype(np.float32),
        "force": rng.standard_normal(n).astype(np.float32),
    }


def test_card_and_runs_are_read_as_they_were_meant(tmp_path):
    write_card(tmp_path, CARD)
    file = read_campaign_file(tmp_path)
    assert (file.name, file.kind, file.date.isoformat(), file.description) == (
        CARD.name,
        "gun",
        "2026-11-21",
        "Vögel",
    )
    assert file.plate.outline_m == ((0.0, 0.0), (1.0, 0.0), (0.5, 0.7))
    assert file.hammer.mass_kg == 0.32
    assert (file.sensors["tank"].sensitivity, file.sensors["tank"].offset_v) == (0.5621, 0.3624)
    assert (file.sensors["force"].position, file.sensors["force"].range) == ("tip", 1e4)
    rows = [{"run": "1", "note": 'a "b", c'}, {"run": "2", "tip_material": "steel"}]
    write_runs(tmp_path, rows)
    header, lines = read_table(tmp_path / "runs.csv", "runs.csv")
    assert header == ["run", "note", "tip_material"]
    assert [cells for _, cells in lines] == [
        {"run": "1", "note": 'a "b", c', "tip_material": ""},
        {"run": "2", "note": "", "tip_material": "steel"},
    ]


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_recording_reads_back_and_is_the_same_bytes_each_time(tmp_path, suffix, monkeypatch):
    write_recording(tmp_path / f"r{suffix}", channels(), 51_200.0)
    with open_recording(tmp_path / f"r{suffix}") as recording:
        for name, values in channels().items():
            assert recording.info(name).sampling_rate_hz == 51_200.0
            assert recording.read(name).dtype == np.float32
            assert np.array_equal(recording.read(name), values)
    write_recording(tmp_path / f"a{suffix}", channels(), 51_200.0)
    monkeypatch.setattr("time.asctime", lambda *_: "another time")
    write_recording(tmp_path / f"b{suffix}", channels(), 51_200.0)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_unknown_format_is_refused_and_a_failed_write_leaves_nothing(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"'r\.wav': format unknown; expected one of \.npz, \.mat"):
        write_recording(tmp_path / "r.wav", channels(), 1.0)

    def fails(*_):
        raise OSError(errno.ENOSPC, "disk full")

    monkeypatch.setattr("pathlib.Path.replace", fails)
    with pytest.raises(OSError, match=r"disk full.*r\.npz"):
        write_recording(tmp_path / "r.npz", channels(), 1.0)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "campaign"
    path.mkdir()
    write_card(path, CARD)
    write_recording(path / "recordings" / "1.npz", channels(), 1000.0)
    return path


def seal_of(folder):
    return Seal(
        "gun", 7, Effects.only("gun.blow_by", 3.0).as_json(), [{"run": 1}], folder_hash(folder)
    )


def test_seal_comes_back_and_knows_its_folder_until_a_byte_changes(folder):
    path = write_seal(folder, seal_of(folder))
    assert path == seal_path(folder) == folder.with_name("campaign.sealed.json")
    seal = open_seal(path)
    assert seal == seal_of(folder)
    assert Effects.from_json(seal.effects)["gun.blow_by"] == 3.0
    assert seal.belongs_to(folder)
    (folder / "recordings" / "1.npz").write_bytes(b"x")
    assert not seal.belongs_to(folder)


def test_folder_hash_depends_on_names_and_contents_only(folder, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    write_recording(copy / "recordings" / "1.npz", channels(), 1000.0)
    write_card(copy, CARD)
    assert folder_hash(copy) == folder_hash(folder)
    (copy / "campaign.toml").rename(copy / "other.toml")
    assert folder_hash(copy) != folder_hash(folder)
    # one file, its name and content as published for SHA-256 of nothing
    lone = tmp_path / "lone"
    lone.mkdir()
    (lone / "empty").touch()
    nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    assert folder_hash(lone) == hashlib.sha256(f"empty\0{nothing}\n".encode()).hexdigest()


def test_seal_inside_the_folder_is_refused_and_never_overwritten(folder, tmp_path):
    for inside in ("labels.json", "recordings/labels.json", "../campaign/labels.json"):
        with pytest.raises(SealError, match="expected a place outside of the campaign folder"):
            write_seal(folder, seal_of(folder), folder / inside)
        assert not list(folder.rglob("labels.json"))
    write_seal(folder, seal_of(folder))
    with pytest.raises(SealError, match="there is one already"):
        write_seal(folder, replace(seal_of(folder), seed=8))
    with pytest.raises(SealError, match="no such folder"):
        folder_hash(tmp_path / "gone")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "not a seal"),
        ("[]", "not a seal"),
        ('{"kind": "gun"}', "not a seal"),
        (None, "version 99; expected 1"),
    ],
)
def test_what_is_no_seal_is_refused(folder, tmp_path, content, message):
    path = tmp_path / "s.json"
    if content is None:
        sealed = json.loads(write_seal(folder, seal_of(folder)).read_text())
        content = json.dumps({**sealed, "version": 99})
    path.write_text(content)
    with pytest.raises(SealError, match=message):
        open_seal(path)
