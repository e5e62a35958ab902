"""The main job: five measured shots and a real hit, held against the published figures."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from pyroshock.app.cli.main import main


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "results"
    result = CliRunner().invoke(main, ["demo", "--out", str(out), "--json"])
    assert result.exit_code == 0, result.stderr
    return out, json.loads(result.stdout)


def test_predictions_are_the_thesis_to_a_hundredth(demo):
    for row in demo[1]["shots"]:
        assert row["predicted_m_s"] == pytest.approx(row["thesis_m_s"], abs=0.01), row


def test_uncertainties_are_the_printed_ones(demo):
    """To the last printed digit; for test 4 eq. 5.2 gives 0.1854, of which the thesis prints 0.18."""
    for row in demo[1]["shots"]:
        assert row["u_m_s"] == pytest.approx(row["thesis_u_m_s"], abs=0.006 if row["test"] == 4 else 0.005), row


def test_mean_error_is_the_thesis_one(demo):
    assert demo[1]["mean_error_percent"] == pytest.approx(4.07, abs=0.01)


def test_errors_are_the_printed_ones(demo):
    for row in demo[1]["shots"]:
        assert row["error_%"] == pytest.approx(row["thesis_error_%"], abs=0.1), row


def test_hit_is_the_published_one(demo):
    hit = demo[1]["hit"]
    assert hit["peak_force_n"] == pytest.approx(195.6, abs=0.5)
    assert hit["impulse_n_s"] == pytest.approx(0.0247, rel=0.01)


def test_picture_and_store_are_where_it_says(tmp_path):
    out = tmp_path / "results"
    result = CliRunner().invoke(main, ["demo", "--out", str(out)])
    assert result.exit_code == 0, result.stderr
    assert str(out / "demo.png") in result.stdout
    assert (out / "demo.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "demo.db").is_file()
    assert "mean absolute error 4.06 %" in result.stdout


def test_demo_twice_is_the_same(demo):
    out, first = demo
    again = CliRunner().invoke(main, ["demo", "--out", str(out), "--json"])
    assert json.loads(again.stdout) == first
