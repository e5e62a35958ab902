"""Field cases 17 to 20: absolute starts, many writes under one heading, variants, and x axes of LVM
files."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording

RATE = 50_000
FORCE = 800 * np.exp(-(((np.arange(1000) - 262) / 12) ** 2))
ACCELERATION = 40 * np.exp(-np.abs(np.arange(1000) - 256) / 30)


def text_of(
    x=None,
    *,
    writes=1,
    dates=("2026/03/02", "2026/03/02"),
    times=("12:00:00.000", "12:00:00.000"),
    x0=("0.0", "0.0"),
    step="0.000020",
    dimension="Time",
    unit=None,
    decimal=".",
    notes="",
    **more,
) -> str:
    """As LabVIEW writes it: header, segment, two channels; `x` are the X values as they are
    printed."""
    head = {
        "Writer_Version": "2", "Reader_Version": "2", "Separator": "Tab",
        "Decimal_Separator": decimal,
        "Multi_Headings": "No", "X_Columns": "No" if x is None else "One", "Time_Pref": "Absolute",
        "Operator": "op",
        "Date": "2026/03/02", "Time": "12:00:00.0", **more,
    }  # fmt: skip
    rows = {
        "Channels": ["2", ""], "Samples": ["1000", "1000"], "Date": dates, "Time": times,
        "Y_Unit_Label": ["N", "g"],
        "X_Dimension": [dimension] * 2, "X0": x0, "Delta_X": [step] * 2,
    }  # fmt: skip
    if unit is not None:
        rows["X_Unit_Label"] = [unit] * 2
    force, acceleration = np.tile(FORCE, writes), np.tile(ACCELERATION, writes)
    lines = [
        "LabVIEW Measurement\t",
        *(f"{key}\t{value}" for key, value in head.items()),
        "***End_of_Header***\t",
        "\t",
    ]
    lines += [notes] if notes else []
    lines += ["\t".join([key, *values, ""]) for key, values in rows.items()]
    lines += ["***End_of_Header***\t\t\t", "X_Value\tforce\tacceleration_1\tComment"]
    for i, (f, a) in enumerate(zip(force, acceleration, strict=True)):
        lines.append(f"{'' if x is None else x[i]}\t{f:.6f}\t{a:.6f}".replace(".", decimal))
    return "\n".join(lines) + "\n"


@pytest.fixture
def facts(tmp_path):
    """name -> (rate, start, gaps, samples) of a text as it is read."""

    def read(text, **options):
        path = tmp_path / "hit.lvm"
        path.write_text(text, encoding="utf-8", newline="")
        with open_recording(path, ReadingOptions(**options)) as recording:
            return {
                info.name: (
                    info.sampling_rate_hz,
                    info.start_s,
                    info.header.get("time_gaps"),
                    recording.read(info.name),
                )
                for info in recording.channels
            }

    return read


@pytest.mark.parametrize(
    ("stamps", "late_s"),
    [
        ({"times": ("12:00:00.000", "12:00:00.004")}, 0.004),
        ({"times": ("12:00:00,0000000000000000", "12:00:00,0312499999534338713")}, 0.0312499999),
        ({"times": ("23:59:59.998", "00:00:00.003"), "dates": ("2026/03/02", "2026/03/03")}, 0.005),
        ({"x0": ("0.0", "0.004")}, 0.004),
        ({"x0": ("-0.001", "0.002"), "times": ("12:00:00.001", "12:00:00.000")}, 0.002),
    ],
)
def test_channels_start_on_one_clock(facts, stamps, late_s):
    """By Date, Time and X0 of each channel."""
    channels = facts(text_of(**stamps))
    assert channels["acceleration_1"][1] - channels["force"][1] == pytest.approx(late_s, abs=1e-9)
    assert min(channels["force"][1], channels["acceleration_1"][1]) <= 0.0


def test_channel_without_a_start_is_refused_and_can_be_read_as_starting_with_the_others(facts):
    text = text_of(times=("12:00:00.000", ""), dates=("2026/03/02", ""))
    assert list(facts(text)) == ["force"]
    assert list(facts(text, harmless_fields=("Date", "Time"))) == ["force", "acceleration_1"]


def test_start_that_cannot_be_read_is_refused_only_where_starts_differ(facts):
    assert facts(text_of(dates=("2. März", "2. März")))["force"][1] == 0.0
    with pytest.raises(
        RecordingError, match=r"start at different times, and '2\. März' '12:00:00.000' is not read"
    ):
        facts(text_of(dates=("2. März", "3. März")))


@pytest.mark.parametrize(
    ("jump_s", "missing"), [(0.5, 24000), (0.02004, 2), (0.02, 0), (1.25, 61500)]
)
def test_gap_between_writes_is_the_x_columns(facts, jump_s, missing):
    times = np.r_[np.arange(1000) / RATE, np.round(jump_s * RATE + np.arange(1000)) / RATE]
    for digits in (6, 9):
        rate, start, gaps, samples = facts(text_of([f"{t:.{digits}f}" for t in times], writes=2))[
            "acceleration_1"
        ]
        at = int(np.argmax(samples[1000:]))
        assert (rate, start, samples.size) == (RATE, 0.0, 2000)
        assert gaps == ([[1000, missing]] if missing else None)
        second_s = (1000 + (gaps[0][1] if gaps else 0) + at) / rate
        assert second_s == pytest.approx(jump_s + 256 / RATE, abs=1e-9)


def test_x_columns_that_contradict_the_step_are_refused(facts):
    with pytest.raises(
        RecordingError, match="a Delta_X of 50000 Hz, and its X column gives 40000 Hz"
    ):
        facts(text_of([f"{i / 40000:.6f}" for i in range(1000)]))
    with pytest.raises(RecordingError, match="its time has two rates, 50000 Hz"):
        facts(text_of([f"{i * 2e-5 + max(0, i - 400) * 1e-5:.6f}" for i in range(1000)]))


def test_x_column_of_few_digits_leaves_the_stated_rate(facts):
    assert facts(text_of([f"{i / RATE:.4f}" for i in range(1000)]))["force"][:3] == (
        RATE,
        0.0,
        None,
    )


def test_writes_without_x_column_are_refused_unless_they_follow_each_other(facts):
    with pytest.raises(
        RecordingError, match=r"3 writes of 1000 samples under one heading and no X column.*Samples"
    ):
        facts(text_of(writes=3))
    assert facts(text_of(writes=3), harmless_fields=("Samples",))["force"][3].size == 3000
    assert facts(text_of())["force"][3].size == 1000


@pytest.mark.parametrize(
    "text",
    [
        text_of(decimal=",", step="0,000020", x0=("0,0", "0,0")),
        text_of(notes="Notes\tgain 2 set by hand"),
        text_of().replace("\n", "\r\n"),
        text_of(Description="calibration hit", Project="STM"),
    ],
)
def test_variants_are_read(facts, text):
    channels = facts(text)
    assert {name: channel[:2] for name, channel in channels.items()} == {
        "force": (RATE, 0.0), "acceleration_1": (RATE, 0.0),
    }  # fmt: skip
    assert np.allclose(channels["force"][3], FORCE, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("unit", "step"), [("ms", "0.020000"), ("us", "20.0"), ("s", "0.000020"), ("", "0.000020")]
)
def test_step_in_its_unit(facts, unit, step):
    assert facts(text_of(unit=unit, step=step))["force"][0] == RATE


def test_x_column_in_ms(facts):
    column = [f"{t:.3f}" for t in np.r_[np.arange(1000), 2000 + np.arange(1000)] * 0.02]
    assert facts(text_of(column, writes=2, unit="ms", step="0.020000"))["force"][:3] == (
        RATE,
        0.0,
        [[1000, 1000]],
    )


@pytest.mark.parametrize(
    ("dimension", "unit"), [("Frequency", None), ("Time", "Hz"), ("Angle", "deg"), ("Speed", None)]
)
def test_other_axes_are_no_recording(facts, dimension, unit):
    with pytest.raises(RecordingError, match=f"X_Dimension = '{dimension}' .*which is no time"):
        facts(text_of(dimension=dimension, unit=unit, step="25.0"))


def test_key_that_changes_a_number_is_refused(facts):
    with pytest.raises(RecordingError, match=r"the file has the field 'Scale_Factor' = '4\.448'"):
        facts(text_of(Scale_Factor="4.448"))
