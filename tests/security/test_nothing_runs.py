"""Code and text that would run elsewhere is data here: never run, but stored, found and shown."""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import shutil
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pyroshock.doe.plans import list_plans
from pyroshock.ingest.readers import RecordingError, open_recording
from pyroshock.schema.session import count_rows
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.registry.file_hashes import AlteredFilesError
from pyroshock.training.registry.records import Version
from pyroshock.training.registry.registry import Registry
from scipy.io import savemat
from support.records.campaigns import hammer_campaign, hammer_rows, with_cell, write_runs
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import ingested, opened, pyroshock, run_pyroshock
from support.stores.web_stores import FACTORS

FS_HZ = 51200.0
WAVE = np.sin(np.arange(4096) / 50)


class Payload:
    """Unpickled, it makes the file."""

    def __init__(self, trap: Path) -> None:
        self.trap = trap

    def __reduce__(self) -> tuple[Any, ...]:
        return (Path.touch, (self.trap,))


@pytest.fixture
def trap(tmp_path: Path) -> Iterator[Path]:
    """A path that nothing may make."""
    yield tmp_path / "the-trap-went-off"
    assert not (tmp_path / "the-trap-went-off").exists()


@pytest.fixture(scope="module")
def registered(tmp_path_factory: pytest.TempPathFactory) -> tuple[Registry, Version]:
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        registry = fresh_registry(tmp_path_factory.mktemp("registry"))
        training_context = context_in(registry)
        return registry, registry.record(
            fit_task(task_of("linear", "repetitions", training_context), training_context)
        )


