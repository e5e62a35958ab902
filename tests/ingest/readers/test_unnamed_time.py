"""A column that may be time is time, or the message asks; nobody's rate is taken beside it
unseen."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.folder.new_folder import start_folder
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording

SAMPLES = 200
VALUES = 100 * np.sin(np.arange(SAMPLES) / 9)
TIME_S = np.arange(SAMPLES) / 40_000


def table(path, label, times, digits=9):
    rows = [f"{t:.{digits}f},{v:.4f}" for t, v in zip(times, VALUES, strict=True)]
    path.write_text("\n".join([f"{label},acc [g]", *rows]) + "\n", encoding="utf-8")
    return path


def rate_of(path, **options):
    with open_recording(path, ReadingOptions(**options)) as recording:
        assert [channel.name for channel in recording.channels] == ["acc"]
        return recording.info("acc").sampling_rate_hz


@pytest.mark.parametrize(
    ("label", "scale"),
    [
        ("Zeit [ms]", 1e3), ("Temps (ms)", 1e3), ("Tiempo (us)", 1e6), ("(ms)", 1e3),
        ("t [ms]", 1e3), ("時間", 1), ("Time (min)", 1 / 60), ("X_Value", 1),
        ("Abszisse [ms]", 1e3), ("Achse 1 [s]", 1), ("Kanal 1 (us)", 1e6),
    ],
)  # fmt: skip
def test_time_by_word_or_unit(tmp_path, label, scale):
    path = table(tmp_path / "hit.csv", label, TIME_S * scale, 12)
    assert rate_of(path) == pytest.approx(40_000, rel=1e-5)
    with pytest.raises(RecordingError, match=r"and 51200\.0 Hz is given for it"):
        rate_of(path, sampling_rate_hz=51200.0)


def test_column_that_rises_evenly_beside_another_rate_is_asked_for(tmp_path):
    path = table(tmp_path / "hit.csv", "Abszisse", TIME_S)
    with pytest.raises(
        RecordingError,
        match=r"'Abszisse' rises evenly by 2\.5e-05, as time does.*51200 Hz.*columns =",
    ):
        rate_of(path, sampling_rate_hz=51200.0)
    with open_recording(
        path, ReadingOptions(sampling_rate_hz=51200.0, harmless_fields=("Abszisse",))
    ) as recording:
        assert recording.info("acc").sampling_rate_hz == 51200


@pytest.mark.parametrize("scale", [1, 1e3, 1e6])
def test_column_that_rises_as_the_given_rate_does_is_no_question(tmp_path, scale):
    path = table(tmp_path / "hit.csv", "Abszisse", TIME_S * scale)
    with open_recording(path, ReadingOptions(sampling_rate_hz=40_000.0)) as recording:
        assert recording.info("acc").sampling_rate_hz == 40_000


def test_file_without_rate_names_the_column(tmp_path):
    with pytest.raises(
        RecordingError, match=r"no sampling rate.*'Abszisse' rises evenly by 2\.5e-05: name it time"
    ):
        rate_of(table(tmp_path / "hit.csv", "Abszisse", TIME_S))


@pytest.mark.parametrize("label", ["Sample", "No.", "index"])
def test_column_that_counts_samples_is_no_time(tmp_path, label):
    path = table(tmp_path / "hit.csv", label, np.arange(SAMPLES), 0)
    with open_recording(path, ReadingOptions(sampling_rate_hz=51200.0)) as recording:
        assert recording.info("acc").sampling_rate_hz == 51200


def test_channel_in_ms_that_does_not_rise_is_a_channel(tmp_path):
    np.savez(tmp_path / "hit.npz", t=TIME_S, width=VALUES)
    path = tmp_path / "gate.csv"
    path.write_text(
        "# fs = 1000\ngate [ms],acc [g]\n" + "".join(f"{v:.3f},{-v:.3f}\n" for v in VALUES)
    )
    with open_recording(path) as recording:
        assert [channel.name for channel in recording.channels] == ["gate", "acc"]


def test_new_campaign_asks_for_the_column_too(tmp_path):
    (tmp_path / "recordings").mkdir()
    table(tmp_path / "recordings" / "a.csv", "Zeit [ms]", TIME_S * 1e3)
    campaign = start_folder(tmp_path, "drop").campaign
    assert "sampling_rate_hz" not in campaign and '[channels."Zeit' not in campaign
    table(tmp_path / "recordings" / "b.csv", "Abszisse", TIME_S)
    (note,) = start_folder(tmp_path, "drop").notes
    assert "b.csv is left out" in note and "'Abszisse' rises evenly" in note
