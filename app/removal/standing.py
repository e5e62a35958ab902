"""What stands on a campaign or a recording, told before it goes and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...schema.removal.part import Part, campaign_part, recording_part
from ...schema.removal.removing import adopted_on, datasets_on, diagnoses_on, row_counts
from ...schema.session import Store
from ..models.training import models_extra, registry_of


def standing_on(store: Store, url: str, campaign: str, recording: str | None = None) -> dict[str, Any]:
    """Rows that would go ("counts") and what stands on them ("stood_on"), as a tombstone has it; nothing is written.

    `url` is the store's address, beside which the models lie. Raises `LookupError` for what is not in the store.
    """
    with store.reading() as session:
        part = campaign_part(session, campaign) if recording is None else recording_part(session, campaign, recording)
        datasets = datasets_on(session, part)
        dependents: dict[str, Any] = {
            "campaign": campaign,
            "recording": recording,
            "counts": row_counts(session, part),
            "stood_on": {
                "datasets": [without(dataset, "members") for dataset in datasets],
                "diagnoses": [without(diagnosis, "report") for diagnosis in diagnoses_on(session, part)],
                "adopted": adopted_on(session, part),
                "reopened": [],
            },
        }
    dependents["stood_on"]["models"] = models_on(url, datasets)
    return dependents


def models_of(store: Store, url: str, part: Part) -> list[dict[str, Any]]:
    """Registered models that were trained on a dataset with pulses of the part: label, dataset, hash."""
    with store.reading() as session:
        datasets = datasets_on(session, part)
    return models_on(url, datasets)


def models_on(url: str, datasets: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Registered models that were trained on one of these datasets."""
    if not datasets:
        return []
    hashes = {dataset["hash"] for dataset in datasets}
    with models_extra():
        versions = registry_of(url).versions()
    return [
        {"model": version.label, "dataset": version.dataset.name, "hash": version.dataset.hash}
        for version in reversed(versions)
        if version.dataset.hash in hashes
    ]


def standing_lines(stone: dict[str, Any]) -> list[str]:
    """What stood on a part, a line each: datasets, models, diagnoses, versions of the twin."""
    stood = stone["stood_on"]
    return [
        *(
            f"dataset {dataset['name']} ({dataset['pulses']} pulses, hash {dataset['hash'][:12]})"
            for dataset in stood["datasets"]
        ),
        *(f"model {model['model']} (of dataset {model['dataset']})" for model in stood["models"]),
        *(
            f"diagnosis {diagnosis['id']} of {diagnosis['diagnosed_at'][:19]} ({diagnosis['simulator']})"
            for diagnosis in stood["diagnoses"]
        ),
        *(f"version {version['version']} of the twin ({version['reason']})" for version in stood["adopted"]),
    ]


def _diagnosis(entry: dict[str, Any]) -> str:
    return f"diagnosis {entry['id']} of {entry['diagnosed_at'][:19]} ({entry['simulator']})"


def without(entry: dict[str, Any], key: str) -> dict[str, Any]:
    """A copy of the entry that lacks the key."""
    return {name: value for name, value in entry.items() if name != key}