def arrays_with(payload: object) -> bytes:
    """An npz whose array is a pickle."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=True, **{"force.x": np.array([payload], dtype=object)})
    return content.getvalue()


def test_a_payload_would_go_off(tmp_path: Path) -> None:
    """Else the tests below show nothing."""
    np.load(io.BytesIO(arrays_with(Payload(tmp_path / "gone off"))), allow_pickle=True)["force.x"]
    assert (tmp_path / "gone off").exists()


@pytest.mark.parametrize("make", [pickle.dumps, arrays_with], ids=["pickle", "npz-of-objects"])
@pytest.mark.parametrize("name", ["model.json", "arrays.npz", "held_out.npz"])
def test_no_file_of_a_model_is_unpickled(
    registered: tuple[Registry, Version], trap: Path, name, make
) -> None:
    """Not even where whoever planted it could change the digests, too."""
    registry, version = registered
    file = next(registry.place.folder.rglob(name))
    before = {
        each: each.read_bytes() for each in (file, next(registry.place.folder.rglob("model.json")))
    }
    file.write_bytes(make(Payload(trap)))
    try:
        with pytest.raises(ValueError, match="linear@1"):
            own = vouched(registry, version)
            registry.held_out(own) if name == "held_out.npz" else registry.load(own)
    finally:
        for each, content in before.items():
            each.write_bytes(content)
    assert registry.load(version).model is not None


def vouched(registry: Registry, version: Version) -> Version:
    """The version with the digests of the files as they are now."""
    description = next(registry.place.folder.rglob("model.json"))
    arrays = hashlib.sha256(
        next(registry.place.folder.rglob("arrays.npz")).read_bytes()
    ).hexdigest()
    try:
        document = json.loads(description.read_bytes()) | {"arrays_sha256": arrays}
    except ValueError:
        pass
    else:
        description.write_text(json.dumps(document))
    (model_id,) = (
        row["model_id"] for row in registry.recorded() if row["run_id"] == version.run_id
    )
    with registry.connection.client() as client:
        files = registry._hash_logged(client, version.run_id, model_id, registry.place.work)
    return replace(
        version, sha256=hashlib.sha256(description.read_bytes()).hexdigest(), files=files
    )


def test_what_mlflow_would_run_is_not_asked(
    registered: tuple[Registry, Version], trap: Path
) -> None:
    """`MLmodel` names the module that MLflow's own `load_model` imports, and a folder of code
    beside it.

    Neither is run, not even where whoever planted them could change the digests, too.
    """
    registry, version = registered
    description = next(registry.place.folder.rglob("MLmodel"))
    ours = next(description.parent.rglob("model.json"))
    before, code, written = description.read_text(), description.parent / "code", ours.read_bytes()
    code.mkdir()
    (code / "planted.py").write_text(f"from pathlib import Path\nPath({str(trap)!r}).touch()\n")
    description.write_text(
        before.replace("pyroshock.training.registry.loading", "planted").replace(
            "code: null", "code: code"
        )
    )
    try:
        with pytest.raises(
            AlteredFilesError,
            match=r"linear@1: model/MLmodel is not .*planted\.py was not registered",
        ):
            registry.load(version)
        assert registry.load(vouched(registry, version)).model is not None
    finally:
        description.write_text(before)
        ours.write_bytes(written)
        shutil.rmtree(code)
    assert registry.load(version).model is not None


def npz_of_objects(path: Path, trap: Path) -> None:
    np.savez(path, allow_pickle=True, fs=FS_HZ, force=np.array([Payload(trap)] * 64, dtype=object))


def npz_of_pickles(path: Path, trap: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("force.npy", pickle.dumps(Payload(trap)))


def mat_of_objects(path: Path, trap: Path) -> None:
    code = f"@() system('touch {trap}')"
    savemat(
        path,
        {
            "fs": FS_HZ,
            "force": np.array([code, WAVE], dtype=object),
            "fun": {"function_handle": code},
        },
    )


def hdf5_of_pickles(path: Path, trap: Path) -> None:
    with h5py.File(path, "w") as file:
        file["fs"] = FS_HZ
        file["force"] = np.frombuffer(pickle.dumps(Payload(trap)), dtype="V1")
        file.attrs["unit"] = np.void(pickle.dumps(Payload(trap)))


def parquet_with_a_pickled_type(path: Path, trap: Path) -> None:
    """pyarrow's Python-defined types are pickles in the schema's metadata."""
    import pyarrow
    from pyarrow import parquet

    plan = {b"ARROW:extension:name": b"arrow.py_extension_type"}
    plan[b"ARROW:extension:metadata"] = pickle.dumps(Payload(trap))
    field = pyarrow.field("force", pyarrow.float64(), metadata=plan)
    parquet.write_table(pyarrow.table([WAVE], schema=pyarrow.schema([field])), path)


def csv_of_code(path: Path, trap: Path) -> None:
    code = f"__import__('pathlib').Path({str(trap)!r}).touch()"
    path.write_text("time_s,force\n" + "\n".join(f"{i / FS_HZ},{code}" for i in range(64)))


FILES = {
    "objects.npz": npz_of_objects,
    "pickle.npz": lambda path, trap: path.write_bytes(pickle.dumps(Payload(trap))),
    "pickles.npz": npz_of_pickles,
    "objects.mat": mat_of_objects,
    "pickles.h5": hdf5_of_pickles,
    "type.parquet": parquet_with_a_pickled_type,
    "code.csv": csv_of_code,
}


@pytest.mark.parametrize("name", FILES)
def test_no_recording_runs_what_lies_in_it(name: str, tmp_path: Path, trap: Path) -> None:
    FILES[name](tmp_path / name, trap)
    try:
        with open_recording(tmp_path / name) as recording:
            samples = recording.read("force")
    except RecordingError:
        return
    assert samples.dtype.kind in "fiu"


# --- text that would be a statement, a placeholder or a format elsewhere ---
HOSTILE = [
    "'; DROP TABLE impacts; --",
    "x\"); DELETE FROM campaigns; -- ' OR '1'='1",
    "%s %(name)s %% {0} {name} $1 ? \\'; SELECT pg_sleep(60); -- ї—🔨",
]


def filled(db: str, folder: Path) -> None:
    """A campaign for each text, called so, with one hit whose mood of the operator is called so,
    too."""
    for number, text in enumerate(HOSTILE):
        made = hammer_campaign(folder / str(number), recordings=1, hits=1, name="NAME")
        campaign = made / "campaign.toml"
        named = campaign.read_text("utf-8").replace('"NAME"', json.dumps(text, ensure_ascii=False))
        campaign.write_text(named, "utf-8")
        write_runs(made, with_cell(hammer_rows(1, 1), "operator_mood", text))
        ingested(db, made)


def asked(*words: str) -> list[dict[str, object]]:
    result = run_pyroshock(*words, "--json")
    answers: list[dict[str, object]] = json.loads(result.stdout)
    return answers


def rows(db: str) -> dict[str, int]:
    with opened(db) as store:
        return count_rows(store)


def test_names_and_levels_are_data(database_url: str, tmp_path: Path) -> None:
    """Each is found by itself alone, nothing is lost, and what is asked for is not what is done."""
    filled(database_url, tmp_path)
    before = rows(database_url)
    assert before["impacts"] == len(HOSTILE)
    assert {row["name"] for row in asked("campaigns", "--db", database_url)} == set(HOSTILE)
    for text in HOSTILE:
        for words in (("--campaign", text), ("--where", f"operator_mood={text}")):
            assert [row["campaign"] for row in asked("impacts", *words, "--db", database_url)] == [
                text
            ]
    for begun in (
        ("impacts", "--campaign"),
        ("impacts", "--where"),
        ("shots", "--campaign"),
        ("diagnose",),
    ):
        answer = pyroshock(*begun, "operator_mood=a\0b", "--db", database_url)
        assert answer.exit_code in (0, 2) and answer.output.count("\n") == 1, (begun, answer.output)
    assert rows(database_url) == before


def test_plans_are_called_as_they_are_called(database_url: str, tmp_path: Path) -> None:
    factors = tmp_path / "factors.toml"
    factors.write_text(FACTORS)
    with opened(database_url, create=True):
        pass
    for text in HOSTILE:
        run_pyroshock(
            "plan",
            "factorial",
            text,
            "--factors",
            factors,
            "--repetitions",
            "1",
            "--db",
            database_url,
        )
    with opened(database_url) as store, store.reading() as session:
        assert {plan["name"] for plan in list_plans(session)} == set(HOSTILE)
