"""What is particular to one format."""

from __future__ import annotations

import struct
import subprocess
import sys
import wave

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, RootObject, TdmsFile, TdmsWriter
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from pyroshock.ingest.readers.ide import refuse_cut
from scipy.io import savemat, wavfile

WAVE = np.round(np.sin(np.arange(64) / 5), 6)


def test_importing_the_readers_loads_no_library_of_a_format():
    code = (
        "import sys, pyroshock.ingest.readers; "
        "print(*sorted({m.partition('.')[0] for m in sys.modules}))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"pandas", "h5py", "scipy", "nptdms", "pyuff", "pyarrow", "lvm_read", "pint"} & set(
        loaded
    )


class TestMat:
    def test_whole_numbers_in_a_double_array_stay_double(self, tmp_path):
        """MATLAB stores them as bytes; the class is what the user saw."""
        path = tmp_path / "small.mat"
        savemat(path, {"fs": 51200.0, "force": np.arange(64, dtype=np.uint8)})
        content = path.read_bytes()
        at = content.index(b"force") - 32  # the flags: class 9 is uint8, 6 is double
        path.write_bytes(
            content[:at] + content[at : at + 8].replace(b"\x09", b"\x06", 1) + content[at + 8 :]
        )
        with open_recording(path) as recording:
            assert recording.info("force").dtype == recording.read("force").dtype.str == "<f8"
            np.testing.assert_array_equal(recording.read("force"), np.arange(64))

    def test_version_4_is_refused_and_a_short_text_kept_in_the_header(self, tmp_path):
        path = tmp_path / "old.mat"
        savemat(path, {"fs": 51200.0, "force": WAVE}, format="4")
        with pytest.raises(
            RecordingError, match=r"not a MATLAB file of version 5 or 7\.3; save it with -v7"
        ):
            open_recording(path)
        path = tmp_path / "words.mat"
        savemat(path, {"fs": 51200.0, "force": WAVE, "operator": "Ana", "humidity": 2.5})
        with open_recording(path) as recording:
            assert recording.info("force").header == {"operator": "Ana", "humidity": 2.5}

    def test_version_7_3_agrees_with_pymatreader(self, tmp_path, make_recording):
        import pymatreader

        path = tmp_path / "shot.mat"
        make_recording("mat73", path)
        peer = pymatreader.read_mat(str(path))
        with open_recording(path) as recording:
            assert peer["fs"] == recording.info("force").sampling_rate_hz
            assert peer["operator"] == recording.info("force").header["operator"]
            for channel in recording.channels:
                np.testing.assert_array_equal(recording.read(channel.name), peer[channel.name])


