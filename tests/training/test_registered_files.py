"""Every file of a registered version is held against the SHA-256 that was registered of it; a
damaged registry is one line."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.registry.connection import RegistryError
from pyroshock.training.registry.file_hashes import (
    MODEL,
    AlteredFilesError,
    check_files,
    hash_files,
)
from pyroshock.training.registry.records import Version
from pyroshock.training.registry.registry import Registry
from support.stores.registries import context_in, fresh_registry, without_figures


@pytest.fixture(scope="module")
def registered(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Registry, Version]]:
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        registry = fresh_registry(tmp_path_factory.mktemp("registered"))
        context = context_in(registry)
        version = registry.record(fit_task(task_of("linear", "repetitions", context), context))
        registry.record(fit_task(task_of("linear", "configurations", context), context))
        yield registry, version


def _files(registry: Registry) -> list[Path]:
    return sorted(
        path
        for path in registry.place.folder.rglob("*")
        if path.is_file() and "work" not in path.parts
    )


def _whole(registry: Registry) -> bool:
    return all(registry.damage(version) is None for version in registry.versions())


def test_every_file_is_registered_and_a_version_that_nobody_touched_is_whole(
    registered: tuple[Registry, Version],
) -> None:
    registry, version = registered
    names = set(version.files)
    assert {
        "model/MLmodel",
        "run/held_out.npz",
        "run/code_version.json",
        "model/data/model/model.json",
    } <= names
    versions = registry.versions()
    assert len(versions) == 2 and sum(len(record.files) for record in versions) == len(
        _files(registry)
    )
    assert _whole(registry)


def _byte(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


@pytest.mark.parametrize(("change", "words"), [
    (_byte, "is not the file that was registered"),
    (Path.unlink, "no "),
    (lambda path: path.with_name("further.py").write_text("print(1)"),
     "further.py was not registered"),
], ids=["changed", "missing", "extra"])  # fmt: skip
def test_each_changed_missing_or_further_file_is_named(
    tmp_path: Path, change: Callable[[Path], object], words: str
) -> None:
    names = ("MLmodel", "data/model/arrays.npz", "held_out.npz", "deep/plot.png")
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(name.encode())
    recorded = hash_files(tmp_path, MODEL)
    check_files(tmp_path, MODEL, recorded)
    for name in names:
        change(tmp_path / name)
        with pytest.raises(AlteredFilesError, match=words) as caught:
            check_files(tmp_path, MODEL, recorded)
        assert Path(name).parent.as_posix().strip(".") in str(caught.value)
        (tmp_path / name).write_bytes(name.encode())
        (tmp_path / name).with_name("further.py").unlink(missing_ok=True)


def test_altered_predictions_and_pages_of_a_version_are_its_damage(
    registered: tuple[Registry, Version],
) -> None:
    registry, version = registered
    for name in ("held_out.npz", "code_version.json", "MLmodel"):
        path = _file_of(registry, version, name)
        before = path.read_bytes()
        _byte(path)
        assert f"{name} is not the file that was registered" in str(registry.damage(version))
        path.write_bytes(before)
    assert _whole(registry)


def test_a_model_with_a_changed_file_is_not_loaded(registered: tuple[Registry, Version]) -> None:
    registry, version = registered
    path = _file_of(registry, version, "MLmodel")
    before = path.read_bytes()
    path.write_bytes(before.replace(b"pyroshock", b"elsewhere"))
    try:
        with pytest.raises(
            AlteredFilesError, match=r"linear@1: model/MLmodel is not the file that was registered"
        ):
            registry.load(version)
    finally:
        path.write_bytes(before)
    registry.load(version)


def _file_of(registry: Registry, version: Version, name: str) -> Path:
    """The file of the version's run; of its model, whose folder does not bear the run, the one with
    the SHA-256."""
    named = [path for path in _files(registry) if path.name == name]
    (path,) = (
        [path for path in named if version.run_id in path.parts]
        if f"run/{name}" in version.files
        else [path for path in named if _hash(path) == version.files[f"model/{name}"]]
    )
    return path


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("share", [0.5, 0.001])
def test_a_registry_that_was_cut_is_one_line(tmp_path: Path, share: float) -> None:
    registry = fresh_registry(tmp_path)
    database = registry.place.database
    assert database is not None
    content = database.read_bytes()
    database.write_bytes(content[: int(share * len(content))])
    begun = time.monotonic()
    with pytest.raises(RegistryError) as caught:
        Registry(registry.place).versions()
    assert time.monotonic() - begun < 30.0  # MLflow alone tries for minutes
    message = str(caught.value)
    assert len(message.splitlines()) == 1 and "lab-models.db" in message, message
