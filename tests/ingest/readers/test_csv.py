"""CSV as laboratories write it: every layout below says the same two channels."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording

FORCE = [0.0, 1.5, -2.25]
ACCELERATION = [10.0, 20.5, 30.0]

#: One recording at 51.2 kHz, force in N and acc in g, as eleven programs would have written it.
LAYOUTS = {
    "comma": "# fs = 51200\nforce [N],acc [g]\n0,10\n1.5,20.5\n-2.25,30\n",
    "semicolon, decimal comma": "fs;51200\nforce [N];acc [g]\n0,0;10\n1,5;20,5\n-2,25;30\n",
    "tab, unit row": "fs: 51200 Hz\nforce\tacc\nN\tg\n0\t10\n1.5\t20.5\n-2.25\t30\n",
    "tab, decimal comma": "Sampling rate [kHz]\t51,2\nforce\tacc\nN\tg\n0\t10\n1,5\t20,5\n-2,25\t30\n",
    "bar": "# fs: 51.2 kHz\nforce (N)|acc (g)\n0|10\n1.5|20.5\n-2.25|30\n",
    "rate column": "fs,force [N],acc [g]\n51200,0,10\n51200,1.5,20.5\n51200,-2.25,30\n",
    "numpy.savetxt": "# force [N],acc [g],fs\n0e+0,1e+1,5.12e+4\n1.5,20.5,51200\n-2.25,30,51200\n",
    "quoted names": '# fs = 51200\n"force [N]","acc [g]"\n0,10\n1.5,20.5\n-2.25,30\n',
    "rows numbered": "# fs = 51200\n,force [N],acc [g]\n0,0,10\n1,1.5,20.5\n2,-2.25,30\n",
    "delimiter at the end": "# fs = 51200\nforce [N],acc [g],\n0,10,\n1.5,20.5,\n-2.25,30,\n",
    "blanks and statements": (
        "Operator;Ana\n\nSampling Rate;51200\n\nforce;acc\n[N];[g]\n 0,0; 10,0\n 1,5; 20,5\n-2,25; 30,0\n\n"
    ),
    "time in microseconds": "time [us],force [N],acc [g]\n0,0,10\n19.53125,1.5,20.5\n39.0625,-2.25,30\n",
    "time in a unit row": "Time;force;acc\nms;N;g\n0,0;0;10\n0,01953125;1,5;20,5\n0,0390625;-2,25;30\n",
    "time named with its unit": "t_ms,force [N],acc [g]\n0,0,10\n0.01953125,1.5,20.5\n0.0390625,-2.25,30\n",
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
        assert [(c.name, c.unit, c.samples) for c in recording.channels] == [("force", "N", 3), ("acc", "g", 3)]
        assert {c.sampling_rate_hz for c in recording.channels} == {51200.0}
        np.testing.assert_array_equal(recording.read("force"), FORCE)
        np.testing.assert_array_equal(recording.read("acc"), ACCELERATION)


@pytest.mark.parametrize("decimal", [".", ","])
def test_one_column_is_read(written, decimal):
    text = "# fs = 51200\nforce\n0.5\n1.5\n2.25\n".replace(".", decimal)
    with open_recording(written(text)) as recording:
        np.testing.assert_array_equal(recording.read("force"), [0.5, 1.5, 2.25])


def test_brackets_without_a_unit_belong_to_the_name(written):
    with open_recording(written("# fs = 51200\nacc (top),force\n1,2\n3,4\n")) as recording:
        assert [(c.name, c.unit) for c in recording.channels] == [("acc (top)", None), ("force", None)]


def test_every_digit_counts(written):
    values = np.random.default_rng(7).normal(size=200) * 10.0 ** np.random.default_rng(8).integers(-300, 300, 200)
    with open_recording(
        written("# fs = 51200\nforce,zero\n" + "".join(f"{v!r},0\n" for v in values.tolist()))
    ) as recording:
        np.testing.assert_array_equal(recording.read("force"), values)


def test_an_empty_field_is_not_a_number(written):
    with open_recording(written("# fs = 51200\nforce,acc\n1,2\n,4\n5,nan\n")) as recording:
        np.testing.assert_array_equal(recording.read("force"), [1, np.nan, 5])
        np.testing.assert_array_equal(recording.read("acc"), [2, 4, np.nan])


def test_statements_above_the_numbers_are_kept(written):
    with open_recording(written(LAYOUTS["blanks and statements"])) as recording:
        assert recording.info("force").header["Operator"] == "Ana"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("# fs = 51200\nforce,acc\n1,2\n3\n5,6\n", "need 3 delimiters, found 2; a line is cut or damaged"),
        ("# fs = 51200\nforce,acc\n1,2\n3,4,5\n6,7\n", "delimiters|fields|header"),
        ("# fs = 51200\nforce,acc\n1,2\n3,4\n5,abc\n", "abc"),
        ("# fs = 51200\n# samples = 3\nforce,acc\n1,2\n3,4\n5,6", "last line has no line end"),
        ("# fs = 51200\n# samples = 4\nforce,acc\n1,2\n3,4\n", "states 4 samples and holds 2"),
        ("# fs = 51200\nforce,acc\n1,2\n3\n", "need 2 delimiters, found 1"),
        ("1,2\n3,4\n", "no line of names"),
        ("# fs = 51200\nforce,acc\n", "no line of numbers"),
        ("# fs = fast\nforce,acc\n1,2\n3,4\n", "'fs' is 'fast'; expected a number in Hz"),
        ("# fs = 51,200\nforce,acc\n1,2\n3,4\n", "'fs' is '51,200'"),
        ("# fs = 51200 rpm\nforce,acc\n1,2\n3,4\n", "'fs' is '51200 rpm'"),
        ("# fs = -5\nforce,acc\n1,2\n3,4\n", "expected a finite number above 0"),
        ("force,acc\n1,2\n3,4\n", "has no sampling rate"),
        ("fs,force\n51200,1\n48000,2\n", "'fs' varies from 48000.0 to 51200.0"),
        ("time [min],force\n0,1\n1,2\n", "'time' is in 'min'; expected one of s, ms, us, ns"),
        ("time,force\n0,1\n2,2\n1,3\n", "time does not increase at sample 2"),
        (b"# fs = 51200\nforce,T [\xb0C]\n1,2\n", r"byte 22 \(0xb0\) is not UTF-8: save the file again as UTF-8"),
        ("force,acc\n1,2\n".encode("utf-16"), "is UTF-16 text; expected UTF-8"),
        (b"# fs = 51200\nforce,acc\n1,\x002\n", "has a zero byte at 25"),
    ],
)
def test_what_is_no_whole_table_is_refused(written, text, reason):
    with pytest.raises(RecordingError, match=rf"^shot\.csv: .*({reason})"), open_recording(written(text)) as recording:
        recording.read("acc")


def test_a_cut_at_a_line_end_is_seen_where_the_samples_are_stated(written):
    text = "# fs = 51200\n# samples = 3\nforce,acc\n1,2\n3,4\n5,6\n"
    with pytest.raises(RecordingError, match="states 3 samples and holds 2"):
        open_recording(written(text[:-4]))


def test_missing_last_line_end_is_told(written):
    with open_recording(written("# fs = 51200\nforce,acc\n1,2\n3,4\n5,6")) as recording:
        assert recording.read("acc").tolist() == [2.0, 4.0, 6.0]
        assert recording.info("acc").header["last_line_without_end"] is True