class TestTdms:
    @pytest.fixture
    def three_parts(self, tmp_path, make_recording):
        path = tmp_path / "parts.tdms"
        return path, make_recording("tdms", path, parts=3)

    def test_segments_are_one_channel_and_each_must_be_closed(self, three_parts):
        path, truth = three_parts
        with open_recording(path) as recording:
            np.testing.assert_array_equal(recording.read("force"), truth.channels["force"])
            np.testing.assert_array_equal(
                recording.read("force", 30, 70), truth.channels["force"][30:70]
            )
        path, _ = three_parts
        content = bytearray(path.read_bytes())
        last = content.rindex(b"TDSm")
        content[last + 12 : last + 20] = b"\xff" * 8
        path.write_bytes(content)
        with pytest.raises(RecordingError, match="was never closed by its writer"):
            open_recording(path)

    def test_a_cut_inside_raw_samples_is_refused_where_nptdms_gives_fewer(
        self, three_parts, tmp_path, capfd
    ):
        path, truth = three_parts
        cut = tmp_path / "cut.tdms"
        cut.write_bytes(path.read_bytes()[:-40])
        fewer = TdmsFile.read(cut)["shot"]["counts"][:]
        assert len(fewer) < truth.channels["counts"].size
        capfd.readouterr()
        with pytest.raises(
            RecordingError, match=r"cut\.tdms: is cut: \d+ bytes, and its last segment ends at \d+"
        ):
            open_recording(cut)
        assert capfd.readouterr().err == ""

    def test_scalings_are_applied_or_refused_where_nptdms_warns(self, tmp_path):
        path = tmp_path / "scaled.tdms"
        scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear"}
        slope = {"NI_Scale[0]_Linear_Slope": 0.5, "NI_Scale[0]_Linear_Y_Intercept": 1.0}
        raw = np.arange(64, dtype=np.int16)
        with TdmsWriter(path) as writer:
            writer.write_segment(
                [ChannelObject("a", "force", raw, {**scale, **slope, "wf_increment": 1 / 51200})]
            )
        with open_recording(path) as recording:
            assert recording.info("force").dtype == "<f8"
            np.testing.assert_array_equal(recording.read("force", 10, 20), raw[10:20] * 0.5 + 1.0)
        path = tmp_path / "unknown.tdms"
        scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Astrology"}
        with TdmsWriter(path) as writer:
            writer.write_segment(
                [ChannelObject("a", "force", WAVE, {**scale, "wf_increment": 1 / 51200})]
            )
        with (
            pytest.raises(RecordingError, match=r"Astrology|scal"),
            open_recording(path) as recording,
        ):
            recording.read("force")

    def test_equal_names_in_two_groups_carry_their_group(self, tmp_path):
        path = tmp_path / "groups.tdms"
        with TdmsWriter(path) as writer:
            channels = [ChannelObject(g, "force", WAVE * k) for k, g in enumerate(("gun", "plate"))]
            channels.append(ChannelObject("gun", "notes", ["x", "y"]))  # text is no channel
            writer.write_segment([RootObject({"fs": 51200.0}), *channels])
        with open_recording(path) as recording:
            assert [c.name for c in recording.channels] == ["gun/force", "plate/force"]
            np.testing.assert_array_equal(recording.read("plate/force"), WAVE)


class TestUff:
    def test_a_missing_last_tag_and_fewer_values_are_refused(self, tmp_path, make_recording):
        path = tmp_path / "open.uff"
        make_recording("uff", path)
        path.write_bytes(path.read_bytes().rstrip()[:-6])
        with pytest.raises(RecordingError, match="do not enclose whole data sets"):
            open_recording(path)
        path = tmp_path / "fewer.uff"
        make_recording("uff", path)
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(lines[:20] + lines[21:]))
        with (
            open_recording(path) as recording,
            pytest.raises(RecordingError, match="declares 96 samples and holds 92"),
        ):
            recording.read("force")


