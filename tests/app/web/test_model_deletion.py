"""Datasets and versions of models deleted from their pages: what uses them is named, and then
nothing goes."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.common.model_registry import registry_of
from pyroshock.app.operations.train.deletion import delete_version
from support.processes.web_client import post, sqlite, window
from support.stores.web_stores import DATASET, Lab

pytestmark = pytest.mark.timeout(600)


@pytest.fixture
def own(filled_lab: Path, quick_plates: None, tmp_path: Path) -> Iterator[Lab]:
    """The window over a copy of the filled store: what is deleted here, others need."""
    shutil.copytree(filled_lab, tmp_path / "lab")
    with window(sqlite(tmp_path / "lab")) as (client, store):
        yield Lab(client, store, sqlite(tmp_path / "lab"), tmp_path / "lab")


def labels(lab: Lab) -> list[str]:
    return [version.label for version in registry_of(lab.db).versions() if version.is_served]


def test_dataset_with_models_is_refused_with_the_models(own: Lab) -> None:
    assert f'href="/datasets/{DATASET}/delete"' in own.client.get(f"/datasets/{DATASET}").text
    before, models = own.rows(), labels(own)
    page = own.client.get(f"/datasets/{DATASET}/delete").text
    assert 'id="refusal"' in page and 'id="delete"' not in page
    assert all(
        f'<a href="/models/{label.replace("@", "/")}">{label}</a>' in page for label in models
    )
    answer = post(own.client, f"/datasets/{DATASET}/delete")
    assert answer.status_code in (409, 422) and models[0] in answer.text
    assert own.rows() == before


def test_dataset_without_models_goes_and_its_pulses_stay(own: Lab) -> None:
    for label in labels(own):
        delete_version(own.db, label)
    before = own.rows()
    page = own.client.get(f"/datasets/{DATASET}/delete").text
    assert 'id="lost"' in page and 'id="kept"' in page and "The pulses, with their impacts" in page
    answer = post(own.client, f"/datasets/{DATASET}/delete")
    assert (answer.status_code, answer.headers["location"]) == (303, "/datasets")
    assert own.client.get(f"/datasets/{DATASET}").status_code == 404
    assert own.client.get(f"/datasets/{DATASET}/delete").status_code == 404
    assert own.rows()["pulses"] == before["pulses"]


def test_version_goes_and_the_one_in_use_is_refused(own: Lab) -> None:
    first, *others = labels(own)
    address = f"/models/{first.replace('@', '/')}"
    assert f'href="{address}/delete"' in own.client.get(address).text
    registry = registry_of(own.db)
    version = next(
        entry for entry in registry.versions() if entry.label == first and entry.is_served
    )
    registry.set_champion(version)
    page = own.client.get(f"{address}/delete").text
    assert 'id="refusal"' in page and "it is the model in use" in page and 'id="delete"' not in page
    answer = post(own.client, f"{address}/delete")
    assert answer.status_code in (409, 422) and "it is the model in use" in answer.text
    assert labels(own) == [first, *others]
    assert others, "the filled store has two versions"
    other = f"/models/{others[0].replace('@', '/')}"
    page = own.client.get(f"{other}/delete").text
    assert "not given to another version" in page and 'id="refusal"' not in page
    answer = post(own.client, f"{other}/delete")
    assert (answer.status_code, answer.headers["location"]) == (303, "/models")
    assert labels(own) == [first, *others[1:]]
    assert own.client.get(f"{other}/delete").status_code == 404
