"""Single placeholder values in records (field cases 31 and 13): rejected, no shock, never the place
of a contact."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main

INPUTS = Path(__file__).parent / "inputs"
PLACEHOLDERS = INPUTS / "31-placeholder-values"
#: Right spectrum without them (m/s2) at 500, 1000, 2000 and 5000 Hz, by the case's README.
RIGHT = (1200.0, 3155.0, 21680.0, 5938.0)


@pytest.mark.parametrize("file", sorted(PLACEHOLDERS.glob("*.csv")), ids=lambda file: file.stem)
def test_srs_rejects_the_record_and_has_the_spectrum_without_them(file: Path) -> None:
    answer = CliRunner().invoke(
        main, ["srs", str(file), "--frequencies", "500,1000,2000,5000", "--no-resample", "--json"]
    )
    assert answer.exit_code == 0, answer.output
    outcome = json.loads(answer.stdout)
    assert [(f["check"], f["severity"]) for f in outcome["checks"]] == [("placeholder", "reject")]
    assert outcome["maximax"] == pytest.approx(RIGHT, rel=1e-3)


def test_the_campaign_is_rejected_and_its_figures_are_those_of_the_hits(tmp_path: Path) -> None:
    with ps.open(tmp_path / "lab.db") as store:
        outcome = store.ingest(PLACEHOLDERS / "campaign", jobs=1, progress=False)
        impacts = store.impacts()
    findings = {
        (f["recording"], f["channel"], f["check"], f["severity"]) for f in outcome.report.findings
    }
    assert findings == {
        ("recordings/acc-one-9.9e37.csv", "acceleration_1", "placeholder", "reject"),
        ("recordings/force-one-9.9e37.csv", "force", "placeholder", "reject"),
        ("recordings/acc-int16.csv", "acceleration_1", "placeholder", "reject"),
        ("recordings/force-minus9999.csv", "force", "placeholder", "reject"),
    }
    assert impacts["peak_force_n"].to_numpy() == pytest.approx(2001.0, rel=1e-3)
    assert impacts["contact_time_s"].to_numpy() == pytest.approx(507.8e-6, rel=1e-2)
    assert (impacts["quality"] == "reject").all()


def test_samples_beyond_an_oscilloscope_s_range_are_clipped_at_the_largest_reading() -> None:
    answer = CliRunner().invoke(main, ["srs", str(INPUTS / "13-over-time.csv"), "--json"])
    outcome = json.loads(answer.stdout)
    assert {(f["check"], f["severity"]) for f in outcome["checks"]} == {("clipping", "reject")}
    assert max(outcome["maximax"]) < 1e5
    assert all(abs(f["evidence"]["level"]) <= 200 * 9.80665 for f in outcome["checks"])


def test_the_library_s_spectrum_refuses_them(tmp_path: Path) -> None:
    record = np.loadtxt(PLACEHOLDERS / "one-minus9999.csv", delimiter=",", skiprows=1)[:, 1]
    with pytest.raises(
        ps.InvalidValueError, match=r"3 samples, the first number 600 = -9999.*replace it"
    ):
        ps.srs(record, 50_000.0, frequencies=[500.0])
    with pytest.raises(ps.InvalidValueError, match="of column 'a'"):
        ps.srs(pd.DataFrame({"a": record}), 50_000.0, frequencies=[500.0])