class TestLvm:
    @pytest.mark.parametrize("x_columns", ["No", "One"])
    @pytest.mark.parametrize("decimal", [".", ","])
    def test_both_decimal_signs_and_both_layouts(
        self, tmp_path, make_recording, decimal, x_columns
    ):
        path = tmp_path / "hit.lvm"
        truth = make_recording("lvm", path, decimal=decimal, x_columns=x_columns)
        with open_recording(path) as recording:
            assert recording.info("force").sampling_rate_hz == truth.rate_hz
            for name, written in truth.channels.items():
                np.testing.assert_array_equal(recording.read(name), written)

    @pytest.mark.parametrize(
        ("found", "instead", "reason"),
        [
            ("Samples\t96\t96\t96", "Samples\t97\t97\t97", "declares 97 samples and holds 96"),
            ("X_Columns\tNo", "X_Columns\tMulti", "X_Columns is 'Multi'; expected No or One"),
            ("Separator\tTab", "Separator\tPipe", "Separator is 'Pipe'"),
            ("Delta_X\t1.953125E-05", "Delta_X\t0.000000E+00", r"Delta_X is 0\.0 s"),
            ("LabVIEW Measurement", "LabVIEW Something", "expected 'LabVIEW Measurement'"),
        ],
    )
    def test_a_header_that_contradicts_the_numbers_is_refused(
        self, tmp_path, make_recording, found, instead, reason
    ):
        path = tmp_path / "hit.lvm"
        make_recording("lvm", path)
        text = path.read_text()
        assert found in text
        path.write_text(text.replace(found, instead))
        with pytest.raises(RecordingError, match=reason):
            open_recording(path)

    def test_a_field_that_is_no_number_is_refused_where_lvm_read_gives_nan(
        self, tmp_path, make_recording
    ):
        path = tmp_path / "hit.lvm"
        make_recording("lvm", path, decimal=",")
        path.write_text(
            path.read_text().replace("Decimal_Separator\t,", "Decimal_Separator\t.")
        )  # denies the comma
        with pytest.raises(RecordingError, match=r"hit\.lvm: "):
            open_recording(path)
        make_recording("lvm", path)
        lines = path.read_text().splitlines(keepends=True)
        lines[40] = "\tabc\t1.0\t2.0\n"
        path.write_text("".join(lines))
        with pytest.raises(RecordingError, match="1 fields are not numbers"):
            open_recording(path)

    def test_commas_separate_where_the_header_says_so(self, tmp_path, make_recording):
        path = tmp_path / "hit.lvm"
        truth = make_recording("lvm", path, x_columns="One")
        path.write_text(
            path.read_text().replace("\t", ",").replace("Separator,Tab", "Separator,Comma")
        )
        with open_recording(path) as recording:
            assert recording.info("force").unit == "N"
            assert recording.info("force").sampling_rate_hz == truth.rate_hz
            for name, written in truth.channels.items():
                np.testing.assert_array_equal(recording.read(name), written)


class TestLvmWithoutHeader:
    """Numbers alone: the rate is the laboratory's, or in the X column."""

    @pytest.mark.parametrize("delimiter", ["\t", ","])
    def test_the_x_column_gives_the_rate(self, tmp_path, delimiter):
        np.savetxt(
            tmp_path / "hit.lvm", np.column_stack([np.arange(64) / 51200, WAVE]), "%.9f", delimiter
        )
        with open_recording(tmp_path / "hit.lvm", ReadingOptions(("time", "force"))) as recording:
            assert recording.info("force").sampling_rate_hz == 51200.0
            np.testing.assert_array_equal(recording.read("force"), WAVE)

    def test_the_given_rate_holds_for_columns_alone(self, tmp_path):
        np.savetxt(tmp_path / "hit.lvm", np.column_stack([WAVE, -WAVE]), "%.6f", "\t")
        with open_recording(
            tmp_path / "hit.lvm", ReadingOptions(("force", "acc"), 51200.0)
        ) as recording:
            np.testing.assert_array_equal(recording.read("acc"), -WAVE)

    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            ("force\tacc\n1\t2\n", "starts with 'force"),
            (
                "51200\n\nforce\tacc\n1\t2\n3\t4\n",
                "has text above its numbers, but no header of LabVIEW",
            ),
            ("1\t2\n3\t4", "its last line has no line end"),
            ("1\t2\n3\n", "a line is cut or damaged"),
        ],
    )
    def test_anything_but_numbers_is_refused(self, tmp_path, text, reason):
        (tmp_path / "hit.lvm").write_text(text)
        with pytest.raises(RecordingError, match=rf"^hit\.lvm: .*{reason}"):
            open_recording(tmp_path / "hit.lvm", ReadingOptions(("force", "acc"), 51200.0))


