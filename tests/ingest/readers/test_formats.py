"""What is particular to one format."""

from __future__ import annotations

import subprocess
import sys

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, RootObject, TdmsFile, TdmsWriter
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from scipy.io import savemat

WAVE = np.round(np.sin(np.arange(64) / 5), 6)


def test_importing_the_readers_loads_no_library_of_a_format():
    code = "import sys, pyroshock.ingest.readers; print(*sorted({m.partition('.')[0] for m in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"pandas", "h5py", "scipy", "nptdms", "pyuff", "pyarrow", "lvm_read", "pint"} & set(loaded)


class TestMat:
    def test_whole_numbers_in_a_double_array_stay_double(self, tmp_path):
        """MATLAB stores them as bytes; the class is what the user saw."""
        path = tmp_path / "small.mat"
        savemat(path, {"fs": 51200.0, "force": np.arange(64, dtype=np.uint8)})
        content = path.read_bytes()
        at = content.index(b"force") - 32  # the flags: class 9 is uint8, 6 is double
        path.write_bytes(content[:at] + content[at : at + 8].replace(b"\x09", b"\x06", 1) + content[at + 8 :])
        with open_recording(path) as recording:
            assert recording.info("force").dtype == recording.read("force").dtype.str == "<f8"
            np.testing.assert_array_equal(recording.read("force"), np.arange(64))

    def test_version_4_is_refused_with_the_command(self, tmp_path):
        path = tmp_path / "old.mat"
        savemat(path, {"fs": 51200.0, "force": WAVE}, format="4")
        with pytest.raises(RecordingError, match=r"not a MATLAB file of version 5 or 7\.3; save it with -v7"):
            open_recording(path)

    def test_a_short_text_becomes_part_of_the_header(self, tmp_path):
        path = tmp_path / "words.mat"
        savemat(path, {"fs": 51200.0, "force": WAVE, "operator": "Ana", "gain": 2.5})
        with open_recording(path) as recording:
            assert recording.info("force").header == {"operator": "Ana", "gain": 2.5}

    def test_version_7_3_agrees_with_pymatreader(self, tmp_path, make_recording):
        pymatreader = pytest.importorskip("pymatreader")
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

    def test_segments_are_one_channel(self, three_parts):
        path, truth = three_parts
        with open_recording(path) as recording:
            np.testing.assert_array_equal(recording.read("force"), truth.channels["force"])
            np.testing.assert_array_equal(recording.read("force", 30, 70), truth.channels["force"][30:70])

    def test_a_cut_inside_raw_samples_is_refused_where_nptdms_gives_fewer(self, three_parts, tmp_path, capfd):
        path, truth = three_parts
        cut = tmp_path / "cut.tdms"
        cut.write_bytes(path.read_bytes()[:-40])
        fewer = TdmsFile.read(cut)["shot"]["counts"][:]
        assert len(fewer) < truth.channels["counts"].size
        capfd.readouterr()
        with pytest.raises(RecordingError, match=r"cut\.tdms: is cut: \d+ bytes, and its last segment ends at \d+"):
            open_recording(cut)
        assert capfd.readouterr().err == ""

    def test_a_segment_that_labview_never_closed_is_refused(self, three_parts):
        path, _ = three_parts
        content = bytearray(path.read_bytes())
        last = content.rindex(b"TDSm")
        content[last + 12 : last + 20] = b"\xff" * 8
        path.write_bytes(content)
        with pytest.raises(RecordingError, match="was never closed by its writer"):
            open_recording(path)

    def test_a_scaling_is_applied(self, tmp_path):
        path = tmp_path / "scaled.tdms"
        scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear"}
        slope = {"NI_Scale[0]_Linear_Slope": 0.5, "NI_Scale[0]_Linear_Y_Intercept": 1.0}
        raw = np.arange(64, dtype=np.int16)
        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("a", "force", raw, {**scale, **slope, "wf_increment": 1 / 51200})])
        with open_recording(path) as recording:
            assert recording.info("force").dtype == "<f8"
            np.testing.assert_array_equal(recording.read("force", 10, 20), raw[10:20] * 0.5 + 1.0)

    def test_an_unknown_scaling_is_refused_where_nptdms_warns(self, tmp_path):
        path = tmp_path / "unknown.tdms"
        scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Astrology"}
        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("a", "force", WAVE, {**scale, "wf_increment": 1 / 51200})])
        with pytest.raises(RecordingError, match=r"Astrology|scal"), open_recording(path) as recording:
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
    def test_a_missing_last_tag_is_refused_where_pyuff_drops_the_set(self, tmp_path, make_recording):
        path = tmp_path / "open.uff"
        make_recording("uff", path)
        path.write_bytes(path.read_bytes().rstrip()[:-6])
        with pytest.raises(RecordingError, match="do not enclose whole data sets"):
            open_recording(path)

    def test_fewer_values_than_declared_are_refused(self, tmp_path, make_recording):
        path = tmp_path / "fewer.uff"
        make_recording("uff", path)
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(lines[:20] + lines[21:]))
        with open_recording(path) as recording, pytest.raises(RecordingError, match="declares 96 samples and holds 92"):
            recording.read("force")


