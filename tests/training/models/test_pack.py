"""Files of models: the same model comes back, and nothing of a strange file runs."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.models.pair import Pair
from pyroshock.training.models.serialization import (
    KINDS,
    ModelFileError,
    UnknownKindError,
    build,
    describe,
    pack,
    read_model,
    unpack,
    write_model,
)
from support.records.pulse_tables import pulse_table


@pytest.fixture(scope="module")
def pulses():
    return pulse_table(np.random.default_rng(0), repetitions=2)


@pytest.fixture(scope="module")
def model(pulses):
    return Pair(LinearPowers(powers=2), LinearPowers()).fit(pulses, np.random.default_rng(0))


@pytest.fixture
def folder(model, tmp_path) -> Path:
    write_model(pack(model), {"dataset": "spring"}, tmp_path / "model")
    return tmp_path / "model"


def vouched(folder: Path, packed: bytes) -> None:
    """As somebody would who knows the format: other arrays, with their digest set right."""
    (folder / "arrays.npz").write_bytes(packed)
    document = json.loads((folder / "model.json").read_text())
    document["arrays_sha256"] = hashlib.sha256(packed).hexdigest()
    (folder / "model.json").write_text(json.dumps(document))


def rewritten(folder: Path, arrays: dict[str, np.ndarray]) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    vouched(folder, buffer.getvalue())


def edited(folder: Path, **changes: object) -> None:
    document = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps(document | changes))


def test_files_give_the_same_model(folder, model, pulses, tmp_path):
    back, about = read_model(folder)
    np.testing.assert_array_equal(
        back.predict(pulses.inputs).force_n, model.predict(pulses.inputs).force_n
    )
    assert back.settings() == model.settings()
    assert about == {"dataset": "spring"}
    first, second = (write_model(pack(model), {}, tmp_path / name) for name in "ab")
    assert first == second
    assert (tmp_path / "a" / "arrays.npz").read_bytes() == (
        tmp_path / "b" / "arrays.npz"
    ).read_bytes()
    again = build(describe(model))
    assert isinstance(again, Pair)
    assert again.settings() == model.settings()
    assert again.force is not model.force


def test_pickle_in_arrays_does_not_run(folder, tmp_path):
    trap = tmp_path / "trap"

    class Payload:
        def __reduce__(self):
            return (Path(trap).touch, ())

    buffer = io.BytesIO()
    np.savez(buffer, **{"force.x": np.array([Payload()], dtype=object)})
    vouched(folder, buffer.getvalue())
    with pytest.raises(ModelFileError, match="no plain arrays"):
        read_model(folder)
    assert not trap.exists()


@pytest.mark.parametrize("kind", ["os.system", "models.pair", "../x", "", None, 3])
def test_unknown_kind_is_refused(folder, kind):
    edited(folder, model={"kind": kind, "settings": {}})
    with pytest.raises(ModelFileError, match="unknown kind of model"):
        read_model(folder)


def test_what_is_no_model_is_refused(model, tmp_path):
    with pytest.raises(UnknownKindError, match=r"'magic'; known: pair, "):
        build({"kind": "magic", "settings": {}})
    document = {"format": 1, "model": describe(model.force)}
    with pytest.raises(ModelFileError, match="a part of a model"):
        unpack(document, model.arrays())
    document, arrays = pack(model)
    with pytest.raises(ValueError, match="'least' holds Python objects"):
        write_model((document, arrays | {"least": np.array([object()])}), {}, tmp_path)
    # The list is written by hand: each line must lead to a class of that kind.
    import importlib

    for kind, (module, name) in KINDS.items():
        assert getattr(importlib.import_module(f"pyroshock.training.{module}"), name).kind == kind


@pytest.mark.parametrize(
    "changes",
    [
        {"format": 2},
        {"format": None},
        {"model": {"kind": "linear", "settings": {"powers": 3}}},
        {"model": {"kind": "pair", "settings": {"force": 1}}},
        {"model": {"kind": "pair", "settings": {"__class__": 1}}},
        {"model": {"kind": "pair"}},
        {"model": []},
        {"about": None, "model": None},
    ],
    ids=str,
)
def test_manipulated_description_is_refused(folder, changes):
    edited(folder, **changes)
    with pytest.raises(ModelFileError):
        read_model(folder)


@pytest.mark.parametrize("name", ["model.json", "arrays.npz"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_truncated_file_is_refused(folder, name, share):
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[: int(share * len(content))])
    with pytest.raises(ModelFileError):
        read_model(folder)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_truncated_arrays_are_refused_without_their_digest(folder, share):
    content = (folder / "arrays.npz").read_bytes()
    vouched(folder, content[: int(share * len(content))])
    with pytest.raises(ModelFileError):
        read_model(folder)


def test_files_that_lack_something_are_refused(folder, model):
    arrays = model.arrays()
    del arrays["least"]
    rewritten(folder, arrays)
    with pytest.raises(ModelFileError, match="least"):
        read_model(folder)
    # As regressions of scikit-learn were kept before they were its own objects.
    arrays = {
        name: array for name, array in model.arrays().items() if not name.startswith("force.")
    }
    rewritten(
        folder, arrays | {"force.x_mean": np.zeros(13), "force.coefficients": np.zeros((27, 20))}
    )
    with pytest.raises(
        ModelFileError, match=r"'linear' .* trained by older software.*pyroshock train"
    ):
        read_model(folder)
    with pytest.raises(ModelFileError, match="not the file that was registered"):
        read_model(folder, "0" * 64)
    (folder / "arrays.npz").unlink()
    with pytest.raises(ModelFileError, match=r"arrays\.npz cannot be read"):
        read_model(folder)


def test_untrusted_type_in_a_regressor_does_not_run(folder, model):
    """A file of skops that names another function, put in with the digest set right."""
    target = io.BytesIO()
    source = zipfile.ZipFile(io.BytesIO(model.arrays()["force.regressor"].tobytes()))
    with zipfile.ZipFile(target, "w") as file:
        for name in source.namelist():
            file.writestr(name, source.read(name).replace(b"powers_of", b"powers_no"))
    rewritten(
        folder,
        model.arrays() | {"force.regressor": np.frombuffer(target.getvalue(), dtype=np.uint8)},
    )
    with pytest.raises(
        ModelFileError, match=r"refused before anything was made of it: .*linear\.powers_no"
    ):
        read_model(folder)
