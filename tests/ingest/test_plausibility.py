"""What the rows say of mass, velocity and tip is held against the pulses, and recordings against each other."""

from __future__ import annotations

import json

import numpy as np
import pytest
from support.records.campaigns import (
    Blow,
    force_record,
    hammer_campaign,
    hammer_rows,
    recording_name,
    write_recording,
    write_runs,
)
from support.stores.stores import pyroshock

#: Head of the campaigns' hammer, and a hit of 1000 N: its impulse is the sum of its samples.
MASS_KG, STEEL_DENSITY = 0.32, 7800.0
BLOW = Blow(0.05, 1000.0, 0.8e-3)


def findings(folder, url):
    result = pyroshock("ingest", folder, "--db", url, "--jobs", "1", "--json")
    assert result.exit_code == 0, result.stderr
    return [f for f in json.loads(result.stdout)["findings"] if f["severity"] != "note"]


def campaign(path, **cells):
    """One hit; also its impulse in N s."""
    folder = hammer_campaign(path, 1)
    write_runs(folder, [{**hammer_rows(1, 1)[0], **cells}])
    force = force_record((BLOW,), np.random.default_rng(3))
    write_recording(folder / recording_name(1), {"force": force})
    return folder, float(force_record((BLOW,), np.random.default_rng(3)).sum() / 51200.0)


@pytest.mark.parametrize(
    ("ratio", "severity"),
    [
        (0.2, "reject"),
        (0.4, "warning"),
        (0.7, None),
        (1.0, None),
        (1.5, None),
        (2.0, None),
        (4.0, "warning"),
        (8, "reject"),
    ],
)
def test_impulse_is_held_against_mass_and_velocity(sqlite_url, tmp_path, ratio, severity):
    _, impulse_n_s = campaign(tmp_path / "a")
    folder, _ = campaign(tmp_path / "b", impact_velocity_m_s=impulse_n_s / MASS_KG / ratio)
    found = findings(folder, sqlite_url)
    assert [(f["check"], f["severity"]) for f in found] == (
        [] if severity is None else [("implausible-impulse", severity)]
    )
    assert all(f["channel"] == "force" and "0.32 kg" in f["message"] for f in found)


@pytest.mark.parametrize(("radius_mm", "doubted"), [(0.0125, True), (12.5, False)])
def test_needle_for_a_tip_is_doubted(sqlite_url, tmp_path, radius_mm, doubted):
    folder, _ = campaign(tmp_path / "a", tip_radius_mm=radius_mm)
    assert [f["check"] for f in findings(folder, sqlite_url)] == ["implausible-tip"] * doubted


def test_one_recording_under_two_runs_is_doubted(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", 2)
    same = force_record((BLOW,), np.random.default_rng(3))
    write_runs(folder, [{**hammer_rows(2, 1)[i], "recording": f"recordings/{name}.npz"} for i, name in enumerate("ab")])
    for name in "ab":
        np.savez(folder / "recordings" / f"{name}.npz", force=same, fs=51200.0)
    (found,) = findings(folder, sqlite_url)
    assert (found["check"], found["recording"]) == ("same-recording", "recordings/b.npz")
    assert "recordings/a.npz" in found["message"]


@pytest.mark.parametrize(("ratio", "doubted"), [(0.3, False), (0.2, True)])
def test_light_plate_takes_its_share_of_the_lower_limit(sqlite_url, tmp_path, ratio, doubted):
    """A plate as heavy as the hammer's head, which flies off with half of the momentum: half of the limit, 0.25."""
    _, impulse_n_s = campaign(tmp_path / "a")
    folder, _ = campaign(tmp_path / "b", impact_velocity_m_s=impulse_n_s / MASS_KG / ratio)
    card = folder / "campaign.toml"
    side_m = 0.1
    thickness_m = MASS_KG / (side_m**2 * STEEL_DENSITY)
    outline = f"[[0, 0], [{side_m}, 0], [{side_m}, {side_m}], [0, {side_m}]]"
    plate = f'[bench.plate]\nmaterial = "steel"\nthickness_m = {thickness_m}\noutline_m = {outline}\n'
    card.write_text(card.read_text().replace("[channels", plate + "\n[channels", 1))
    told = findings(folder, sqlite_url)
    assert [f["check"] for f in told] == ["implausible-impulse"] * doubted
    assert all("0.5 to 2 are possible" in f["message"] for f in told)


def signed_campaign(path, signs):
    """A recording of one hit for each sign."""
    folder = hammer_campaign(path, len(signs))
    write_runs(folder, hammer_rows(len(signs), 1))
    for number, sign in enumerate(signs, 1):
        force = force_record((BLOW,), np.random.default_rng(number))
        write_recording(folder / recording_name(number), {"force": sign * force})
    return folder


@pytest.mark.parametrize(
    ("signs", "doubted", "word"),
    [
        ((1, 1, 1), (), ""),
        ((-1, -1), (), ""),
        ((1, -1, 1), (2,), "negative"),
        ((-1, 1, -1), (2,), "positive"),
        ((1, -1), (2,), "negative"),
    ],
)
def test_force_of_another_sign_than_the_others_is_doubted(sqlite_url, tmp_path, signs, doubted, word):
    told = findings(signed_campaign(tmp_path / "c", signs), sqlite_url)
    assert [(f["check"], f["recording"]) for f in told] == [("force-sign", recording_name(n)) for n in doubted]
    assert all(f["channel"] == "force" and f"the force is {word} here" in f["message"] for f in told)


def test_doubt_of_a_sign_follows_the_campaign_as_it_grows(sqlite_url, tmp_path):
    """One negative beside one positive is doubted; with two more negative ones, the positive one is."""
    folder = signed_campaign(tmp_path / "c", (1, -1, -1, -1))
    rows = hammer_rows(4, 1)
    write_runs(folder, rows[:2])
    assert [f["recording"] for f in findings(folder, sqlite_url)] == [recording_name(2)]
    write_runs(folder, rows)
    assert [f["recording"] for f in findings(folder, sqlite_url)] == [recording_name(1)]