class TestLvm:
    @pytest.mark.parametrize("x_columns", ["No", "One"])
    @pytest.mark.parametrize("decimal", [".", ","])
    def test_both_decimal_signs_and_both_layouts(self, tmp_path, make_recording, decimal, x_columns):
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
    def test_a_header_that_contradicts_the_numbers_is_refused(self, tmp_path, make_recording, found, instead, reason):
        path = tmp_path / "hit.lvm"
        make_recording("lvm", path)
        text = path.read_text()
        assert found in text
        path.write_text(text.replace(found, instead))
        with pytest.raises(RecordingError, match=reason):
            open_recording(path)

    def test_a_field_that_is_no_number_is_refused_where_lvm_read_gives_nan(self, tmp_path, make_recording):
        path = tmp_path / "hit.lvm"
        make_recording("lvm", path, decimal=",")
        path.write_text(path.read_text().replace("Decimal_Separator\t,", "Decimal_Separator\t."))  # denies the comma
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
        path.write_text(path.read_text().replace("\t", ",").replace("Separator,Tab", "Separator,Comma"))
        with open_recording(path) as recording:
            assert recording.info("force").unit == "N"
            assert recording.info("force").sampling_rate_hz == truth.rate_hz
            for name, written in truth.channels.items():
                np.testing.assert_array_equal(recording.read(name), written)


class TestLvmWithoutHeader:
    """Numbers alone: the rate is the laboratory's, or in the X column."""

    @pytest.mark.parametrize("delimiter", ["\t", ","])
    def test_the_x_column_gives_the_rate(self, tmp_path, delimiter):
        np.savetxt(tmp_path / "hit.lvm", np.column_stack([np.arange(64) / 51200, WAVE]), "%.9f", delimiter)
        with open_recording(tmp_path / "hit.lvm", ReadingOptions(("time", "force"))) as recording:
            assert recording.info("force").sampling_rate_hz == 51200.0
            np.testing.assert_array_equal(recording.read("force"), WAVE)

    def test_the_given_rate_holds_for_columns_alone(self, tmp_path):
        np.savetxt(tmp_path / "hit.lvm", np.column_stack([WAVE, -WAVE]), "%.6f", "\t")
        with open_recording(tmp_path / "hit.lvm", ReadingOptions(("force", "acc"), 51200.0)) as recording:
            np.testing.assert_array_equal(recording.read("acc"), -WAVE)

    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            ("force\tacc\n1\t2\n", "starts with 'force"),
            ("51200\n\nforce\tacc\n1\t2\n3\t4\n", "has text above its numbers, but no header of LabVIEW"),
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
            assert {c.name: c.sampling_rate_hz for c in recording.channels} == {"force": 51200.0, "pressure": 1000.0}

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
