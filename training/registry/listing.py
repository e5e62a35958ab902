"""Versions chosen by name, and as rows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from ..evaluation.metrics import METRICS, OF_MEAN
from .records import Version

#: The share of measurements inside of the 90 % band; models without spread have none.
COVERED = ("force_covered", "time_covered")


def newest(versions: Iterable[Version]) -> list[Version]:
    """The newest of each model, dataset, split and seed; champions stay.

    Parameters:
        versions: Registered versions, whose order is kept.
    """
    every = list(versions)
    newest_by_name: dict[tuple[str, str, str, int], Version] = {}
    for version in sorted(
        every, key=lambda version: version.version
    ):  # numbers rise, clocks may go back
        newest_by_name[version.name, version.dataset.hash, version.split, version.seed] = version
    runs = {version.run_id for version in newest_by_name.values()}
    return [
        version for version in every if version.run_id in runs or version.champion_of is not None
    ]


def of_dataset(versions: Iterable[Version], dataset: str) -> list[Version]:
    """The versions of one dataset.

    Parameters:
        versions: Registered versions to choose from.
        dataset: The name or hash of the dataset, or the start of its hash, eight digits at least.

    Raises:
        LookupError: Where none is of this dataset; the message names those there are.
    """
    every = list(versions)
    of_it = [
        v
        for v in every
        if v.dataset.name == dataset or (len(dataset) >= 8 and v.dataset.hash.startswith(dataset))
    ]
    if not of_it:
        dataset_names = (
            ", ".join(dict.fromkeys(v.dataset.name for v in every)) or "none yet (pyroshock train)"
        )
        raise LookupError(
            f"no model of a dataset {dataset!r}; there are models of: {dataset_names}"
        )
    return of_it


def chosen(versions: Sequence[Version], text: str, split: str | None = None) -> Version:
    """The version that a text names.

    Parameters:
        versions: Registered versions to choose from.
        text: "hybrid@3", "hybrid@champion" or "hybrid", which is the newest.
        split: Of the records of a version, that of this split is given where there is one, else
            that of the model that is put in use. Of a bare name the newest version of this split is
            given; by default of any split.

    Raises:
        LookupError: For a version that there is not; the message names what there is.
    """
    name, _, which = text.partition("@")
    named = [version for version in versions if version.name == name]
    if not named:
        model_names = (
            ", ".join(dict.fromkeys(version.name for version in versions))
            or "none yet (pyroshock train)"
        )
        raise LookupError(f"no registered model {name!r}; there are: {model_names}")
    if which == "champion":
        matches = [version for version in named if version.champion_of is not None]
    elif which:
        matches = [version for version in named if str(version.version) == which]
    else:
        matches = [version for version in named if split is None or version.split == split]
    if not matches:
        version_names = ", ".join(
            f"{number} ({', '.join(splits)})" for number, splits in _splits_by_number(named)
        )
        raise LookupError(
            f"no {text!r}{f' of split {split!r}' if split and not which else ''}; versions: "
            f"{version_names}"
        )
    return max(
        matches, key=lambda version: (version.version, version.split == split, version.is_served)
    )


def _splits_by_number(versions: Sequence[Version], most: int = 12) -> list[tuple[int, list[str]]]:
    splits: dict[int, list[str]] = {}
    for version in versions:
        splits.setdefault(version.version, []).append(version.split)
    return list(splits.items())[:most]


def in_order(versions: Iterable[Version]) -> list[Version]:
    """Of all models, the one that was registered last first. A clock that was set back changes
    nothing.

    Parameters:
        versions: Registered versions in any order.
    """
    return sorted(versions, key=lambda v: (v.order, v.registered_at, v.version), reverse=True)


def row_of(version: Version) -> dict[str, Any]:
    """A version as commands print it in JSON; a number that is not known is None.

    Parameters:
        version: An entry of `Registry.versions`, which is the record of one split.
    """
    metrics = version.metrics
    row: dict[str, Any] = {
        "model": version.name,
        "version": version.version,
        "split": version.split,
        "metrics": {name: finite(metrics[name].mean) for name in METRICS},
        "seconds": version.cost.seconds,
        "ci90": {
            name: _interval(metrics[name].low, metrics[name].high)
            for name in (*METRICS, *COVERED)
            if name in metrics
        },
        "coverage90": {name: finite(metrics[name].mean) for name in COVERED if name in metrics}
        or None,
        "force_nrmse_of_mean": finite(metrics[OF_MEAN].mean) if OF_MEAN in metrics else None,
        "dataset": version.dataset.name,
        "dataset_hash": version.dataset.hash,
        "velocity_kind": version.dataset.velocity_kind,
        "seed": version.seed,
        "peak_memory_mb": finite(version.cost.peak_memory_mb),
        "registered_at": version.registered_at.isoformat(timespec="seconds"),
    }
    return row | ({"champion_of": version.champion_of} if version.champion_of else {})


def flat_row(version: Version) -> dict[str, Any]:
    """A version as one level of columns: the metrics' means and the coverages beside the names.

    Parameters:
        version: An entry of `Registry.versions`, which is the record of one split.
    """
    row = row_of(version)
    names = ("model", "version", "split", "dataset", "seed")
    means: dict[str, Any] = row["metrics"] | {
        name: (row["coverage90"] or {}).get(name) for name in COVERED
    }
    others = {name: row[name] for name in ("seconds", "registered_at")}
    return (
        {name: row[name] for name in names} | means | others | {"champion_of": version.champion_of}
    )


def finite(value: float) -> float | None:
    """The number, or None where it is not finite: JSON has no NaN.

    Parameters:
        value: The number.
    """
    return value if math.isfinite(value) else None


def _interval(low: float, high: float) -> list[float] | None:
    return [low, high] if math.isfinite(low) and math.isfinite(high) else None
