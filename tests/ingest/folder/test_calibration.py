"""A transducer's calibration from points in campaign.toml to the uncertainty of a stored tank
pressure."""

from __future__ import annotations

import datetime as dt
import math

import numpy as np
import pytest
from pyroshock.ingest.extraction.pressure_drop import pressure_drop
from pyroshock.ingest.folder.calibration_points import read_points
from pyroshock.ingest.storing.stored_channels import list_channels, read_channel
from pyroshock.schema.impacts import Shot
from pyroshock.signals.calibration import fit_line
from pyroshock.virtualbench.campaigns.gun import TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.sensors import analog, digitised
from pyroshock.virtualbench.sensors.filters import gain, offset_si
from sqlalchemy import select
from support.records.campaigns import gun_rows, replace_in, with_cell, write_recording, write_runs
from support.stores.stores import ingest, ingested, opened

BAR = [0.0, 1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]
VOLT = [0.3626, 0.9248, 1.4862, 2.0491, 2.6105, 2.0483, 1.4870, 0.9241]
POINTS = str([list(pair) for pair in zip(BAR, VOLT, strict=True)])
CALIBRATION = f"""
[channels.tank_pressure]
quantity = "pressure"
unit = "bar"

[channels.tank_pressure.calibration]
points = {POINTS}
date = 2026-03-02
common_u = 0.005
"""


def volts() -> np.ndarray:
    """0.25 bar through the thesis's line, with noise, and a tank that empties after 0.4 s."""
    time = np.arange(10_000) / 1e4
    bar = np.where(time < 0.4, 0.25, 0.25 * np.exp(-np.maximum(time - 0.4, 0) / 0.05))
    noise = 1e-4 * np.random.default_rng(3).standard_normal(time.size)
    return (0.3624 + 0.5621 * bar + noise).astype(np.float32)


@pytest.fixture
def calibrated(gun_folder):
    with (gun_folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(CALIBRATION)
    write_recording(gun_folder / "shot.npz", {"tank_pressure": volts()}, 1e4)
    write_runs(gun_folder, with_cell(gun_rows(), "recording", "shot.npz"))
    return gun_folder


def recorded(url: str) -> tuple[float, float]:
    with opened(url) as store, store.reading() as session:
        query = select(Shot.recorded_pressure_pa, Shot.recorded_pressure_u_pa)
        pressure_pa, uncertainty_pa = session.execute(
            query.where(Shot.recorded_pressure_pa.is_not(None))
        ).one()
        return pressure_pa, uncertainty_pa


def test_measured_pressure_has_the_calibration_s_uncertainty(sqlite_url, calibrated):
    ingested(sqlite_url, calibrated)
    slope, offset = np.polyfit(BAR, VOLT, 1)
    (variance, both), (_, constant) = np.polyfit(BAR, VOLT, 1, cov=True)[1]
    reading = pressure_drop((volts().astype(float) - offset) / slope * 1e5, 1e4)
    bar = reading.pressure_pa / 1e5
    of_line = math.sqrt(constant + bar**2 * variance + 2 * bar * both) / slope
    u_pa = math.sqrt(reading.pressure_u_pa**2 + (1e5 * of_line) ** 2 + 500.0**2)
    assert recorded(sqlite_url) == pytest.approx((reading.pressure_pa, u_pa), rel=1e-6)
    assert u_pa > 2 * reading.pressure_u_pa


def test_calibration_is_kept_with_the_channel(sqlite_url, calibrated):
    ingested(sqlite_url, calibrated)
    with opened(sqlite_url) as store, store.reading() as session:
        (row,) = list_channels(session, 1)
        channel = read_channel(session, row)
    calibration = channel.sensor.calibration
    assert calibration is not None
    assert (calibration.date, calibration.points, calibration.common_u) == (
        dt.date(2026, 3, 2),
        8,
        0.005,
    )
    assert (row.sensitivity, row.offset_v) == pytest.approx(
        tuple(np.polyfit(BAR, VOLT, 1)), rel=1e-12
    )
    assert calibration.line == fit_line(BAR, VOLT)
    assert "pyroshock_calibration" not in channel.header


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("2026-03-02\ncommon", "2026-06-02\ncommon"),
        ("common_u = 0.005", "common_u = 0.02"),
        ("2.6105", "2.6305"),
    ],
)
def test_another_calibration_of_a_stored_campaign_is_told(sqlite_url, calibrated, old, new):
    ingested(sqlite_url, calibrated)
    replace_in(calibrated / "campaign.toml", old, new)
    again = ingest(sqlite_url, calibrated)
    assert again.exit_code == 2
    assert "channels.tank_pressure.calibration is 8 points of 2026-0" in again.stderr
    assert "8 points of 2026-03-02 (sensitivity 0.562025" in again.stderr


