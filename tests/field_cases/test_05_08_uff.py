"""Field cases 05 to 08: the abscissa of UFF 58 in ms, over frequency or angle, padded lines, and a
line end in 58b."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording
from pyroshock.signals.srs.spectrum import shock_response_spectrum

RATE = 51200.0
SAMPLES = 2046
VALUES = (
    4738.0663649354265
    * np.sin(np.pi * np.arange(SAMPLES) / SAMPLES)
    * np.cos(np.arange(SAMPLES) / 7)
)
NUMBER = "{:20.12e}".format


def text_of(
    values=VALUES,
    *,
    function=1,
    abscissa=(17, "Time", "s"),
    step="1.95313e-05",
    start="0.00000e+00",
    denominator=(0, "NONE", "NONE"),
    times=None,
    pad=True,
    tag="    -1",
    kind="    58",
) -> str:
    """A data set as the standard prints it: records 1 to 11, then 4E20.12 or 2(E13.5,E20.12)."""

    def axis(number, label, unit):
        return f"{number:10d}    0    0    0 {label:20s} {unit:20s}"

    head = [
        *["NONE"] * 5,
        f"{function:5d}         0    1         0        acc         1   3       NONE         0   0",
        f"         4{len(values):10d}{0 if times is not None else 1:10d}{start:>13}{step:>13}"
        "  0.00000e+00",
        axis(*abscissa), axis(12, "Acceleration", "m/s2"), axis(*denominator),
        axis(0, "NONE", "NONE"),
    ]  # fmt: skip
    fields = [NUMBER(x) for x in values]
    if times is not None:
        fields = [f"{t:13.5e}{x}" for t, x in zip(times, fields, strict=True)]
    width = 4 if times is None else 2
    lines = ["".join(fields[i : i + width]) for i in range(0, len(fields), width)]
    lines = [f"{line:80s}" if pad else line for line in [*head, *lines]]
    return "\n".join([tag, kind, *lines, tag]) + "\n"


def facts(path: Path, text: str | bytes):
    path.write_bytes(text if isinstance(text, bytes) else text.encode("ascii"))
    with open_recording(path) as recording:
        (info,) = recording.channels
        return info.sampling_rate_hz, info.start_s, recording.read(info.name)


@pytest.mark.parametrize(
    ("unit", "step", "start", "start_s"),
    [
        ("s", "1.95313e-05", "-1.00000e-02", -0.01),
        ("ms", "1.95312e-02", "-1.00000e+01", -0.01),
        ("us", "1.95312e+01", "2.50000e+02", 0.00025),
        ("msec", "1.95312e-02", "0.00000e+00", 0.0),
        ("NONE", "1.95313e-05", "0.00000e+00", 0.0),
    ],
)
@pytest.mark.parametrize("kind", [17, 0])
def test_abscissa_in_its_unit(tmp_path, unit, step, start, start_s, kind):
    text = text_of(abscissa=(kind, "Time", unit), step=step, start=start)
    rate, first_s, values = facts(tmp_path / "hit.uff", text)
    assert (rate, first_s) == (RATE, pytest.approx(start_s))
    assert np.allclose(values, VALUES, rtol=0, atol=1e-8)


def test_uneven_spacing_in_ms_gives_the_rate_and_the_spectrum(tmp_path):
    times_ms = np.arange(SAMPLES) / RATE * 1e3
    text = text_of(abscissa=(17, "Time", "ms"), step="0.00000e+00", times=times_ms)
    rate, _, values = facts(tmp_path / "hit.uff", text)
    reference = shock_response_spectrum(VALUES, RATE, np.array([100.0, 1000.0]))
    assert rate == RATE
    assert shock_response_spectrum(
        values, rate, np.array([100.0, 1000.0])
    ).maximax == pytest.approx(reference.maximax, rel=1e-9)


@pytest.mark.parametrize(
    ("abscissa", "named"),
    [
        ((18, "Frequency", "Hz"), "type 18"),
        ((0, "Angle", "deg"), "'Angle' in 'deg'"),
        ((0, "Angle", "NONE"), "'Angle' in ''"),
        ((17, "Time", "rev"), "in 'rev'"),
        ((19, "NONE", "NONE"), "type 19"),
        ((20, "Order", "s"), "type 20"),
        ((8, "Position", "m"), "type 8"),
    ],
)
@pytest.mark.parametrize("function", [0, 1])
def test_other_abscissas_are_no_recording(tmp_path, abscissa, named, function):
    text = text_of(function=function, abscissa=abscissa, step="2.50000e+01")
    with pytest.raises(RecordingError, match="which is no time") as error:
        facts(tmp_path / "fft.uff", text)
    assert named in str(error.value)


def test_ratio_is_no_recording(tmp_path):
    with pytest.raises(
        RecordingError, match="orddenom_axis_units_lab = 'N'; record 10: the samples are a ratio"
    ):
        facts(tmp_path / "hit.uff", text_of(denominator=(13, "Force", "N")))


@pytest.mark.parametrize("samples", [2046, 2045, 2047, 2048, 2])
def test_last_line_may_be_padded(tmp_path, samples):
    """2046 samples at four a line: the last line holds two, then blanks to column 80."""
    values = np.resize(VALUES, samples)
    for text in (
        text_of(values),
        text_of(values, pad=False),
        text_of(values).replace("\n", "\r\n"),
    ):
        assert np.allclose(facts(tmp_path / "hit.uff", text)[2], values, rtol=0, atol=1e-8)


@pytest.mark.parametrize("line", ["\n", "\r\n"])
def test_tags_and_numbers_may_stand_at_the_left(tmp_path, line):
    text = text_of(tag="-1", kind="58").replace("\n", line)
    rate, _, values = facts(tmp_path / "hit.uff", text)
    assert rate == RATE and np.allclose(values, VALUES, rtol=0, atol=1e-8)


def test_several_sets_and_others_between_them(tmp_path):
    node = (
        "-1\n15\n         1         0         0        11  0.0000e+00  0.0000e+00 -1.0000e+00\n-1\n"
    )
    text = (
        text_of().replace("NONE", "first", 1)
        + node
        + text_of(tag="  -1").replace("NONE", "other", 1)
    )
    path = tmp_path / "hit.uff"
    path.write_text(text, encoding="ascii")
    with open_recording(path) as recording:
        assert [channel.name for channel in recording.channels] == ["first", "other"]
        assert np.allclose(recording.read("other"), VALUES, rtol=0, atol=1e-8)


@pytest.mark.parametrize("between", [b"", b"\n", b"\r\n"])
def test_binary_set_with_a_line_end_before_its_tag(tmp_path, between):
    """The samples hold line ends and blanks: they are passed over by the count in the set's first
    line."""
    values = VALUES.copy()
    values[17] = struct.unpack("<d", b"  \n   \n ")[0]
    lines = text_of().split("\n")
    raw = values.astype("<f8").tobytes()
    first = f"    58b     1     2          11{len(raw):12d}     0     0           0           0"
    data = (
        "\n".join([lines[0], f"{first:80s}", *lines[2:13]]).encode()
        + b"\n"
        + raw
        + between
        + b"    -1\n"
    )
    rate, _, read = facts(tmp_path / "hit.uff", data)
    assert rate == RATE and np.array_equal(read, values)


def test_cut_file_is_refused(tmp_path):
    path = tmp_path / "hit.uff"
    path.write_text(text_of()[:-400], encoding="ascii")
    with pytest.raises(RecordingError, match="do not enclose whole data sets"):
        open_recording(path)
