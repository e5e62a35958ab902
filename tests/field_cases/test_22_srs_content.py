"""Field case 22: a burst at five samples a cycle, far above the lines of the spectrum. right.csv is
of the same formula at 64 times the rate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main

CASE = Path(__file__).parent / "inputs" / "22-srs-content-above-line"
LINES, RIGHT_M_S2 = np.loadtxt(CASE / "right.csv", delimiter=",", comments="#").T
FREQUENCIES = ",".join(repr(float(line)) for line in LINES)


def spectrum(*options: str):
    result = CliRunner().invoke(
        main, ["srs", str(CASE / "hit.csv"), "--frequencies", FREQUENCIES, *options, "--json"]
    )
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize("options", [(), ("--no-resample",)])
def test_the_stated_error_is_a_bound(options):
    answer = spectrum(*options)
    error = np.abs(np.array(answer["maximax"]) / RIGHT_M_S2 - 1)
    stated = np.array([np.inf if share is None else share for share in answer["sampling_error"]])
    assert np.all(error <= stated)


def test_the_default_is_right_to_one_percent_and_accuses_nothing():
    answer = spectrum()
    np.testing.assert_allclose(answer["maximax"], RIGHT_M_S2, rtol=0.01)
    assert "sampling" not in {finding["check"] for finding in answer["checks"]}
    table = pd.read_csv(CASE / "hit.csv")
    series = pd.Series(
        table["acceleration_1 [m/s2]"].to_numpy(), index=table["time [s]"].to_numpy()
    )
    np.testing.assert_allclose(ps.srs(series, frequencies=LINES), answer["maximax"], rtol=1e-6)


def test_a_record_that_is_taken_as_it_is_gives_a_finding():
    (finding,) = (
        finding for finding in spectrum("--no-resample")["checks"] if finding["check"] == "sampling"
    )
    assert "--no-resample" in finding["message"] and finding["evidence"]["hidden_share"] > 0.12