def test_points_may_stand_in_a_file(sqlite_url, calibrated):
    rows = "\n".join(f"{bar};{volt}" for bar, volt in zip(BAR, VOLT, strict=True))
    (calibrated / "points.csv").write_text(f"reference;reading_v\n{rows}\n", encoding="utf-8")
    replace_in(calibrated / "campaign.toml", f"points = {POINTS}", 'file = "points.csv"')
    ingested(sqlite_url, calibrated)
    assert recorded(sqlite_url)[0] == pytest.approx(0.25e5, rel=2e-3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            POINTS,
            "[[0, 0.36], [1, 0.92]]",
            "2 references and 2 readings; expected as many of both, 3 or more",
        ),
        (POINTS, "[[0, 0.36], [1]]", "expected [[reference, volt], ...]"),
        (
            POINTS,
            "[[0, 1], [1, 2], [2, 0.9], [3, 1.8]]",
            "the readings do not follow the references",
        ),
        (
            "2026-03-02\ncommon",
            "20260332\ncommon",
            "calibration.date is 20260332; expected the day",
        ),
        (
            "common_u = 0.005",
            "common_u = -1",
            "common_u is -1; expected a standard uncertainty of 0 or more",
        ),
        (
            "common_u = 0.005",
            "common = 1",
            "unknown key 'channels.tank_pressure.calibration.common'",
        ),
        (
            'unit = "bar"',
            'unit = "bar"\nsensitivity = 0.5',
            "gives sensitivity, which stands beside it",
        ),
        (
            "points = ",
            'file = "none.csv"\npoints = ',
            "needs points = [[reference, volt], ...] or file, one of them",
        ),
    ],
)
def test_what_is_no_calibration_is_refused(calibrated, refused, old, new, words):
    replace_in(calibrated / "campaign.toml", old, new)
    refused(calibrated, "campaign.toml", "channels.tank_pressure.calibration", words)


def test_table_of_points_names_what_it_cannot_read(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("reference,reading_v\n0,0.36\n1,x\n", encoding="utf-8")
    with pytest.raises(
        ValueError, match=r"points\.csv: row 3, column 'reading_v': 'x'; expected a number"
    ):
        read_points(path)
    path.write_text("reference,volt\n0,0.36\n", encoding="utf-8")
    with pytest.raises(ValueError, match="no column 'reading_v'"):
        read_points(path)


@pytest.mark.parametrize("seed", range(3))
def test_the_virtual_bench_s_transducer_is_found_through_its_whole_chain(seed):
    """Three load-unload cycles of 0 to 4 bar (thesis, section 2.2.1) against its true gain and
    offset."""
    effects, rng = (
        Effects.default().with_strength("sensor.pressure_gain", 4.0),
        np.random.default_rng(seed),
    )
    time, volt = np.arange(8000) / 4e5, []
    for bar in BAR * 3:
        signal = analog(time, np.full(time.size, bar * 1e5), TANK, 1e5, effects)
        volt.append(float(digitised(signal, TANK, 1e5, effects, rng, day_fraction=0.0).mean()))
    line = fit_line(BAR * 3, volt)
    true_gain, true_offset_bar = gain(TANK, effects, 0.0), offset_si(TANK, effects, 0.0) / 1e5
    assert abs(true_gain - 1) > 0.01
    # The converter's step of 0.3 mV is no noise that averages out: a fifth of it is allowed beside
    # 3 u.
    assert line.sensitivity == pytest.approx(
        0.5621 * true_gain, abs=3 * line.sensitivity_u + 6e-5 / 4
    )
    assert line.offset == pytest.approx(
        0.3624 + 0.5621 * true_offset_bar, abs=3 * line.offset_u + 6e-5
    )
