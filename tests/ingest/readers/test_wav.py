"""WAV, read back from what scipy and the standard library wrote."""

from __future__ import annotations

import struct
import wave

import numpy as np
import pytest
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from scipy.io import wavfile

RATE_HZ = 51200
WAVE = np.column_stack([np.sin(np.arange(200) / 7), np.linspace(-1, 0.999, 200)])
#: The head of the samples: 800 bytes.
SIZE = b"data" + struct.pack("<I", 800)


@pytest.mark.parametrize(
    ("dtype", "full_scale", "read_as"),
    [("i2", 2**15, "<f4"), ("i4", 2**31, "<f8"), ("f4", 1.0, "<f4"), ("f8", 1.0, "<f8")],
)
@pytest.mark.parametrize("channels", [1, 2])
def test_samples_are_shares_of_the_full_scale(tmp_path, dtype, full_scale, read_as, channels):
    written = (WAVE[:, :channels] * full_scale).astype(dtype)
    wavfile.write(tmp_path / "shot.wav", RATE_HZ, written)
    with open_recording(tmp_path / "shot.wav") as recording:
        assert [c.name for c in recording.channels] == [f"ch{i + 1}" for i in range(channels)]
        for number, channel in enumerate(recording.channels):
            assert (channel.sampling_rate_hz, channel.unit, channel.dtype) == (RATE_HZ, None, read_as)
            read = recording.read(channel.name)
            np.testing.assert_array_equal(read.astype(float), written[:, number].astype(float) / full_scale)


@pytest.mark.parametrize(("bytes_each", "zero"), [(1, 128), (3, 0)])
def test_eight_and_24_bits_are_exact(tmp_path, bytes_each, zero):
    full_scale = 2 ** (8 * bytes_each - 1)
    counts = np.random.default_rng(1).integers(-full_scale, full_scale, (50, 2))
    with wave.open(str(tmp_path / "shot.wav"), "wb") as file:
        file.setparams((2, bytes_each, RATE_HZ, 0, "NONE", ""))
        packed = (int(n + zero).to_bytes(bytes_each, "little", signed=zero == 0) for n in counts.ravel())
        file.writeframes(b"".join(packed))
    with open_recording(tmp_path / "shot.wav") as recording:
        np.testing.assert_array_equal(recording.read("ch2") * full_scale, counts[:, 1])


def test_columns_name_the_channels(tmp_path):
    wavfile.write(tmp_path / "shot.wav", RATE_HZ, WAVE.astype("f4"))
    with open_recording(tmp_path / "shot.wav", ReadingOptions(("force [V]", "acc"))) as recording:
        assert [(c.name, c.unit) for c in recording.channels] == [("force", "V"), ("acc", None)]
        np.testing.assert_array_equal(recording.read("acc", 3, 9), WAVE[3:9, 1].astype("f4"))
    with open_recording(tmp_path / "shot.wav", ReadingOptions(("", "acc"))) as recording:
        assert [c.name for c in recording.channels] == ["acc"]
    with pytest.raises(RecordingError, match=r"has 2 channels, and 1 columns are named \(force\)"):
        open_recording(tmp_path / "shot.wav", ReadingOptions(("force",)))
    with pytest.raises(RecordingError, match=r"sampling rate of 51200.0 Hz, and 48000.0 Hz is given for it"):
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
    wavfile.write(path, RATE_HZ, (WAVE * 1000).astype("i2"))
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    with pytest.raises(RecordingError, match=rf"^shot\.wav: .*{reason}"):
        open_recording(path)