class TestHdf5:
    def test_the_rate_of_a_group_holds_for_what_is_below_it(self, tmp_path):
        path = tmp_path / "groups.h5"
        with h5py.File(path, "w") as file:
            file.attrs["fs"] = 51200.0
            file["slow/pressure"], file["bench/force"], file["slow/fs"] = WAVE, WAVE, 1000.0
        with open_recording(path) as recording:
            assert {c.name: c.sampling_rate_hz for c in recording.channels} == {
                "force": 51200.0,
                "pressure": 1000.0,
            }

    def test_a_slice_reads_only_its_chunks(self, tmp_path):
        """The last chunk is damaged: a slice before it must not care, one that touches it must."""
        path = tmp_path / "chunks.h5"
        with h5py.File(path, "w") as file:
            file["fs"] = 51200.0
            file.create_dataset("force", data=WAVE, chunks=(16,), fletcher32=True)
        content = bytearray(path.read_bytes())
        content[content.index(WAVE[60].tobytes())] ^= 1
        path.write_bytes(content)
        with open_recording(path) as recording:
            np.testing.assert_array_equal(recording.read("force", 0, 48), WAVE[:48])
            with pytest.raises(RecordingError):
                recording.read("force", 40, 64)


def test_whole_elements_are_taken_where_the_library_is_there(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "idelib", None)
    path = tmp_path / "shot.ide"
    path.write_bytes(b"\x1a\x45\xdf\xa3\x80")
    with pytest.raises(
        RecordingError, match=r"idelib, which is not installed; pip install 'pyroshock\[ide\]'"
    ):
        open_recording(path)
    # lengths of one byte, of two, and none
    (tmp_path / "shot.ide").write_bytes(b"\x1a\x45\xdf\xa3\x81x" + b"\xa1\x40\x03xyz" + b"\xec\x80")
    refuse_cut(tmp_path / "shot.ide")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"RIFF", "does not start as an EBML file"),
        (b"\x1a\x45\xdf\xa3\x82\x00", "is cut: 6 bytes, and an element ends at byte 7"),
        (b"\x1a\x45\xdf\xa3\x80\x00\x80", "no whole element starts at byte 5"),
        (b"\x1a\x45\xdf\xa3\x80\xa1", "no whole element starts at byte 5"),
    ],
)
def test_elements_that_are_not_whole_are_refused(tmp_path, content, reason):
    (tmp_path / "shot.ide").write_bytes(content)
    with pytest.raises(RecordingError, match=rf"^shot\.ide: .*{reason}"):
        refuse_cut(tmp_path / "shot.ide")


@pytest.fixture
def shot(make_recording, tmp_path):
    """A file and what it holds; `scaled` writes another time scale into it."""
    path = tmp_path / "shot.ide"
    return path, make_recording("ide", path)


def scaled(path, expression):
    content = path.read_bytes()
    assert content.count(b"1.0/50000") == 1
    path.write_bytes(content.replace(b"1.0/50000", expression))


def test_the_recorder_is_told_in_the_header_and_a_time_scale_can_be_a_number(shot):
    path, truth = shot
    with open_recording(path) as recording:
        header = recording.info("force").header
        assert (header["ProductName"], header["RecorderSerial"], header["sensor"]) == (
            "Slam Stick C",
            428,
            "Load cell",
        )
        np.testing.assert_array_equal(recording.read("force", 5, 9), truth.channels["force"][5:9])
    scaled(path, b"  0.00004")
    with open_recording(path) as recording:
        assert recording.info("force").sampling_rate_hz == 25_000.0


@pytest.mark.parametrize("expression", [b"9**9**9*9", b"().__x__ ", b"1.0/0.000", b"exp(1)/20"])
def test_a_time_scale_is_never_run(shot, expression):
    scaled(shot[0], expression)
    with pytest.raises(RecordingError, match=r"^shot\.ide: .*is no number and no ratio of two"):
        open_recording(shot[0])


RATE_HZ = 51200
TWO_WAVES = np.column_stack([np.sin(np.arange(200) / 7), np.linspace(-1, 0.999, 200)])
#: The head of the samples: 800 bytes.
SIZE = b"data" + struct.pack("<I", 800)


