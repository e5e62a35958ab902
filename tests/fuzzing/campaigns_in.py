"""Whole ways into the product: `ingest` of a folder, `srs` of a file, an uploaded ZIP."""

from __future__ import annotations

import io
import json
import shutil
import sqlite3
import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path

from click.testing import CliRunner, Result
from fuzzing import seeds
from fuzzing.mutations import binary, containers, folders
from fuzzing.readers import FORMATS
from fuzzing.target import ACCEPTED, SET_ASIDE, Target, stacked
from pyroshock.app.cli.main import main
from pyroshock.app.ingest.uploads import UploadError, unpacked

_INGEST = (
    "ingest/load.py",
    "ingest/processing.py",
    "ingest/store.py",
    "ingest/rows.py",
    "ingest/excluded_recordings.py",
    "ingest/rows.py",
    "ingest/runs.py",
    "parallel/read_ahead.py",
)

#: Faults that a refusal tells, and a line that says how many more there are.
_MOST_FAULTS = 21
_LONGEST_LINE = 2000


class Refused(Exception):
    """The command ended with exit code 2 and this line."""


def ingest(data: bytes, folder: Path) -> str:
    """`pyroshock ingest` into a store that holds a campaign: done with exit code 0, or refused with nothing stored."""
    campaign = folder / "campaign"
    campaign.mkdir()
    folders.write(data, campaign)
    url = f"sqlite:///{shutil.copy(_store(), folder / 'lab.db')}"
    result = _pyroshock("ingest", str(campaign), "--db", url, "--jobs", "1", "--json")
    if result.exit_code == 2:
        assert _rows(folder / "lab.db") == _rows(_store()), "a refused campaign left something"
    _refuse(result)
    report = json.loads(result.stdout)
    with closing(sqlite3.connect(folder / "lab.db")) as store:
        for status, reason, channels in store.execute(_RECORDINGS):
            assert (status == "set aside") == bool(reason) == (channels == 0)
    return SET_ASIDE if report["set_aside"] else ACCEPTED


_RECORDINGS = """
    select status, reason, (select count(*) from channels where channels.recording_id = recordings.id) from recordings
"""


def _rows(path: Path) -> dict[str, int]:
    """Rows per table, by SQLite alone: thousands of stores are looked into."""
    with closing(sqlite3.connect(path)) as store:
        tables = [name for (name,) in store.execute("select name from sqlite_master where type = 'table'")]
        return {name: store.execute(f'select count(*) from "{name}"').fetchone()[0] for name in tables}


@cache
def _store() -> Path:
    """A store with one campaign of another name, to be copied."""
    folder = Path(tempfile.mkdtemp(prefix="pyroshock-fuzz-"))
    campaign = folder / "earlier"
    campaign.mkdir()
    folders.write(seeds.gun_folder().replace(b'"gun"\nkind', b'"old"\nkind'), campaign)
    path = folder / "used.db"
    assert _pyroshock("ingest", str(campaign), "--db", f"sqlite:///{path}").exit_code == 0
    return path


def srs(data: bytes, folder: Path) -> str:
    """`pyroshock srs FILE --target`: a spectrum, or a refusal. The first byte chooses the format."""
    path = folder / f"input{_SUFFIXES[data[0] % len(_SUFFIXES)] if data else '.csv'}"
    path.write_bytes(data[1:])
    (folder / "target.csv").write_text(seeds.TARGETS[0])
    options = [
        "--channel",
        "acceleration_1",
        "--unit",
        "m/s2",
        "--frequencies",
        "100:1000:3",
        "--target",
        str(folder / "target.csv"),
    ]
    result = _pyroshock("srs", str(path), *options, "--json")
    _refuse(result)
    json.loads(result.stdout)
    return ACCEPTED


def upload(data: bytes, folder: Path) -> str:
    """An uploaded ZIP is unpacked below its folder, or refused."""
    target = folder / "inside" / "upload"
    target.mkdir(parents=True)
    unpacked([("campaign.zip", io.BytesIO(data))], target, 50_000_000)
    assert [p.name for p in folder.iterdir()] == ["inside"] and [p.name for p in target.parent.iterdir()] == ["upload"]
    return ACCEPTED


def _pyroshock(*arguments: str) -> Result:
    result = CliRunner().invoke(main, arguments)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def _refuse(result: Result) -> None:
    """Raise `Refused` for exit code 2, and `AssertionError` for any other than 0 and 1, for long lines, and for more
    lines than one, unless they are the faults that the first one counts."""
    if result.exit_code == 2:
        lines = result.stderr.splitlines()
        assert result.stdout == "" and max(map(len, lines)) < _LONGEST_LINE, result.output
        faults = lines[1:]
        assert not faults or lines[0].endswith(" faults"), result.output
        assert len(faults) <= _MOST_FAULTS and all(line.startswith("  ") for line in faults), result.output
        raise Refused(lines[0])
    assert result.exit_code in (0, 1), result.output


_PLAIN = ("npz", "mat5-compressed", "csv", "tdms", "uff-ascii", "lvm", "parquet", "text")
_SUFFIXES = (".npz", ".mat", ".csv", ".tdms", ".uff", ".lvm", ".parquet", ".txt")


def _srs_seeds() -> list[bytes]:
    return [bytes([n]) + content for n, content in enumerate(seeds.recordings(*_PLAIN))]


def _damaged_recording(data: bytes, rng: object, others: object) -> bytes:
    suffix = _SUFFIXES[data[0] % len(_SUFFIXES)] if data else ".csv"
    alike = [other[1:] for other in others if other[:1] == data[:1]]  # type: ignore[attr-defined]
    return data[:1] + FORMATS[suffix](data[1:], rng, alike)


WHOLE = (
    Target(
        "ingest of a folder",
        ingest,
        lambda: (*seeds.hammer_folders(*_PLAIN, "hdf5", "mat73"), seeds.gun_folder()),
        folders.damaged_by(FORMATS),
        (Refused,),
        "pyroshock: ",
        _INGEST,
        weight=0.6,
    ),
    Target(
        "srs of a file",
        srs,
        _srs_seeds,
        _damaged_recording,
        (Refused,),
        "pyroshock: ",
        ("app/impacts/spectra.py", "app/impacts/spectra.py", "app/impacts/spectrum_tables.py"),
        weight=0.6,
    ),
    Target(
        "upload of a ZIP",
        upload,
        lambda: (seeds.zipped_folder(),),
        stacked({containers.inside_zip: 3, binary.damaged: 3}, most=2),
        (UploadError,),
        "",
        ("app/ingest/uploads.py",),
    ),
)
