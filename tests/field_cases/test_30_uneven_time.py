"""Field case 30: uneven time in records and campaigns is refused by its kind, or resampled with its
error bounded."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from sqlalchemy import select

SAMPLES = 4000
LINES = np.array([500.0, 1000.0, 2000.0, 2500.0])


def times(kind):
    rng = np.random.default_rng(30)
    n = np.arange(SAMPLES)
    match kind:
        case "two rates":
            steps = np.where(n < 1200, 1 / 40_000, 1 / 58_000)
        case "jitter":
            steps = 2e-5 * (1 + rng.uniform(-0.4, 0.4, SAMPLES))
        case _:
            steps = 2e-5 * np.linspace(0.8, 1.2, SAMPLES)
    return np.cumsum(steps) - steps[0]


def acceleration(time_s):
    since = np.maximum(time_s - 0.02, 0.0)
    rise = 1 - np.exp(-((since / 2e-4) ** 2))
    tones = ((1500, 3000.0, 200), (2300, 2500.0, 350))
    return sum(rise * a * np.exp(-since * d) * np.sin(2 * np.pi * f * since) for f, a, d in tones)


def write(path, kind, digits=9):
    rows = [
        f"{t:.{digits}f},{a:.6f}\n"
        for t, a in zip(times(kind), acceleration(times(kind)), strict=True)
    ]
    path.write_text("time_s,acceleration_1 [m/s2]\n" + "".join(rows), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("two rates", "two rates, 40000 Hz"),
        ("jitter", "its time has jitter"),
        ("drift", "its time drifts"),
    ],
)
def test_record_is_refused_by_its_kind_or_resampled(tmp_path, kind, message):
    """The right spectrum is that of the same formula at 800 kHz; 23 samples of a cycle hide 1 % of
    a peak."""
    path = write(tmp_path / "hit.csv", kind)
    refused = CliRunner().invoke(main, ["srs", str(path)])
    assert refused.exit_code == 2 and message in refused.stderr
    words = [
        "srs",
        str(path),
        "--frequencies",
        "500,1000,2000,2500",
        "--uneven-time",
        "resample",
        "--json",
    ]
    result = json.loads(CliRunner().invoke(main, words).stdout)
    fine = acceleration(np.arange(0.0, times(kind)[-1], 1 / 800_000))
    right = shock_response_spectrum(fine, 800_000.0, LINES).maximax
    assert result["maximax"] == pytest.approx(
        right / (9.80665 if result["unit"] == "g" else 1.0), rel=0.02
    )
    assert next(c["severity"] for c in result["checks"] if c["check"] == "resampled-time") in (
        "note",
        "warning",
    )


def force(time_s):
    phase = (time_s - 0.02) / 0.6e-3
    return np.where(
        (phase > 0) & (phase < 1), 1000 * np.sin(np.pi * np.clip(phase, 0, 1)) ** 2, 0.0
    )


@pytest.mark.parametrize("uneven_time", [None, "resample"])
def test_recording_of_a_campaign_is_set_aside_or_resampled(sqlite_url, tmp_path, uneven_time):
    """A force of sin^2 over 0.6 ms: an impulse of 0.3 N s."""
    option = f'[recordings]\nuneven_time = "{uneven_time}"\n' if uneven_time else ""
    (tmp_path / "campaign.toml").write_text(
        f'[campaign]\nname = "uneven"\nkind = "hammer"\ndate = '
        f'"2026-03-02"\n[bench.hammer]\nmass_kg = 0.32\n{option}'
        '[channels.force]\nquantity = "force"\nunit = "N"\n'
    )
    names = {"even": np.arange(SAMPLES) / 51200, "uneven": times("two rates")}
    columns = "run,repetition,tip_material,tip_radius_mm,plate_material,anvil_material,insulator"
    rows = [f"{columns},hammer_speed,boundary_conditions,impact_velocity_m_s,recording"]
    noise = np.random.default_rng(1).normal(size=SAMPLES) * 0.05
    for run, (name, time_s) in enumerate(names.items(), 1):
        lines = [f"{t:.9f},{f:.6f}\n" for t, f in zip(time_s, force(time_s) + noise, strict=True)]
        (tmp_path / f"{name}.csv").write_text("time_s,force [N]\n" + "".join(lines))
        rows.append(f"{run},1,steel,30,aluminum,none,none,low,free,1.0,{name}.csv")
    (tmp_path / "runs.csv").write_text("\n".join(rows) + "\n")
    with open_store(sqlite_url, Writer("test", "0"), create=True) as store:
        report = ingest_folder(store, tmp_path, jobs=1)
        with store.reading() as session:
            pulses = list(session.scalars(select(Pulse)))
            reasons = [row.reason for row in session.scalars(select(Recording)) if row.reason]
            checks = [finding.check for finding in session.scalars(select(QualityFinding))]
    assert report.impacts == (2 if uneven_time else 1)
    assert all(pulse.impulse_n_s == pytest.approx(0.3, rel=0.02) for pulse in pulses)
    if uneven_time:
        assert reasons == [] and checks.count("resampled-time") == 1
    else:
        assert "its time has two rates, 40000 Hz" in reasons[0] and "uneven_time" in reasons[0]