@pytest.mark.parametrize(
    ("dtype", "full_scale", "read_as"),
    [("i2", 2**15, "<f4"), ("i4", 2**31, "<f8"), ("f4", 1.0, "<f4"), ("f8", 1.0, "<f8")],
)
@pytest.mark.parametrize("channels", [1, 2])
def test_samples_are_shares_of_the_full_scale(tmp_path, dtype, full_scale, read_as, channels):
    written = (TWO_WAVES[:, :channels] * full_scale).astype(dtype)
    wavfile.write(tmp_path / "shot.wav", RATE_HZ, written)
    with open_recording(tmp_path / "shot.wav") as recording:
        assert [c.name for c in recording.channels] == [f"ch{i + 1}" for i in range(channels)]
        for number, channel in enumerate(recording.channels):
            assert (channel.sampling_rate_hz, channel.unit, channel.dtype) == (
                RATE_HZ,
                None,
                read_as,
            )
            read = recording.read(channel.name)
            np.testing.assert_array_equal(
                read.astype(float), written[:, number].astype(float) / full_scale
            )


@pytest.mark.parametrize(("bytes_each", "zero"), [(1, 128), (3, 0)])
def test_eight_and_24_bits_are_exact(tmp_path, bytes_each, zero):
    full_scale = 2 ** (8 * bytes_each - 1)
    counts = np.random.default_rng(1).integers(-full_scale, full_scale, (50, 2))
    with wave.open(str(tmp_path / "shot.wav"), "wb") as file:
        file.setparams((2, bytes_each, RATE_HZ, 0, "NONE", ""))
        packed = (
            int(n + zero).to_bytes(bytes_each, "little", signed=zero == 0) for n in counts.ravel()
        )
        file.writeframes(b"".join(packed))
    with open_recording(tmp_path / "shot.wav") as recording:
        np.testing.assert_array_equal(recording.read("ch2") * full_scale, counts[:, 1])


def test_columns_name_the_channels(tmp_path):
    wavfile.write(tmp_path / "shot.wav", RATE_HZ, TWO_WAVES.astype("f4"))
    with open_recording(tmp_path / "shot.wav", ReadingOptions(("force [V]", "acc"))) as recording:
        assert [(c.name, c.unit) for c in recording.channels] == [("force", "V"), ("acc", None)]
        np.testing.assert_array_equal(recording.read("acc", 3, 9), TWO_WAVES[3:9, 1].astype("f4"))
    with open_recording(tmp_path / "shot.wav", ReadingOptions(("", "acc"))) as recording:
        assert [c.name for c in recording.channels] == ["acc"]
    with pytest.raises(RecordingError, match=r"has 2 channels, and 1 columns are named \(force\)"):
        open_recording(tmp_path / "shot.wav", ReadingOptions(("force",)))
    with pytest.raises(
        RecordingError, match=r"sampling rate of 51200.0 Hz, and 48000.0 Hz is given for it"
    ):
        open_recording(tmp_path / "shot.wav", ReadingOptions(sampling_rate_hz=48000.0))


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (SIZE, b"data" + struct.pack("<I", 0xFFFFFFF0), "is cut: a part of it ends at byte"),
        (SIZE, b"data" + struct.pack("<I", 799), "do not go into 799 bytes in blocks of 4"),
        (b"fmt ", b"fmt_", "has no chunks 'fmt ' and 'data'"),
        (struct.pack("<HH", 1, 2), struct.pack("<HH", 6, 2), "format 6 with 16 bits; expected PCM"),
        (struct.pack("<HH", 1, 2), struct.pack("<HH", 1, 0), "0 channels of 16 bits"),
        (b"RIFF", b"RF64", "RF64 is not read"),
    ],
)
def test_what_is_no_whole_file_is_refused(tmp_path, old, new, reason):
    path = tmp_path / "shot.wav"
    wavfile.write(path, RATE_HZ, (TWO_WAVES * 1000).astype("i2"))
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    with pytest.raises(RecordingError, match=rf"^shot\.wav: .*{reason}"):
        open_recording(path)
