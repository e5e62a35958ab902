"""A registered model whose files are gone or changed: told by name and file, and the others are
served."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from pyroshock.training.fitting.session import Progress, train
from pyroshock.training.registry.intact_models import damages
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.records import DatasetName, Version
from pyroshock.training.registry.registry import Registry
from support.stores.registries import (
    at_its_place,
    context_in,
    fresh_registry,
    without_figures,
    without_judging_the_first,
)
from support.stores.stores import opened, pyroshock

MODELS = ["hann", "hertz", "linear"]
SPLITS = ["repetitions"]


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> Path:
    """A folder with a registry of three models, of which `hann` is in use; it was moved there."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        without_judging_the_first(patch)
        (folder / "made").mkdir()
        registry = fresh_registry(folder / "made")
        training_context = context_in(registry)
        train(registry, training_context, MODELS, SPLITS)
        promote(
            registry,
            "hann",
            1,
            lambda _: training_context.table,
            forced=True,
            reason="to begin with",
        )
    return (folder / "made").rename(folder / "moved")


@pytest.fixture
def registry(trained, tmp_path, monkeypatch) -> Registry:
    without_figures(monkeypatch)
    shutil.copytree(trained, tmp_path, dirs_exist_ok=True)
    return at_its_place(Registry(storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {})))


def gone(folder):
    shutil.rmtree(folder)


def changed(folder):
    file = folder / "model.json"
    file.write_text(
        file.read_text(encoding="utf-8").replace('"format"', '"Format"'), encoding="utf-8"
    )


def cut_short(folder):
    file = folder / "arrays.npz"
    file.write_bytes(file.read_bytes()[:-10])


def labelled(registry: Registry, label: str) -> Version:
    return next(version for version in registry.versions() if version.label == label)


def damage_files(registry: Registry, label: str, damage) -> None:
    with registry._model_of(labelled(registry, label)) as folder:
        damage(folder)


def damage_held_out(registry: Registry, label: str) -> None:
    folder = registry.place.folder / labelled(registry, label).run_id
    (folder / "artifacts" / "held_out.npz").write_bytes(b"PK torn")


@pytest.mark.parametrize(("damage", "said"), [
    (gone, "linear@1.*model.json"),
    (changed, "linear@1.*model.json is not"),
    (cut_short, "linear@1.*arrays.npz is not"),
])  # fmt: skip
def test_damaged_model_is_named_with_its_file_and_what_next(registry, damage, said):
    damage_files(registry, "linear@1", damage)
    assert damages(registry, registry.versions()).keys() == {labelled(registry, "linear@1").run_id}
    with pytest.raises(
        ValueError, match=f"{said}.*pyroshock train spring --models linear --split repetitions"
    ):
        registry.load(labelled(registry, "linear@1"))
    assert registry.load(labelled(registry, "hann@1")) and registry.load(
        labelled(registry, "hertz@1")
    )


def test_damaged_predictions_are_named_and_a_damaged_model_is_not_promoted(registry):
    damage_held_out(registry, "hertz@1")
    assert damages(registry, registry.versions()).keys() == {labelled(registry, "hertz@1").run_id}
    with pytest.raises(
        ValueError, match=r"hertz@1: .*held_out\.npz .*pyroshock train spring --models hertz"
    ):
        registry.held_out(labelled(registry, "hertz@1"))
    # Its held-out predictions, by which it is judged, are whole: nothing else would notice.
    damage_files(registry, "linear@1", gone)
    training_context = context_in(registry)
    with pytest.raises(
        ValueError, match=r"linear@1 cannot be promoted.*no model/data/model/model\.json"
    ):
        promote(
            registry,
            "linear",
            1,
            lambda _: training_context.table,
            forced=True,
            reason="all the same",
        )
    assert registry.champion("hammer").label == "hann@1"


@pytest.mark.slow
def test_training_again_replaces_the_damaged_one_alone(registry):
    damage_files(registry, "linear@1", gone)
    damage_held_out(registry, "hertz@1")
    told: list[str] = []
    session = train(
        registry, context_in(registry), MODELS, SPLITS, progress=Progress(tell=told.append)
    )
    assert [version.label for version in session.versions] == ["hann@1", "hertz@2", "linear@2"]
    assert damages(registry, session.versions) == {}
    assert [text.split(":")[0] for text in told[:2]] == [
        "hertz@1 is left out",
        "linear@1 is left out",
    ]


@pytest.mark.slow
def test_damaged_model_of_another_split_stops_no_training(registry):
    damage_held_out(registry, "hann@1")
    session = train(registry, context_in(registry), ["hertz"], ["configurations"])
    assert [(version.label, version.split) for version in session.versions] == [
        ("hertz@1", "configurations")
    ]


@pytest.mark.slow
def test_damaged_champion_is_replaced_by_force_alone(registry):
    damage_held_out(registry, "hann@1")
    training_context = context_in(registry)
    train(
        registry, training_context, ["kernel-ridge"], SPLITS
    )  # a usable one: others are refused before a judgement
    with pytest.raises(ValueError, match="hann@1"):
        promote(registry, "kernel-ridge", 1, lambda _: training_context.table)
    decision = promote(
        registry,
        "kernel-ridge",
        1,
        lambda _: training_context.table,
        forced=True,
        reason="its files are gone",
    )
    assert (
        decision.promoted
        and "could not be judged on unseen configurations (hann@1" in decision.reason
    )
    assert registry.champion("hammer").label == "kernel-ridge@1"


def test_commands_name_the_damaged_and_serve_the_others(registry, tmp_path, monkeypatch):
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    opened_store(url, registry, monkeypatch)
    damage_files(registry, "linear@1", changed)
    rows = json.loads(pyroshock("models", "--db", url, "--json").stdout)
    assert {row["model"]: "damaged" in row for row in rows} == {
        "hann": False,
        "hertz": False,
        "linear": True,
    }
    assert "linear@1 is damaged: linear@1: " in pyroshock("models", "--db", url).stderr
    compared = pyroshock("compare", "--db", url)
    assert (
        compared.exit_code == 0
        and "hertz@1" in compared.stdout
        and "linear@1" not in compared.stdout
    )
    assert "linear@1 is left out" in compared.stderr
    refused = pyroshock("promote", "linear", "1", "--db", url)
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert "model.json is not the file that was registered" in refused.stderr


def opened_store(url, registry, monkeypatch):
    """A store whose dataset is the table that the registry's models were trained on."""
    with opened(url, create=True):
        pass
    training_context = context_in(registry)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setattr(
        "pyroshock.dataset.snapshot.read_snapshot", lambda _store, _name: training_context
    )


@pytest.mark.slow
def test_prediction_by_a_damaged_champion_is_refused(registry, tmp_path, monkeypatch):
    """It does not fall back to a law of contact without a word."""
    gun = replace(context_in(registry), dataset=DatasetName("shots", "f" * 64, "gun"))
    train(registry, gun, ["hann"], SPLITS)
    promote(registry, "hann", 2, lambda _: gun.table, forced=True, reason="to begin with")
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    opened_store(url, registry, monkeypatch)
    damage_files(registry, "hann@2", gone)
    refused = pyroshock(
        "predict",
        "--tank-pressure",
        "5bar",
        "--bullet-mass",
        "0.5kg",
        "--tip",
        "steel",
        "--db",
        url,
    )
    assert (refused.exit_code, refused.stdout) == (2, "")
    for part in (
        "hann@2: ",
        "no model/data/model/model.json",
        "pyroshock train shots --models hann",
    ):
        assert part in refused.stderr
