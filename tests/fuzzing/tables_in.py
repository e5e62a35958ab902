"""The tables and settings that people write, each by itself: campaigns, plans, benches, specifications."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fuzzing import seeds
from fuzzing.mutations import tables, toml
from fuzzing.target import ACCEPTED, Mutate, Target


def _campaign_toml(data: bytes, folder: Path) -> str:
    from pyroshock.ingest.folder import read_campaign_file

    (folder / "campaign.toml").write_bytes(data)
    file = read_campaign_file(folder)
    assert file.fingerprint and all(sensor.conversion for sensor in file.sensors.values())
    return ACCEPTED


def _runs_csv(data: bytes, folder: Path) -> str:
    from pyroshock.ingest.runs import read_runs

    (folder / "runs.csv").write_bytes(data)
    (folder / "a.npz").write_bytes(b"")
    for kind in ("hammer", "gun"):
        rows = read_runs(folder, kind, _material)
        assert rows and len({(row.run, row.repetition) for row in rows}) == len(rows)
        if "bullet_mass" not in rows[0].levels_by_factor:
            break
    return ACCEPTED


def _material(text: str) -> str | None:
    return text.lower() if text.lower() in ("steel", "aluminum", "pla") else None


def _plate_modes_csv(data: bytes, folder: Path) -> str:
    from pyroshock.ingest.modes import read_modal_table

    (folder / "plate_modes.csv").write_bytes(data)
    assert read_modal_table(folder, "plate_modes.csv", ("acceleration_1",)).fingerprint
    return ACCEPTED


def _modal_table(data: bytes, folder: Path) -> str:
    from pyroshock.twin.plate.table import read_modal_table

    read_modal_table(_written(data, folder / "modes.csv"))
    return ACCEPTED


def _bench(data: bytes, folder: Path) -> str:
    from pyroshock.app.twins.benches import bench_of_file, shipped_bench

    bench_of_file(_written(data, folder / "bench.toml"), shipped_bench())
    return ACCEPTED


def _factors(data: bytes, folder: Path) -> str:
    from pyroshock.doe.space import read_space

    space = read_space(_written(data, folder / "factors.toml"))
    assert space.size > 0
    return ACCEPTED


def _plan(data: bytes, folder: Path) -> str:
    from pyroshock.doe.designs.imported import read_table
    from pyroshock.doe.space import space_from_text

    design = read_table(_written(data, folder / "plan.csv"), space_from_text(seeds.FACTORS))
    assert len(design.runs) == len(design.treatments)
    return ACCEPTED


def _predictors(data: bytes, folder: Path) -> str:
    from pyroshock.dataset.predictors import predictors_named

    assert predictors_named(str(_written(data, folder / "predictors.toml"))).sources
    return ACCEPTED


def _target(data: bytes, folder: Path) -> str:
    from pyroshock.app.impacts.spectra import target_from_upload

    target = target_from_upload(data, "target.csv")
    assert target.lines().size
    return ACCEPTED


def _written(data: bytes, path: Path) -> Path:
    path.write_bytes(data)
    return path


def _table(
    name: str,
    use: Callable[[bytes, Path], str],
    start: Callable[[], Sequence[bytes]],
    watched: str,
    mutate: Mutate = tables.damaged,
    names: str | None = None,
) -> Target:
    modules = tuple(watched.split())
    return Target(name, use, start, mutate, (ValueError,), name if names is None else names, modules, weight=1.4)


def _of(*texts: str) -> Callable[[], Sequence[bytes]]:
    return lambda: [text.encode() for text in texts]


_RUNS = (seeds.HAMMER_RUNS.format("a.npz"), seeds.GUN_RUNS.format("a.npz"), seeds.HAMMER_RUNS.format(""))
TABLES = (
    _table(
        "campaign.toml",
        _campaign_toml,
        _of(seeds.HAMMER, seeds.PLATE, seeds.GUN),
        "ingest/folder.py ingest/errors.py signals/units.py",
        toml.damaged,
    ),
    _table(
        "runs.csv",
        _runs_csv,
        _of(*_RUNS),
        "ingest/runs.py ingest/tables.py delimited_text.py schema/known_factors.py",
    ),
    _table("plate_modes.csv", _plate_modes_csv, _of(seeds.MODES),
           "ingest/modes.py ingest/tables.py signals/modal_table.py delimited_text.py"),
    _table("modes.csv", _modal_table, _of(seeds.MODES), "twin/plate/table.py signals/modal_table.py delimited_text.py"),
    _table("bench.toml", _bench, _of(seeds.BENCH), "app/twins/benches.py", toml.damaged),
    _table("factors.toml", _factors, seeds.space_texts, "doe/toml_space.py doe/space.py doe/factors.py", toml.damaged),
    _table("plan.csv", _plan, _of(seeds.PLAN), "doe/designs/imported.py delimited_text.py"),
    _table("predictors.toml", _predictors, lambda: seeds.shipped("dataset/data/gun.toml"), "dataset/predictors.py",
           toml.damaged),
    _table("target.csv", _target, _of(*seeds.TARGETS),
           "app/impacts/spectra.py twin/srs/target_csv.py twin/srs/target.py delimited_text.py"),
)  # fmt: skip
