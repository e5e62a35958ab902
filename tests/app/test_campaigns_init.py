"""A campaign folder that `campaigns init` begins can be ingested once the marked places are filled
in."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest
from pyroshock.ingest.folder.new_folder import FILL_IN
from pyroshock.schema.recordings import RecordedChannel
from sqlalchemy import select
from support.records.campaigns import FS_HZ, blows, force_record, write_recording
from support.records.recipes import RECIPES, Truth
from support.stores.stores import ingest, ingested, opened, pyroshock, refusal, run_pyroshock

#: What a person writes, by the key that it stands for.
FILLED = {
    "date": '"2026-11-01"', "mass_kg": "0.32", "tank_volume_m3": "0.0095",
    "bore_diameter_m": "0.049",
    "projectile_diameter_m": "0.048", "travel_m": "0.9", "friction_coefficient": "1.4",
    "heat_capacity_ratio": "1.4",
    "efficiency": "0.5", "sampling_rate_hz": f"{FS_HZ}",
}  # fmt: skip
#: Formats whose files have no names for their channels -> the names that these get.
BARE = {
    "text-bare": ("column_1", "column_2", "column_3"),
    "npy": ("data_1", "data_2", "data_3"),
    "wav": ("ch1", "ch2", "ch3"),
}


def started(folder, *arguments):
    return run_pyroshock("campaigns", "init", folder, *arguments)


def fill_in(folder, **more):
    """Replace the marked places of campaign.toml by their keys; `more` by channel: its unit."""
    channel, lines = "", []
    for line in (folder / "campaign.toml").read_text(encoding="utf-8").splitlines():
        if heading := re.match(r'\[channels\."(.*)"\]', line):
            channel = heading[1]
        if (found := re.match(rf'(\w+) = "{FILL_IN}"', line)) and not line.startswith("#"):
            value = FILLED.get(found[1]) or f'"{more[channel]}"'
            line = f"{found[1]} = {value}"
        lines.append(line)
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def replace_where(folder, old, new):
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    (folder / "campaign.toml").write_text(text.replace(old, new), encoding="utf-8")


def rows_of(folder):
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(folder, rows):
    with (folder / "runs.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def record(number=1):
    return force_record(blows(number, 1), np.random.default_rng(number))


def truth(number=1):
    force = record(number).astype(np.float64)
    counts = np.round(force).astype(np.int16)
    channels = {"force": force.astype(np.float32), "acceleration_1": force * 0.5, "counts": counts}
    return Truth(channels, {"force": "N", "acceleration_1": "m/s2", "counts": "V"})


def stored_channels(url):
    with opened(url) as store, store.reading() as session:
        columns = (RecordedChannel.name, RecordedChannel.quantity, RecordedChannel.unit)
        return set(session.execute(select(*columns, RecordedChannel.sampling_rate_hz)).all())


@pytest.mark.parametrize("recipe", sorted(RECIPES.keys() - BARE))
def test_recordings_of_each_format(sqlite_url, tmp_path, recipe):
    folder = tmp_path / "spring"
    folder.mkdir()
    suffix, write = RECIPES[recipe]
    written = write(folder / f"one{suffix}", truth())
    started(folder, "--kind", "hammer")
    fill_in(folder, force="N", acceleration_1="m/s2", counts="V")
    replace_where(folder, 'quantity = "V"', 'quantity = "voltage"')
    ingested(sqlite_url, folder)
    assert stored_channels(sqlite_url) == {
        ("force", "force", "N", written.rate_hz),
        ("acceleration_1", "acceleration", "m/s2", written.rate_hz),
        ("counts", "voltage", "V", written.rate_hz),
    }


@pytest.mark.parametrize(("recipe", "names"), BARE.items())
def test_recordings_that_say_less(sqlite_url, tmp_path, recipe, names):
    """Without names, and but for WAV without a rate, which is asked for under [recordings]."""
    folder = tmp_path / "spring"
    folder.mkdir()
    suffix, write = RECIPES[recipe]
    written = write(folder / f"one{suffix}", truth())
    started(folder, "--kind", "hammer")
    fill_in(folder, **dict(zip(names, ("N", "m/s2", "V"), strict=True)))
    for name, quantity in zip(names, ("force", "acceleration", "voltage"), strict=True):
        text = (folder / "campaign.toml").read_text(encoding="utf-8")
        before, heading, after = text.partition(f'[channels."{name}"]')
        after = re.sub(r'quantity = "[^"]*"', f'quantity = "{quantity}"', after, count=1)
        (folder / "campaign.toml").write_text(before + heading + after, encoding="utf-8")
    assert (recipe == "wav") == (
        "[recordings]" not in (folder / "campaign.toml").read_text(encoding="utf-8")
    )
    ingested(sqlite_url, folder)
    assert {(name, rate) for name, _, _, rate in stored_channels(sqlite_url)} == {
        (name, written.rate_hz) for name in names
    }


def gun_plan(url):
    pyroshock("init", "--db", url)
    numbers = ("--runs", "3", "--repetitions", "2", "--seed", "1")
    command = ("plan", "lhs", "shots", "--kind", "gun", *numbers, "--db", url, "--json")
    return json.loads(run_pyroshock(*command).stdout)["runs"]


@pytest.mark.parametrize("kind", ["gun", "hammer", "drop"])
def test_each_kind_from_recordings(sqlite_url, tmp_path, kind):
    folder = tmp_path / kind
    for number in (1, 2):
        write_recording(
            folder / "recordings" / f"{number}.npz",
            {"force": record(number), "acc": record(number)},
        )
    assert "--dry-run" in started(folder, "--kind", kind, "--recordings", "recordings").stderr
    rows = rows_of(folder)
    rows_read = [(row["run"], row["repetition"], row["recording"]) for row in rows]
    assert rows_read == [(number, "1", f"recordings/{number}.npz") for number in "12"]
    assert ingest(sqlite_url, folder).exit_code == 2
    fill_in(folder, force="N", acc="g")
    replace_where(folder, 'quantity = "g"', 'quantity = "acceleration"')
    if kind == "gun":
        assert ingest(sqlite_url, folder).exit_code == 2
        write_rows(
            folder, [{**row, "bullet_mass_kg": "0.14", "tank_pressure_bar": "2"} for row in rows]
        )
    ingested(sqlite_url, folder)
    assert stored_channels(sqlite_url) == {
        ("force", "force", "N", FS_HZ),
        ("acc", "acceleration", "g", FS_HZ),
    }
    (campaign,) = json.loads(pyroshock("campaigns", "--db", sqlite_url, "--json").stdout)
    assert (campaign["name"], campaign["kind"]) == (kind, "gun" if kind == "gun" else "hammer")


def test_drop_has_no_hammer_and_a_damaged_recording_is_left_out(tmp_path):
    write_recording(tmp_path / "1.npz", {"acceleration_1": record()})
    started(tmp_path, "--kind", "drop")
    text = (tmp_path / "campaign.toml").read_text(encoding="utf-8")
    assert "\n[bench.hammer]" not in text and "accelerometers alone" in text
    folder = tmp_path / "c"
    write_recording(folder / "1.npz", {"force": record()})
    (folder / "2.npz").write_bytes(b"nothing")
    assert "2.npz is left out" in started(folder, "--kind", "hammer").stderr
    assert [row["recording"] for row in rows_of(folder)] == ["1.npz"]


def test_rows_of_a_plan(sqlite_url, tmp_path):
    planned, folder = gun_plan(sqlite_url), tmp_path / "shots"
    started(folder, "--kind", "gun", "--plan", "shots", "--db", sqlite_url)
    rows = rows_of(folder)
    assert [(row["run"], row["repetition"]) for row in rows] == [
        (str(run["run"]), repetition) for run in planned for repetition in ("1", "2")
    ]
    assert [float(row["bullet_mass_kg"]) for row in rows[::2]] == [
        run["bullet_mass_kg"] for run in planned
    ]
    assert {row["recording"] for row in rows} == {FILL_IN}
    fill_in(folder, force="N")
    assert f"'{FILL_IN}'" in ingest(sqlite_url, folder).stderr
    write_rows(folder, [{**row, "recording": "", "measured_velocity_m_s": "9"} for row in rows])
    notes = ingested(sqlite_url, folder).stderr
    assert "6 shots" in notes and "6 repetitions linked, 3 runs done" in notes


@pytest.mark.parametrize(("recordings", "named"), [(3, "112233"), (6, "123456")])
def test_plan_with_recordings(sqlite_url, tmp_path, recordings, named):
    gun_plan(sqlite_url)
    folder = tmp_path / "shots"
    for number in range(1, recordings + 1):
        write_recording(folder / f"{number}.npz", {"force": record(number)})
    started(folder, "--kind", "gun", "--plan", "shots", "--recordings", "*.npz", "--db", sqlite_url)
    assert "".join(row["recording"][0] for row in rows_of(folder)) == named


def test_plan_of_another_kind_or_number_of_recordings_is_refused(sqlite_url, tmp_path):
    gun_plan(sqlite_url)
    folder = tmp_path / "shots"
    write_recording(folder / "1.npz", {"force": record()})
    for arguments, message in (
        (
            ("--kind", "gun", "--recordings", "."),
            "1 recordings for a plan of 3 runs and 6 repetitions",
        ),
        (("--kind", "drop"), "'shots' is one of a gun"),
    ):
        result = pyroshock(
            "campaigns", "init", folder, *arguments, "--plan", "shots", "--db", sqlite_url
        )
        assert (result.exit_code, len(result.stderr.splitlines())) == (
            2,
            1,
        ) and message in result.stderr
        assert not (folder / "campaign.toml").exists()


@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv", "runs.xlsx"])
def test_nothing_is_overwritten(tmp_path, name):
    folder = tmp_path / "c"
    write_recording(folder / "1.npz", {"force": record()})
    (folder / name).write_text("mine", encoding="utf-8")
    assert f"{name} there already" in refusal("campaigns", "init", folder, "--kind", "hammer")
    assert sorted(path.name for path in folder.iterdir()) == sorted(["1.npz", name])
    assert (folder / name).read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("pattern", ["../other", "/etc", "C:\\data"])
def test_recordings_outside_of_the_folder_are_refused(tmp_path, pattern):
    (tmp_path / "c").mkdir()
    result = pyroshock(
        "campaigns", "init", tmp_path / "c", "--kind", "hammer", "--recordings", pattern
    )
    assert result.exit_code == 2 and not (tmp_path / "c" / "campaign.toml").exists()


def test_channels_are_told_as_the_recordings_have_them(tmp_path):
    folder = tmp_path / "c"
    folder.mkdir()
    for number, unit in ((1, "g"), (2, "m/s2")):
        text = f"# fs = {1000 * number}\nacc 'x' [{unit}],ring [zork]\n1,2\n3,4\n"
        (folder / f"{number}.csv").write_text(text, encoding="utf-8")
    write_recording(folder / "3.npz", {"pressure_tank": record()})
    started(folder, "--kind", "drop")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    assert (
        "# in 2 of 3 recordings, at 1000 Hz, 2000 Hz" in text
        and "# the recordings say g, m/s2" in text
    )
    assert "zork, which is no unit that is known" in text
    assert f'quantity = "pressure"  # please check\nunit = "{FILL_IN}"' in text
