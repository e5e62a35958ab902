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
MASS_KG = 0.32
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
        (8.0, "reject"),
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
