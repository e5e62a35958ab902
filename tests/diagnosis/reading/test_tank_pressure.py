"""The tank's pressure of withheld shots: the exit by the laser, and what the transducer reads where
it was not seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.reading import read_folder
from pyroshock.diagnosis.reading.series import StoredImpact
from pyroshock.diagnosis.reading.tank_pressure import pressures_as_read, pressures_set
from pyroshock.validation.case_plan import case_of_task, tasks
from pyroshock.validation.cases.record import record_case

SHOT = StoredImpact(1, 1, 1, None, None, 10.0, 0.1, "reported", None, None)


def shots(set_pa: list[float], recorded_pa: list[float | None]) -> list[StoredImpact]:
    pairs = zip(set_pa, recorded_pa, strict=True)
    return [replace(SHOT, set_pressure_pa=a, recorded_pressure_pa=b) for a, b in pairs]


def test_what_was_not_recorded_is_what_the_transducer_would_have_read() -> None:
    """A gain of 2 % and an offset of 500 Pa, told by errors in proportion to the pressure."""
    rng = np.random.default_rng(3)
    nominal = [float(p) for p in np.geomspace(0.3e5, 4e5, 12)]
    readings_pa = [1.02 * p * (1 + 0.003 * rng.standard_normal()) + 500.0 for p in nominal]
    recorded: list[float | None] = [None, *readings_pa[1:6], None, *readings_pa[7:]]
    pressures_pa = pressures_as_read(shots(nominal, recorded))
    assert pressures_pa[0] == pytest.approx(1.02 * nominal[0] + 500.0, rel=5e-3)
    assert pressures_pa[6] == pytest.approx(1.02 * nominal[6] + 500.0, rel=5e-3)
    assert pressures_pa[1:6] == readings_pa[1:6]


def test_levels_of_records_correct_the_line_of_a_transducer_that_is_not_straight() -> None:
    """A gain that grows by a quarter over the range: the line through the higher pressures is far
    off at the lowest."""
    rng = np.random.default_rng(3)
    nominal = np.geomspace(0.3e5, 4e5, 12)
    would_read_pa = nominal * (1 + 0.25 * nominal / 4e5)
    readings_pa = would_read_pa * (1 + 0.002 * rng.standard_normal(12))
    recorded: list[float | None] = [None, None, None, *readings_pa[3:].tolist()]
    u_pa = 0.01 * would_read_pa
    levels = {place: (float(would_read_pa[place]), float(u_pa[place])) for place in range(3)}
    line_pa = np.array(pressures_as_read(shots(nominal.tolist(), recorded))[:3], dtype=float)
    weighed_pa = np.array(
        pressures_as_read(shots(nominal.tolist(), recorded), levels)[:3], dtype=float
    )
    assert np.abs(line_pa / would_read_pa[:3] - 1).max() > 0.1
    assert np.abs(weighed_pa / would_read_pa[:3] - 1).max() < 0.01


def test_a_level_that_agrees_with_the_line_leaves_its_pressure() -> None:
    nominal = np.geomspace(0.3e5, 4e5, 12).tolist()
    recorded: list[float | None] = [None, *(1.02 * p for p in nominal[1:])]
    level = {0: (1.02 * nominal[0] * 1.02, 0.03 * nominal[0])}
    assert pressures_as_read(shots(nominal, recorded), level)[0] == pytest.approx(
        1.02 * nominal[0], rel=1e-3
    )


def test_one_set_pressure_gives_a_ratio_and_none_recorded_the_set_one() -> None:
    assert pressures_as_read(shots([1e5, 1e5, 1e5], [1.1e5, None, 1.1e5]))[1] == pytest.approx(
        1.1e5
    )
    assert pressures_as_read(shots([1e5, 2e5], [None, None])) == [1e5, 2e5]


def test_withheld_shots_have_their_record_with_the_exit_at_zero(tmp_path: Path) -> None:
    """The laser stands 45 mm behind the vents, and the middle of a bullet of 85 mm passes it when
    its tail is there."""
    case, seed = case_of_task(tasks(1, 7, ["one with traces"], "development", ["gun"])[0])
    record_case(case, tmp_path / "shots", seed)
    record = read_folder(tmp_path / "shots")
    traces = [run.tank_pressure for run in record.runs]
    assert all(trace is not None for trace in traces)
    for run, trace in zip(record.runs, traces, strict=True):
        assert trace is not None
        assert trace.start_s < 0 < trace.time_s[-1]
        assert run.tank_pressure_pa is not None
        before, after = trace.values[:10].mean(), trace.values[trace.time_s > 0].mean()
        assert before == pytest.approx(run.tank_pressure_pa, rel=0.1)
        assert after < 0.9 * before


def test_a_set_pressure_counts_where_it_is_another_instruments() -> None:
    """Set by the transducer itself both agree, whatever its errors are."""
    assert pressures_set(shots([1e5, 2e5], [1.002e5, 1.996e5])) == [None, None]
    assert pressures_set(shots([1e5, 2e5, 3e5], [1.05e5, 2.1e5, None])) == [1e5, 2e5, None]
    assert pressures_set(shots([1e5], [None])) == [None]
