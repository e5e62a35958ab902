"""`[recordings]` of campaign.toml: facts of files that do not say them."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.extraction.channels import read_channels
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.folder.recording_options import reading_options
from pyroshock.ingest.readers import ReadingOptions, RecordingError
from scipy.io import savemat, wavfile
from support.stores.stores import ingested

TOML = """\
[campaign]
name = "bare"
kind = "hammer"
date = 2026-11-24

[recordings]
columns = ["Time [ms]", "Force  1", "acc"]

[channels."Force 1"]
quantity = "force"
unit = "kN"

[channels.acc]
quantity = "acceleration"
unit = "g"
"""


def test_nothing_said_is_nothing_given():
    assert reading_options({}) == ReadingOptions()


@pytest.mark.parametrize(
    ("table", "options"),
    [
        ({"columns": ["time", " force [N] "]}, ReadingOptions(("time", "force [N]"))),
        ({"sampling_rate_hz": 51200}, ReadingOptions(sampling_rate_hz=51200.0)),
        ({"delimiter": "blanks", "decimal": ","}, ReadingOptions(delimiter=" ", decimal=",")),
        (
            {"harmless_fields": ["Trigger *", "gain"]},
            ReadingOptions(harmless_fields=("Trigger *", "gain")),
        ),
        ({"uneven_time": "resample"}, ReadingOptions(resample_uneven_time=True)),
        ({"uneven_time": "refuse"}, ReadingOptions()),
        ({"delimiter": "tab", "columns": ["", "a"]}, ReadingOptions(("", "a"), delimiter="\t")),
    ],
)
def test_every_key_is_read(table, options):
    assert reading_options({"recordings": table}) == options


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ([1], r"'recordings' is \[1\]; expected a table \[recordings\]"),
        (
            {"column": ["a"]},
            "unknown key 'recordings.column'; known: columns, sampling_rate_hz, delimiter, decimal",
        ),
        (
            {"columns": "time"},
            "recordings.columns is 'time'; expected the names of all columns in order",
        ),
        ({"columns": []}, r"recordings.columns is \[\]; expected the names"),
        ({"columns": [""]}, r"recordings.columns is \[''\]; expected the names"),
        ({"columns": ["a", 2]}, r"recordings.columns is \['a', 2\]; expected the names"),
        ({"columns": ["a\nb"]}, r"recordings.columns is .* each on one line"),
        ({"columns": ["a", "b", "a"]}, "recordings.columns names 'a' twice"),
        ({"columns": ["a"] * 2000}, "recordings.columns is"),
        (
            {"sampling_rate_hz": 0},
            "recordings.sampling_rate_hz is 0; expected a number above zero, in hertz",
        ),
        ({"sampling_rate_hz": float("nan")}, "recordings.sampling_rate_hz is nan"),
        ({"sampling_rate_hz": True}, "recordings.sampling_rate_hz is True"),
        ({"sampling_rate_hz": 10**400}, "recordings.sampling_rate_hz is 1000"),
        (
            {"harmless_fields": "gain"},
            "recordings.harmless_fields is 'gain'; expected the names of fields",
        ),
        (
            {"harmless_fields": [" "]},
            r"recordings.harmless_fields is \[' '\]; expected the names of fields",
        ),
        (
            {"uneven_time": "yes"},
            """recordings.uneven_time is 'yes'; expected "refuse" or "resample\"""",
        ),
        ({"uneven_time": True}, "recordings.uneven_time is True; expected"),
        ({"delimiter": "comma"}, "recordings.delimiter is 'comma'; expected"),
        ({"decimal": ";"}, r'''recordings.decimal is ';'; expected "." or ","'''),
        (
            {"decimal": ",", "delimiter": ","},
            "recordings.delimiter and recordings.decimal are both ','",
        ),
    ],
)
def test_what_is_not_understood_is_refused(table, reason):
    with pytest.raises(IngestError, match=rf"^campaign\.toml: {reason}"):
        reading_options({"recordings": table})


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "campaign.toml").write_text(TOML, encoding="utf-8")
    np.savetxt(tmp_path / "hit.txt", [[0, 1, 10], [0.5, 2, 20], [1, 3, 30]], "%10.3f", " ")
    return tmp_path


