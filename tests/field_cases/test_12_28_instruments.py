"""Field cases 12 to 15, 23 to 25, 27 and 28: text of oscilloscopes and recorders, each with two
channels in V at 100 kHz from -5 ms. A file is read so, or refused with its obstacle; never at
another rate."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.readers import AS_IN_FILE, ReadingOptions, RecordingError, open_recording
from support.records import instrument_texts as texts


@pytest.fixture
def written(tmp_path):
    def write(text, name="hit.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def _check(path, names, unit="V", options=AS_IN_FILE, first=0):
    with open_recording(path, options) as recording:
        assert [channel.name for channel in recording.channels] == list(names)
        for channel, signal in zip(recording.channels, texts.signals(), strict=False):
            assert channel.unit == unit
            assert channel.sampling_rate_hz == 100_000.0
            assert channel.start_s == pytest.approx(-0.005 + 1e-5 * first, abs=1e-10)
            np.testing.assert_allclose(recording.read(channel.name), signal[first:], atol=1e-12)


@pytest.mark.parametrize("name", texts.TEXTS)
def test_names_units_rate_start_and_numbers_are_right(written, name):
    text = texts.TEXTS[name]
    one_channel = name in ("siglent-old", "lecroy")
    _check(
        written(text),
        texts.NAMES.get(name, ("CH1", "CH2"))[: 1 if one_channel else 2],
        texts.UNITS.get(name, "V"),
    )


@pytest.mark.parametrize("name", texts.TEXTS)
def test_the_laboratory_may_name_the_channels(written, name):
    """The advice to give `columns` never makes a count of samples or a clock another time."""
    text = texts.TEXTS[name]
    one_channel = name in ("siglent-old", "lecroy")
    channels = ("force",) if one_channel else ("force", "acc [V]")
    first = () if name == "rigol-mso5000" else ("",) if name == "yokogawa" else ("time",)
    with open_recording(written(text), ReadingOptions(columns=(*first, *channels))) as recording:
        assert {channel.sampling_rate_hz for channel in recording.channels} == {100_000.0}
        assert {round(channel.start_s, 9) for channel in recording.channels} == {-0.005}


def test_a_part_of_the_screen_starts_with_its_first_sample(written):
    _check(written(texts.RIGOL_PART), ("CH1", "CH2"), first=22)


def test_a_header_in_a_file_beside_the_numbers_is_read(written, tmp_path):
    path = written(texts.RTO_NUMBERS, "hit.Wfm.csv")
    with pytest.raises(
        RecordingError,
        match=r"^hit\.Wfm\.csv: line 1 \('0,0'\) holds numbers .* into hit\.csv beside it",
    ):
        open_recording(path)
    header = written(texts.RTO_HEADER, "hit.csv")
    _check(path, ("CH1", "CH2"))
    with pytest.raises(
        RecordingError, match=r"^hit\.csv: is the header of hit\.Wfm\.csv; read that file instead"
    ):
        open_recording(header)
    written(texts.RTO_HEADER.replace("Acquisitions:1", "Acquisitions:4"), "hit.csv")
    with pytest.raises(
        RecordingError,
        match="has NumberOfAcquisitions = '4'; its segments would be read as one record",
    ):
        open_recording(path)


@pytest.mark.parametrize(
    ("name", "replaced", "reason"),
    [
        (
            "lecroy",
            ("Segments,1", "Segments,2"),
            "has Segments = '2'; its segments would be read as one record; export",
        ),
        ("yokogawa", ('"BlockNumber",1', '"BlockNumber",3'), "has BlockNumber = '3'"),
        (
            "yokogawa",
            ("1.000000E+05,1.000000E+05", "1.000000E+05,5.000000E+04"),
            "'SampleRate' is .*one for all channels",
        ),
        (
            "yokogawa",
            ('"SampleRate",1.000000E+05,1.0', '"SampleRate",2.000000E+05,2.0'),
            "states two sampling rates",
        ),
        (
            "yokogawa",
            ("-5.000000E-03,-5.000000E-03", "-5.000000E-03,-4.000000E-03"),
            "HOffset is .*; expected one number",
        ),
        (
            "yokogawa",
            ('"BlockSize",240,240', '"BlockSize",300,300'),
            "states a BlockSize of 300 and holds 240 lines",
        ),
        (
            "siglent",
            ("Analog:240", "Analog:250"),
            "states a Record Length of 250 and holds 240 lines; it is cut",
        ),
        ("siglent", ("1.000000E-05", "2.000000E-05"), "states two sampling rates"),
        ("dewesoft", ("Sample rate: 100000", "Sample rate: 1000"), "states two sampling rates"),
        ("rigol", ("\n24,", "\n25,"), "sequence number goes from 23 to 25; expected steps of one"),
        (
            "digilent",
            ("#CH1 Range", "#Gain: 10\n#CH1 Range"),
            "has the field 'Gain' = '10', which the reader does not know",
        ),
    ],
)
def test_what_contradicts_or_is_cut_is_named(written, name, replaced, reason):
    text = texts.TEXTS[name]
    assert replaced[0] in text
    with pytest.raises(RecordingError, match=reason):
        open_recording(written(text.replace(*replaced)))


def test_a_known_harmless_field_is_passed_over(written):
    text = texts.SIGLENT.replace("Analog:240", "Analog:250")
    _check(
        written(text), ("CH1", "CH2"), options=ReadingOptions(harmless_fields=("Record Length",))
    )


def test_time_in_another_unit_from_row_to_row_is_refused(written):
    """Case 15: us until -1 ms, then ns."""
    rows = [f"{-5000 + 10 * i:.3f},{i}" for i in range(400)] + [
        f"{1e3 * (-1000 + 10 * i):.3f},{i}" for i in range(200)
    ]
    with pytest.raises(RecordingError, match="time does not increase at sample"):
        open_recording(written("time (us),acceleration_1 (g)\n" + "\n".join(rows) + "\n"))


def test_a_count_of_samples_is_never_taken_for_seconds(written):
    """Case 12: with `columns` that call the sequence number time the rate became 1 Hz without a
    word."""
    path = written("".join(f"{i},{value}\n" for i, value in enumerate(texts.signals()[0])))
    with pytest.raises(
        RecordingError, match=r'columns calls \'time\' what counts 0, 1 .*name that column ""'
    ):
        open_recording(path, ReadingOptions(columns=("time", "force")))
    with pytest.raises(
        RecordingError,
        match=r"2 columns of numbers from line 1 .*sampling_rate_hz.*\"\" where it counts",
    ):
        open_recording(path)
    with open_recording(
        path, ReadingOptions(columns=("", "force"), sampling_rate_hz=1e5)
    ) as recording:
        assert recording.info("force").sampling_rate_hz == 1e5
