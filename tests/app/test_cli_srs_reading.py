"""`pyroshock srs`: what a file says beside its samples, and uneven time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from nptdms import ChannelObject, TdmsWriter
from pyroshock.app.doors.command_line.main import main

LINES = "500,1000,2000"


def call(*words):
    result = CliRunner().invoke(main, ["srs", *map(str, words)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def shock(time_s):
    since = np.maximum(time_s - 0.02, 0.0)
    return 900 * np.exp(-since * 300) * np.sin(2 * np.pi * 1500 * since)


def table(path: Path, time_s) -> Path:
    rows = [f"{t:.9f},{a:.9g}\n" for t, a in zip(time_s, shock(time_s), strict=True)]
    path.write_text("time_s,acc [g]\n" + "".join(rows), encoding="utf-8")
    return path


def test_uneven_time_is_refused_or_resampled_with_its_error(tmp_path):
    even = table(tmp_path / "even.csv", np.arange(4000) / 48_000)
    time_s = np.cumsum(np.where(np.arange(4000) < 1500, 1 / 40_000, 1 / 58_000))
    uneven = table(tmp_path / "uneven.csv", time_s)
    refused = call(uneven)
    assert refused.exit_code == 2 and "its time has two rates, 40000 Hz" in refused.stderr
    assert "--uneven-time resample" in refused.stderr
    right = json.loads(call(even, "--frequencies", LINES, "--json").stdout)
    resampled = json.loads(
        call(uneven, "--frequencies", LINES, "--uneven-time", "resample", "--json").stdout
    )
    assert resampled["maximax"] == pytest.approx(right["maximax"], rel=0.02)
    assert any(check["check"] == "resampled-time" for check in resampled["checks"])


def test_gap_of_the_time_column_is_a_finding(tmp_path):
    time_s = np.delete(np.arange(4000) / 48_000, slice(970, 990))
    checks = json.loads(call(table(tmp_path / "gap.csv", time_s), "--json").stdout)["checks"]
    assert any(
        check["check"] == "dropouts" and "20 samples" in check["message"] for check in checks
    )


def test_field_that_changes_numbers_is_refused_unless_it_is_called_harmless(tmp_path):
    path = tmp_path / "hit.tdms"
    properties = {"wf_increment": 1 / 48_000, "unit_string": "g", "Gain": 2.0}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [ChannelObject("bench", "acc", shock(np.arange(4000) / 48_000), properties)]
        )
    refused = call(path)
    assert refused.exit_code == 2 and "the field 'Gain' = 2.0" in refused.stderr
    assert call(path, "--harmless-field", "gain", "--frequencies", LINES).exit_code == 0
