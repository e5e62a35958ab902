"""All targets. A new reader is a line in `readers.READERS`; a table or a way into the product is
one in the lists here.

Tables are those that people write, each by itself; whole ways in are `ingest` of a folder, `srs` of
a file, an upload.
"""

from __future__ import annotations

import io
import json
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import cache
from pathlib import Path

from click.testing import CliRunner, Result
from fuzzing import seeds
from fuzzing.mutations import binary, containers, folders, tables, toml
from fuzzing.readers import FORMATS, READERS
from fuzzing.target import ACCEPTED, SET_ASIDE, Mutate, Target, stacked
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.impacts.spectra import target_from_upload
from pyroshock.app.twins.benches import bench_of_file, shipped_bench
from pyroshock.app.web.uploads import UploadError, unpacked
from pyroshock.dataset.predictors import predictors_named
from pyroshock.doe.designs.imported import read_table
from pyroshock.doe.space import read_space, space_from_text
from pyroshock.ingest.folder import modal_table as modes
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.folder.runs_table import read_runs
from pyroshock.twin.plate.table import read_modal_table

#: Faults that a refusal tells, and a line that says how many more there are.
_MOST_FAULTS = 21
_LONGEST_LINE = 2000


def _campaign_is_whole(path: Path) -> bool:
    file = read_campaign_file(path.parent)
    return bool(file.fingerprint) and all(sensor.conversion for sensor in file.sensors.values())


def _runs_are_whole(path: Path) -> bool:
    (path.parent / "a.npz").write_bytes(b"")
    for kind in ("hammer", "gun"):
        rows = read_runs(path.parent, kind, _material)
        if not rows or len({(row.run, row.repetition) for row in rows}) != len(rows):
            return False
        if "bullet_mass" not in rows[0].levels_by_factor:
            break
    return True


def _material(text: str) -> str | None:
    return text.lower() if text.lower() in ("steel", "aluminum", "pla") else None


def _plan_is_whole(path: Path) -> bool:
    design = read_table(path, space_from_text(seeds.FACTORS))
    return len(design.runs) == len(design.treatments)


def _table(
    name: str,
    is_whole: Callable[[Path], object],
    start: Callable[[], Sequence[bytes]] | Sequence[str],
    watched: str,
    mutate: Mutate = tables.damaged,
) -> Target:
    """A file of this name: `is_whole` of its path, which reads it; `start` makes the seeds, or is
    their texts."""

    def use(data: bytes, folder: Path) -> str:
        (folder / name).write_bytes(data)
        assert is_whole(folder / name), name
        return ACCEPTED

    made = start if callable(start) else lambda: [text.encode() for text in start]
    return Target(name, use, made, mutate, (ValueError,), name, tuple(watched.split()), weight=1.4)


TABLES = (
    _table("campaign.toml", _campaign_is_whole, (seeds.HAMMER, seeds.PLATE, seeds.GUN),
           "ingest/folder/campaign_file.py ingest/errors.py signals/units.py", toml.damaged),
    _table("runs.csv", _runs_are_whole,
           (seeds.HAMMER_RUNS.format("a.npz"), seeds.GUN_RUNS.format("a.npz"),
           seeds.HAMMER_RUNS.format("")),
           "ingest/folder/runs_table.py ingest/folder/tables.py files/delimited_text.py "
           "schema/known_factors.py"),
    _table("plate_modes.csv",
           lambda path: modes.read_modal_table(path.parent, path.name, ("acceleration_1",
           )).fingerprint,
           (seeds.MODES,),
           "ingest/folder/modal_table.py ingest/folder/tables.py signals/modal_table.py "
           "files/delimited_text.py"),
    _table("modes.csv", lambda path: read_modal_table(path) is not None, (seeds.MODES,),
           "twin/plate/table.py signals/modal_table.py files/delimited_text.py"),
    _table("bench.toml", lambda path: bench_of_file(path, shipped_bench()) is not None,
    (seeds.BENCH,),
           "app/twins/benches.py", toml.damaged),
    _table("factors.toml", lambda path: read_space(path).size > 0, seeds.space_texts,
           "doe/toml_space.py doe/space.py doe/factors.py", toml.damaged),
    _table("plan.csv", _plan_is_whole, (seeds.PLAN,),
    "doe/designs/imported.py files/delimited_text.py"),
    _table("predictors.toml", lambda path: predictors_named(str(path)).sources,
           lambda: seeds.shipped("dataset/data/gun.toml"), "dataset/predictors.py", toml.damaged),
    _table("target.csv", lambda path: target_from_upload(path.read_bytes(), path.name).lines().size,
    seeds.TARGETS,
           "app/operations/impacts/spectra.py twin/srs/target_csv.py twin/srs/target.py "
           "files/delimited_text.py"),
)  # fmt: skip


