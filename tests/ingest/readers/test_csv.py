"""CSV as laboratories write it: every layout below says the same two channels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from pyroshock.ingest.readers.base import rate_from_step

FORCE = [0.0, 1.5, -2.25]
ACCELERATION = [10.0, 20.5, 30.0]

#: One recording at 51.2 kHz, force in N and acc in g, as many programs would have written it.
LAYOUTS = {
    "comma": "# fs = 51200\nforce [N],acc [g]\n0,10\n1.5,20.5\n-2.25,30\n",
    "semicolon, decimal comma": "fs;51200\nforce [N];acc [g]\n0,0;10\n1,5;20,5\n-2,25;30\n",
    "tab, unit row": "fs: 51200 Hz\nforce\tacc\nN\tg\n0\t10\n1.5\t20.5\n-2.25\t30\n",
    "tab, decimal comma": "Sampling rate "
    "[kHz]\t51,2\nforce\tacc\nN\tg\n0\t10\n1,5\t20,5\n-2,25\t30\n",
    "bar": "# fs: 51.2 kHz\nforce (N)|acc (g)\n0|10\n1.5|20.5\n-2.25|30\n",
    "rate column": "fs,force [N],acc [g]\n51200,0,10\n51200,1.5,20.5\n51200,-2.25,30\n",
    "numpy.savetxt": "# force [N],acc [g],fs\n0e+0,1e+1,5.12e+4\n1.5,20.5,51200\n-2.25,30,51200\n",
    "quoted names": '# fs = 51200\n"force [N]","acc [g]"\n0,10\n1.5,20.5\n-2.25,30\n',
    "rows numbered": "# fs = 51200\n,force [N],acc [g]\n0,0,10\n1,1.5,20.5\n2,-2.25,30\n",
    "delimiter at the end": "# fs = 51200\nforce [N],acc [g],\n0,10,\n1.5,20.5,\n-2.25,30,\n",
    "blanks and statements": (
        "Operator;Ana\n\nSampling Rate;51200\n\nforce;acc\n[N];[g]\n 0,0; "
        "10,0\n 1,5; 20,5\n-2,25; 30,0\n\n"
    ),
    "time in microseconds": "time [us],force [N],acc "
    "[g]\n0,0,10\n19.53125,1.5,20.5\n39.0625,-2.25,30\n",
    "time in a unit row": (
        "Time;force;acc\nms;N;g\n0,0;0;10\n0,01953125;1,5;20,5\n0,0390625;-2,25;30\n"
    ),
    "time with its unit in a name": "Time_us,force [N],acc "
    "[g]\n0,0,10\n19.53125,1.5,20.5\n39.0625,-2.25,30\n",
    "blanks": "# fs = 51200\nforce acc\nN g\n  0     10\n  1.5   20.5\n -2.25  30\n",
    "blanks and tabs": "# fs = 51200\n  force \t acc  \n  "
    "N\t\tg\n 0 \t  10\n1.5   20.5\t\n-2.25\t \t30\n",
    "blanks, decimal comma": "fs 51200\nforce [N]  acc [g]\n0,0 10\n1,5 20,5\n-2,25 30\n",
    "blanks, unit after a blank": "Time [ms] force [N] acc [g]\n0 0 "
    "10\n0.01953125 1.5 20.5\n0.0390625 -2.25 30\n",
    "blanks, commas in the heading": (
        "# time(s), \t force(N), acc(g)\n0 0 10\n1.953125e-5 1.5 20.5\n3.90625e-5 -2.25 30\n"
    ),
    "comment lines": "% bench 3\n// hammer, low\n% fs = 51200\n% force [N] acc [g]\n0 10\n1.5 "
    "20.5\n-2.25 30\n",
    "text above": (
        "Recorder X 12, serial 0042\nsecond floor\n\nSampling rate: 51200 "
        "Hz\n\nforce,acc\n(N),(g)\n\n0,10\n1.5,20.5\n"
        "-2.25,30\n"
    ),
    "delimiter at the end of the numbers": "# fs = 51200\nforce [N],acc "
    "[g]\n0,10,\n1.5,20.5,\n-2.25,30,\n",
    "delimiter at the end of the names": "# fs = 51200\nforce [N]\tacc "
    "[g]\t\n0\t10\n1.5\t20.5\n-2.25\t30\n",
    "step above": "# Sample interval: 19.53125 us\nforce [N],acc [g]\n0,10\n1.5,20.5\n-2.25,30\n",
    "time printed coarsely": "# fs = 51200\ntime,force [N],acc "
    "[g]\n0,0,10\n0,1.5,20.5\n0.0001,-2.25,30\n",
    "time named with its unit": "t_ms,force [N],acc "
    "[g]\n0,0,10\n0.01953125,1.5,20.5\n0.0390625,-2.25,30\n",
}


@pytest.fixture
def written(tmp_path):
    """`written(text)` is the path of a .csv with it; str is stored as UTF-8."""

    def write(text):
        path = tmp_path / "shot.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["lf", "crlf"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["bare", "bom"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_channels(written, layout, mark, end):
    with open_recording(written((mark + LAYOUTS[layout]).replace("\n", end))) as recording:
        assert ("Operator" in LAYOUTS[layout]) == (
            recording.info("force").header.get("Operator") == "Ana"
        )
        assert [(c.name, c.unit, c.samples) for c in recording.channels] == [
            ("force", "N", 3),
            ("acc", "g", 3),
        ]
        assert {c.sampling_rate_hz for c in recording.channels} == {51200.0}
        np.testing.assert_array_equal(recording.read("force"), FORCE)
        np.testing.assert_array_equal(recording.read("acc"), ACCELERATION)


@pytest.mark.parametrize("decimal", [".", ","])
def test_one_column_is_read(written, decimal):
    text = "# fs = 51200\nforce\n0.5\n1.5\n2.25\n".replace(".", decimal)
    with open_recording(written(text)) as recording:
        np.testing.assert_array_equal(recording.read("force"), [0.5, 1.5, 2.25])


def test_names_digits_gaps_and_a_last_line_without_end_are_read(written):
    with open_recording(written("# fs = 51200\nacc (top),force\n1,2\n3,4\n")) as recording:
        assert [(c.name, c.unit) for c in recording.channels] == [
            ("acc (top)", None),
            ("force", None),
        ]
    values = np.random.default_rng(7).normal(size=200) * 10.0 ** np.random.default_rng(8).integers(
        -300, 300, 200
    )
    with open_recording(
        written("# fs = 51200\nforce,zero\n" + "".join(f"{v!r},0\n" for v in values.tolist()))
    ) as recording:
        np.testing.assert_array_equal(recording.read("force"), values)
    with open_recording(written("# fs = 51200\nforce,acc\n1,2\n,4\n5,nan\n")) as recording:
        np.testing.assert_array_equal(recording.read("force"), [1, np.nan, 5])
        np.testing.assert_array_equal(recording.read("acc"), [2, 4, np.nan])
    with open_recording(written("# fs = 51200\nforce,acc\n1,2\n3,4\n5,6")) as recording:
        assert recording.read("acc").tolist() == [2.0, 4.0, 6.0]
        assert recording.info("acc").header["last_line_without_end"] is True


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "# fs = 51200\nforce,acc\n1,2\n3\n5,6\n",
            "need 3 delimiters, found 2; a line is cut or damaged",
        ),
        ("# fs = 51200\nforce,acc\n1,2\n3,4,5\n6,7\n", "delimiters|fields|header"),
        ("# fs = 51200\nforce,acc\n1,2\n3,4\n5,abc\n", "abc"),
        ("# fs = 51200\n# samples = 3\nforce,acc\n1,2\n3,4\n5,6", "last line has no line end"),
        ("# fs = 51200\n# samples = 3\nforce,acc\n1,2\n3,4\n", "states 3 samples and holds 2"),
        ("# fs = 51200\n# samples = 4\nforce,acc\n1,2\n3,4\n", "states 4 samples and holds 2"),
        ("# fs = 51200\nforce,acc\n1,2\n3\n", "need 2 delimiters, found 1"),
        (
            "1,2\n3,4\n",
            "no line of names above them; expected a header such as time,force, or columns and ",
        ),
        ("# fs = 51200\nforce,acc\n", "no line of numbers"),
        ("# fs = fast\nforce,acc\n1,2\n3,4\n", "'fs' is 'fast'; expected a number in Hz"),
        ("# fs = 51,200\nforce,acc\n1,2\n3,4\n", "'fs' is '51,200'"),
        ("# fs = 51200 rpm\nforce,acc\n1,2\n3,4\n", "'fs' is '51200 rpm'"),
        ("# fs = -5\nforce,acc\n1,2\n3,4\n", "expected a finite number above 0"),
        ("force,acc\n1,2\n3,4\n", "has no sampling rate"),
        ("fs,force\n51200,1\n48000,2\n", "'fs' varies from 48000.0 to 51200.0"),
        ("time [days],force\n0,1\n1,2\n", "'time' is in 'days'; expected one of s, ms, us, ns"),
        ("time,force\n0,1\n2,2\n1,3\n", "time does not increase at sample 2"),
        (
            b"# fs = 51200\nforce,T [\x8dC]\n1,2\n",
            r"byte 22 \(0x8d\) is not UTF-8, nor Windows-1252",
        ),
        (
            b"# fs = 51200, \xc2\xb5\nforce,T [\xb0C]\n1,2\n",
            r"byte 26 \(0xb0\) is not UTF-8, and other bytes are",
        ),
        ("force,acc\n1,2\n".encode("utf-16")[:-1], "UTF-16 text is cut or damaged at byte"),
        ("# fs = 51200\nforce,acc\n1,2\n3,4,5\n6\n7,8\n", "Expected 2 fields in line 2, saw 3"),
        ("# fs = 51200\nforce acc\n1 2\n3\n5 6\n", "lack 1 numbers; a line is cut or damaged"),
        (
            "# fs = 51200\nforce acc\n1 2\n3 4 5\n6 7\n",
            "Expected 2 fields in line 2, saw 3|does not match length",
        ),
        ("# fs = 51200\nforce acc\n1 2\n3 4\n5 abc\n", "abc"),
        ("# dt = -1e-5\nforce acc\n1 2\n3 4\n", "'dt' is '-1e-5'; expected a step above 0"),
        ("# dt = 1 day\nforce acc\n1 2\n3 4\n", "'dt' is '1 day'; expected a step"),
        ("# dt = 1e-5\ntime force acc\n0 1 2\n1e-4 3 4\n", "states two sampling rates"),
        (b"# fs = 51200\nforce,acc\n1,\x002\n", "has a zero byte at 25"),
    ],
)
def test_what_is_no_whole_table_is_refused(written, text, reason):
    with (
        pytest.raises(RecordingError, match=rf"^shot\.csv: .*({reason})"),
        open_recording(written(text)) as recording,
    ):
        recording.read("acc")


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16"])
def test_letters_of_units_are_read_in_every_usual_encoding(written, encoding):
    text = "time [µs];temp [°C]\n0;20,5\n10;21,5\n"
    with open_recording(written(text.encode(encoding))) as recording:
        channel = recording.info("temp")
        assert (channel.unit, channel.sampling_rate_hz) == ("°C", 100_000.0)
        assert recording.read("temp").tolist() == [20.5, 21.5]


def test_repeated_blanks_in_a_name_matter_only_between_two_alike(written):
    with open_recording(written("# fs = 51200\nForce  1,acc\n1,2\n3,4\n")) as recording:
        for name in ("Force  1", "Force 1", " Force   1 "):
            assert recording.info(name).name == "Force  1"
            assert recording.read(name).tolist() == [1.0, 3.0]
    with open_recording(written("# fs = 51200\nForce   1,Force  1\n1,2\n3,4\n")) as recording:
        assert recording.read("Force  1").tolist() == [2.0, 4.0]
        message = "'Force 1' can be each of 'Force   1', 'Force  1'; expected the name as"
        with pytest.raises(RecordingError, match=message):
            recording.read("Force 1")


class TestWithoutHeading:
    """Numbers alone: `columns` and `sampling_rate_hz` come from `[recordings]` of campaign.toml."""

    @pytest.mark.parametrize(
        ("text", "options"),
        [
            ("0 10\n1.5 20.5\n-2.25 30\n", {}),
            ("0,10\n1.5,20.5\n-2.25,30\n", {}),
            ("0;10\n1,5;20,5\n-2,25;30", {}),
            ("0\t10\t\n1.5\t20.5\t\n-2.25\t30\t\n", {}),
            ("some recorder\n\n0 10\n1.5 20.5\n-2.25 30\n", {}),
        ],
    )
    def test_names_units_and_rate_are_those_given(self, written, text, options):
        given = ReadingOptions(columns=("force [N]", "acc"), sampling_rate_hz=51200.0, **options)
        with open_recording(written(text), given) as recording:
            facts = [(c.name, c.unit, c.sampling_rate_hz) for c in recording.channels]
            assert facts == [("force", "N", 51200.0), ("acc", None, 51200.0)]
            np.testing.assert_array_equal(recording.read("force"), FORCE)
            np.testing.assert_array_equal(recording.read("acc"), ACCELERATION)

    @pytest.mark.parametrize("delimiter", [" ", "   ", "\t", ",", ";"])
    def test_what_numpy_wrote_comes_back(self, tmp_path, delimiter):
        table = np.column_stack(
            [np.arange(200) / 51200, np.random.default_rng(3).normal(size=(200, 2))]
        )
        np.savetxt(tmp_path / "shot.dat", table, fmt="%.17g", delimiter=delimiter)
        with open_recording(
            tmp_path / "shot.dat", ReadingOptions(("time", "force", "acc"))
        ) as recording:
            assert recording.info("force").sampling_rate_hz == 51200.0
            np.testing.assert_array_equal(recording.read("force"), table[:, 1])
            np.testing.assert_array_equal(recording.read("acc"), table[:, 2])

    def test_names_in_the_file_come_first_then_those_given_then_numbers(self, written):
        for text, options, names in (
            (
                "0.5 10\n1.5 20.5\n",
                ReadingOptions(sampling_rate_hz=1000.0),
                ["column_1", "column_2"],
            ),
            (
                "1 10\n2 20.5\n",
                ReadingOptions(("", "force"), 1000.0),
                ["force"],
            ),  # without a name: left out
            ("force acc\n1 2\n3 4\n", ReadingOptions(("acc", "force"), 51200.0), ["force", "acc"]),
        ):
            with open_recording(written(text), options) as recording:
                assert [c.name for c in recording.channels] == names
                force = recording.read("force").tolist() if "force" in names else []
        assert force == [1.0, 3.0]
        with open_recording(
            written("Time_ms X\n0 1\n0.5 2\n"), ReadingOptions(("time", "force"))
        ) as recording:
            assert (
                recording.info("X").sampling_rate_hz == 2000.0
            )  # a heading with time keeps its unit

    @pytest.mark.parametrize(("decimal", "columns"), [(",", [[1.2, 3.4]]), (".", [[1, 3], [2, 4]])])
    def test_two_readings_are_told_apart_by_the_decimal_sign(self, written, decimal, columns):
        path = written("1,2\n3,4\n")
        with pytest.raises(
            RecordingError, match="can be read as 2 columns or as 1; give columns, or decimal"
        ):
            open_recording(path, ReadingOptions(sampling_rate_hz=1.0))
        with open_recording(
            path, ReadingOptions(sampling_rate_hz=1.0, decimal=decimal)
        ) as recording:
            assert [recording.read(c.name).tolist() for c in recording.channels] == columns

    @pytest.mark.parametrize(
        ("text", "options", "reason"),
        [
            (
                "1 2\n3 4\n",
                ReadingOptions(("a", "b", "c"), 1.0),
                "has 2 columns of numbers .* 3 columns are named",
            ),
            (
                "1 2\n3 4\n",
                ReadingOptions(("a", "b")),
                "'a' has no sampling rate; .*sampling_rate_hz under",
            ),
            ("1 2\n3 x\n", ReadingOptions(("a", "b"), 1.0), "x"),
            ("1 2\n3\n5 6\n", ReadingOptions(("a", "b"), 1.0), "lack 1 numbers"),
            (
                "1;2\n3;4\n",
                ReadingOptions(("a", "b"), 1.0, delimiter=","),
                "as delimiter and decimal are given",
            ),
            (
                "0 1\n0.001 2\n",
                ReadingOptions(("time", "force"), 2000.0),
                "1000.0 Hz, and 2000.0 Hz is given",
            ),
            (
                "# fs = 1000\nforce\n1\n2\n",
                ReadingOptions(sampling_rate_hz=2000.0),
                "and 2000.0 Hz is given for it",
            ),
        ],
    )
    def test_what_contradicts_the_given_facts_is_refused(self, written, text, options, reason):
        with pytest.raises(RecordingError, match=rf"^shot\.csv: .*{reason}"):
            open_recording(written(text), options)


@given(
    values=st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=2, max_size=30),
    gap=st.sampled_from([" ", "   ", "\t", " \t", ",", ", ", ";", " ; ", "|"]),
    ends=st.tuples(st.sampled_from(["", " "]), st.sampled_from(["", " "])),
    comma=st.booleans(),
    heading=st.sampled_from(["none", "names", "names and units", "commented"]),
    line_end=st.sampled_from(["\n", "\r\n", "\r"]),
)
def test_any_table_comes_back_as_it_was_written(
    tmp_path_factory, values, gap, ends, comma, heading, line_end
):
    """Whatever separates, ends and heads the lines, the numbers are those written."""
    comma = comma and "," not in gap
    rows = [gap.join(repr(v) for v in row) for row in values]
    rows = [row.replace(".", ",") for row in rows] if comma else rows
    heads = {
        "names": [gap.join("abc")],
        "names and units": [gap.join("abc"), gap.join(["N", "g", "bar"])],
    }
    heads["commented"] = ["# " + gap.join("abc")]
    lines = heads.get(heading, []) + [ends[0] + row + ends[1] for row in rows]
    path = tmp_path_factory.mktemp("table") / "shot.txt"
    path.write_bytes((line_end.join(lines) + line_end).encode())
    given_facts = ReadingOptions(("a", "b", "c"), 1000.0)
    with open_recording(path, given_facts) as recording:
        for number, name in enumerate("abc"):
            assert recording.read(name).tolist() == [row[number] for row in values]


SHOT = Path("shot.csv")
RATES = [10000.0, 12800.0, 20000.0, 44100.0, 48000.0, 51200.0, 65536.0, 102400.0, 204800.0, 1e6]


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("digits", [5, 6, 9])
def test_a_printed_step_gives_the_round_rate(rate, digits):
    step = float(f"{1 / rate:.{digits}e}")
    assert rate_from_step(step, 5.1 * 10.0 ** -(digits + 1)) == rate


@given(rate=st.floats(1.0, 1e7))
def test_a_rate_stays_within_what_its_step_leaves_open(rate):
    assert rate_from_step(1 / rate, 1e-6) == pytest.approx(rate, rel=1.0001e-6)
