"""`calibrate`: a table of points to what campaign.toml takes."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner
from pyroshock.app.cli.main import main

BAR = [0.0, 1.0, 2.0, 3.0, 4.0]
VOLT = [0.3626, 0.9248, 1.4862, 2.0491, 2.6105]


@pytest.fixture
def points(tmp_path):
    path = tmp_path / "transducer.csv"
    rows = [f"{bar},{volt}" for bar, volt in zip(BAR, VOLT, strict=True)]
    path.write_text("\n".join(["reference,reading_v", *rows, ""]), encoding="utf-8")
    return path


def test_json_has_the_line_and_its_uncertainty_and_text_a_table_for_campaign_toml(points):
    words = ["calibrate", str(points), "--date", "2026-03-02", "--common-u", "5mbar", "--json"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    (slope, offset), covariance = np.polyfit(BAR, VOLT, 1, cov=True)
    assert (data["sensitivity_v_per_unit"], data["offset_v"]) == pytest.approx((slope, offset))
    assert data["sensitivity_u_v_per_unit"] ** 2 == pytest.approx(covariance[0, 0])
    assert data["common_u"] == pytest.approx(0.005)
    assert data["points"][2]["residual"] == pytest.approx((1.4862 - offset) / slope - 2.0)
    words = ["calibrate", str(points), "--date", "2026-03-02", "--common-u", "5mbar", "--reading-u", "1mV"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    table = tomllib.loads(result.stdout[result.stdout.index("[channels") :])
    calibration = table["channels"]["tank_pressure"]["calibration"]
    assert calibration["file"] == "transducer.csv"
    assert (calibration["common_u"], calibration["reading_u_v"]) == (0.005, 0.001)
    assert str(calibration["date"]) == "2026-03-02"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--unit", "kg"], "kg"),
        (["--common-u", "5"], "--common-u is '5'; expected a number with a unit"),
        (["--date", "March"], "--date is 'March'; expected a day such as 2026-03-02"),
    ],
)
def test_what_cannot_be_is_one_line(points, words, message):
    result = CliRunner().invoke(main, ["calibrate", str(points), *words])
    assert result.exit_code == 2 and message in result.stderr