class Refused(Exception):
    """The command ended with exit code 2 and this line."""


def ingest(data: bytes, folder: Path) -> str:
    """`pyroshock ingest` into a store that holds a campaign: done with exit code 0, or refused with
    nothing stored."""
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
    select status, reason,
      (select count(*) from channels where channels.recording_id = recordings.id)
    from recordings
"""


def _rows(path: Path) -> dict[str, int]:
    """Rows per table, by SQLite alone: thousands of stores are looked into."""
    with closing(sqlite3.connect(path)) as store:
        names = [
            name for (name,) in store.execute("select name from sqlite_master where type = 'table'")
        ]
        return {
            name: store.execute(f'select count(*) from "{name}"').fetchone()[0] for name in names
        }


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
    """`pyroshock srs FILE --target`: a spectrum, or a refusal. The first byte chooses the
    format."""
    path, target = folder / f"input{_suffix_of(data)}", folder / "target.csv"
    path.write_bytes(data[1:])
    target.write_text(seeds.TARGETS[0])
    options = [
        "--channel",
        "acceleration_1",
        "--unit",
        "m/s2",
        "--frequencies",
        "100:1000:3",
        "--json",
        "--target",
    ]
    result = _pyroshock("srs", str(path), *options, str(target))
    _refuse(result)
    json.loads(result.stdout)
    return ACCEPTED


def upload(data: bytes, folder: Path) -> str:
    """An uploaded ZIP is unpacked below its folder, or refused."""
    target = folder / "inside" / "upload"
    target.mkdir(parents=True)
    unpacked([("campaign.zip", io.BytesIO(data))], target, 50_000_000)
    assert [p.name for p in folder.iterdir()] == ["inside"] and [
        p.name for p in target.parent.iterdir()
    ] == ["upload"]
    return ACCEPTED


def _pyroshock(*arguments: str) -> Result:
    result = CliRunner().invoke(main, arguments)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def _refuse(result: Result) -> None:
    """Raise `Refused` for exit code 2, and `AssertionError` for any other than 0 and 1, for long
    lines, and for more lines than one, unless they are the faults that the first one counts."""
    if result.exit_code == 2:
        lines = result.stderr.splitlines()
        assert result.stdout == "" and max(map(len, lines)) < _LONGEST_LINE, result.output
        faults = lines[1:]
        assert not faults or lines[0].endswith(" faults"), result.output
        assert len(faults) <= _MOST_FAULTS and all(line.startswith("  ") for line in faults), (
            result.output
        )
        raise Refused(lines[0])
    assert result.exit_code in (0, 1), result.output


_PLAIN = ("npz", "mat5-compressed", "csv", "tdms", "uff-ascii", "lvm", "parquet", "text")
_SUFFIXES = (".npz", ".mat", ".csv", ".tdms", ".uff", ".lvm", ".parquet", ".txt")


def _suffix_of(data: bytes) -> str:
    return _SUFFIXES[data[0] % len(_SUFFIXES)] if data else ".csv"


def _damaged_recording(data: bytes, rng: object, others: object) -> bytes:
    alike = [other[1:] for other in others if other[:1] == data[:1]]  # type: ignore[attr-defined]
    return data[:1] + FORMATS[_suffix_of(data)](data[1:], rng, alike)


WHOLE = (
    Target("ingest of a folder", ingest,
           lambda: (*seeds.hammer_folders(*_PLAIN, "hdf5", "mat73"), seeds.gun_folder()),
           folders.damaged_by(FORMATS),
           (Refused,), "pyroshock: ",
           (*(f"ingest/{name}.py" for name in ("load", "folder/campaign_tables",
           "folder/runs_table", "extraction/channels", "extraction/recording",
           "storing/campaign_writer", "storing/bench_rows", "storing/row_values",
           "storing/excluded_recordings")),
            "parallel/read_ahead.py"), weight=0.6),
    Target("srs of a file", srs,
           lambda: [bytes([n]) + content for n, content in enumerate(seeds.recordings(*_PLAIN))],
           _damaged_recording,
           (Refused,), "pyroshock: ",
           ("app/operations/impacts/spectra.py", "app/operations/impacts/spectrum_tables.py"),
           weight=0.6),
    Target("upload of a ZIP", upload, lambda: (seeds.zipped_folder(),),
           stacked({containers.inside_zip: 3, binary.damaged: 3}, most=2), (UploadError,), "",
           ("app/web/uploads.py",)),
)  # fmt: skip

TARGETS: dict[str, Target] = {target.name: target for target in (*READERS, *TABLES, *WHOLE)}
