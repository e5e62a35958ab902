"""`db backup` and `db restore`: a store, its model registry and the models' files as one folder,
and back.

What the registry names must be in the backup, while people go on working: a version is registered
when its files are written, and its dataset is frozen before it is trained. Hence the registry is
copied first, then the store, then the files. Each is one consistent state: the registry by SQLite's
online backup, the store by one transaction.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ....schema.engine import StoreError, describe, make_engine
from ....schema.rows import Progress
from ....schema.session import Store, Writer, open_store
from ....schema.transfer.copying import copy_store
from ....training.registry.connection import EXPERIMENT, user_environment
from ....training.registry.model_storage import ModelStorage, storage_for

#: In the folder of a backup; the last lists all others with their SHA-256, and is written when they
#: are whole.
STORE, REGISTRY, MODELS, CONTENTS = "store.db", "registry.db", "models", "backup.json"


@dataclass(frozen=True)
class BackupReport:
    """What a backup holds, or gave back: rows of the store, versions' files, bytes."""

    folder: Path
    rows: int
    model_files: int
    size_bytes: int
    has_registry: bool


def back_up(store: Store, url: str, folder: Path, progress: Progress | None = None) -> BackupReport:
    """Write the store at `url` with its registry into `folder`, which must not exist.

    Others may work meanwhile. Raises `StoreError` for a folder that is there, and for a registry
    that is no file of SQLite, which has a backup of its own.
    """
    place = _place_of(url)
    if folder.exists():
        raise StoreError(f"{folder} is there already; give a new folder")
    unfinished = folder.with_name(f".{folder.name}.unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    try:
        has_registry = _copy_registry(place, unfinished / REGISTRY)
        rows = _copy_store(store, unfinished / STORE, progress)
        model_files = _copy_files(place.folder, unfinished / MODELS) if has_registry else 0
        files = {
            path.relative_to(unfinished).as_posix(): _hash(path) for path in _files(unfinished)
        }
        contents = {
            "made_at": datetime.now(UTC).isoformat(timespec="seconds"),
            "store": describe(store.engine),
        }
        text = json.dumps({**contents, "rows": rows, "files": files}, indent=1)
        (unfinished / CONTENTS).write_text(text, encoding="utf-8")
        unfinished.rename(folder)
    except BaseException:  # an interruption, too, leaves no half backup behind; it is raised again
        shutil.rmtree(unfinished, ignore_errors=True)
        raise
    return BackupReport(folder, rows, model_files, _size(folder), has_registry)


def restore(folder: Path, url: str, progress: Progress | None = None) -> BackupReport:
    """Put a backup back: the store into the empty place at `url`, its registry and models where
    they belong there.

    Every file is held against its SHA-256 first. Raises `StoreError` for a folder that is no whole
    backup, and where there is a store or a registry already.
    """
    contents = _checked(folder)
    place, has_registry = _place_of(url), REGISTRY in contents
    if has_registry:
        _refuse_full(place)
    with tempfile.TemporaryDirectory(prefix="pyroshock-restore-") as room:
        copy = shutil.copyfile(
            folder / STORE, Path(room) / STORE
        )  # opening a store may write into its file
        with open_store(f"sqlite:///{copy}", Writer("db restore", "")) as store:
            engine = make_engine(url)
            try:
                rows = sum(table.rows for table in copy_store(store, engine, progress))
            finally:
                engine.dispose()
    model_files = 0
    if has_registry and place.database is not None:
        model_files = _copy_files(folder / MODELS, place.folder)
        place.database.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / REGISTRY, place.database)
        _settle_at(place)
    return BackupReport(folder, rows, model_files, _size(folder), has_registry)


def _place_of(url: str) -> ModelStorage:
    place = storage_for(url, user_environment())
    if place.database is None or (place.files is not None and "://" in place.files):
        where = place.shown if place.database is None else place.files
        raise StoreError(
            f"the models are in {where}, which db backup and db restore do not copy: use "
            "deploy/backup.sh, or the server's own backup"
        )
    return place


def _copy_registry(place: ModelStorage, target: Path) -> bool:
    """False where nothing was registered yet."""
    if place.database is None or not place.database.is_file():
        return False
    try:
        with (
            closing(
                sqlite3.connect(f"{place.database.absolute().as_uri()}?mode=ro", uri=True)
            ) as origin,
            closing(sqlite3.connect(target)) as copy,
        ):
            origin.backup(copy)
            (fault,) = copy.execute("PRAGMA quick_check(1)").fetchone()
            copy.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.DatabaseError as error:
        fault = str(error)
    if fault != "ok":
        raise StoreError(
            f"model registry {place.shown} cannot be read: {str(fault).splitlines()[0]}"
        )
    return True


def _copy_store(store: Store, target: Path, progress: Progress | None) -> int:
    engine = make_engine(f"sqlite:///{target}")
    try:
        return sum(table.rows for table in copy_store(store, engine, progress))
    finally:
        engine.dispose()


def _copy_files(origin: Path, target: Path) -> int:
    """Copy the models' files, without what is in progress; how many. What vanishes meanwhile was
    never registered."""
    count = 0
    for path in _files(origin):
        name = path.relative_to(origin)
        if name.parts[0] == "work":
            continue
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        try:
            shutil.copyfile(path, target / name)
        except FileNotFoundError:
            continue
        count += 1
    return count


def _settle_at(place: ModelStorage) -> None:
    """What is trained from now on keeps its files here."""
    if place.database is None:
        return
    with closing(sqlite3.connect(place.database)) as connection, connection:
        where = (place.artifact_uri, EXPERIMENT)
        connection.execute("UPDATE experiments SET artifact_location = ? WHERE name = ?", where)


def _refuse_full(place: ModelStorage) -> None:
    if place.database is not None and place.database.exists():
        raise StoreError(
            f"{place.database} is there already; move it away before its backup is restored"
        )
    if next(_files(place.folder), None) is not None:
        raise StoreError(
            f"{place.folder} holds files already; move it away before its backup is restored"
        )


def _checked(folder: Path) -> dict[str, str]:
    """Name -> SHA-256 of the files of a backup that is whole. Raises `StoreError`."""
    try:
        files: dict[str, str] = json.loads((folder / CONTENTS).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(
            f"{folder} is no backup: its {CONTENTS} cannot be read ({type(error).__name__})"
        ) from error
    here = {path.relative_to(folder).as_posix(): path for path in _files(folder)}
    here.pop(CONTENTS)
    faults = [f"{name} is missing" for name in files if name not in here]
    faults += [f"{name} was not in it" for name in here if name not in files]
    faults += [
        f"{name} is not as it was written"
        for name, path in here.items()
        if files.get(name) != _hash(path)
    ]
    if faults or STORE not in files:
        raise StoreError(
            f"{folder} is no whole backup: "
            f"{'; '.join(faults[:3]) or f'no {STORE}'}; use another one"
        )
    return files


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.is_file() and not path.is_symlink())


def _hash(path: Path) -> str:
    with path.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in _files(folder))