def test_numbers_alone_become_the_channels_and_a_unit_is_held_against_them(folder):
    file = read_campaign_file(folder)
    channels, findings = read_channels(folder / "hit.txt", file.sensors, file.reading)
    assert [(c.name, c.sampling_rate_hz) for c in channels] == [
        ("Force 1", 2000.0),
        ("acc", 2000.0),
    ]
    np.testing.assert_allclose(channels[0].si, [1000, 2000, 3000])
    assert findings == []  # `Force  1` of the file is the declared `Force 1`
    text = TOML.replace('"acc"]', '"acc [m/s2]"]')
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    file = read_campaign_file(folder)
    with pytest.raises(
        RecordingError, match=r"channel 'acc' is in 'm/s2' by the file, in 'g' by campaign.toml"
    ):
        read_channels(folder / "hit.txt", file.sensors, file.reading)


@pytest.mark.parametrize(
    ("unit", "quantity", "declared"),
    [
        ("kN", "force", "N"),
        ("lbf", "force", "N"),
        ("psi", "pressure", "bar"),
        ("ips", "velocity", "m/s"),
    ],
)
@pytest.mark.parametrize("heading", ["time,x [{}]", "time,x\ns,{}", "time x\ns {}"])
def test_units_of_every_kind_of_heading_are_held_against_the_channels(
    tmp_path, heading, unit, quantity, declared
):
    toml = TOML.split("[recordings]")[0] + f'[channels.x]\nquantity = "{quantity}"\nunit = "{{}}"\n'
    gap = "," if "," in heading else " "
    (tmp_path / "a.csv").write_text(
        heading.format(unit) + "\n" + gap.join("01") + "\n" + gap.join("12") + "\n"
    )
    (tmp_path / "campaign.toml").write_text(toml.format(unit), encoding="utf-8")
    read_channels(tmp_path / "a.csv", read_campaign_file(tmp_path).sensors)
    (tmp_path / "campaign.toml").write_text(toml.format(declared), encoding="utf-8")
    with pytest.raises(
        RecordingError,
        match=f"channel 'x' is in '{unit}' by the file, in '{declared}' by campaign.toml",
    ):
        read_channels(tmp_path / "a.csv", read_campaign_file(tmp_path).sensors)


RATE_HZ = 10_000.0
BARE_TOML = """\
[campaign]
name = "bare"
kind = "hammer"
date = 2026-11-24
[bench.hammer]
mass_kg = 0.3
[recordings]
columns = ["force", "acceleration_1"]
sampling_rate_hz = 10000
[channels.force]
quantity = "force"
unit = "N"
[channels.acceleration_1]
quantity = "acceleration"
unit = "m/s2"
"""


def _hit() -> np.ndarray:
    """Force and acceleration of a half-sine of 1500 N and 2 ms, with noise: (600, 2)."""
    phase = np.clip((np.arange(600) / RATE_HZ - 0.02) / 2e-3, 0, 1)
    force = 1500 * np.sin(np.pi * phase) + 0.2 * np.random.default_rng(7).normal(size=600)
    return np.column_stack([force, -2 * force + 3 * np.random.default_rng(8).normal(size=600)])


WRITERS = {
    "hit.txt": lambda path, table: np.savetxt(path, table, "%12.4f"),
    "hit.lvm": lambda path, table: np.savetxt(path, table, "%.6f", "\t"),
    "hit.npy": np.save,
    "hit.mat": lambda path, table: savemat(path, {"data": table}),
    "hit.wav": lambda path, table: wavfile.write(path, int(RATE_HZ), table),
}


@pytest.mark.parametrize("name", WRITERS)
def test_names_and_rate_of_campaign_toml_reach_the_store(tmp_path, name):
    folder = tmp_path / "bare"
    folder.mkdir()
    (folder / "campaign.toml").write_text(BARE_TOML, encoding="utf-8")
    (folder / "runs.csv").write_text(f"run,repetition,recording\n1,1,{name}\n", encoding="utf-8")
    WRITERS[name](folder / name, _hit())
    ingested(f"sqlite:///{tmp_path / 'lab.db'}", folder)
    with closing(sqlite3.connect(tmp_path / "lab.db")) as store:
        channels = store.execute("select name, sampling_rate_hz from channels").fetchall()
        assert sorted(channels) == [("acceleration_1", RATE_HZ), ("force", RATE_HZ)]
        ((peak,),) = store.execute("select peak_force_n from pulses").fetchall()
        assert peak == pytest.approx(1500, rel=1e-3)
