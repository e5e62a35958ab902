"""Records as the registry writes them: tags, a JSON document, a file of arrays; and back."""

from __future__ import annotations

import hashlib
import json
import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...dataset.domain import Domain
from ...dataset.table import Predictor
from ..estimators.base import SettingValue
from ..evaluation.summary import Estimate
from ..models.base import ContactPrediction
from .loading import BENCH_COLUMNS, input_column, output_columns
from .records import Cost, DatasetName, Decision, HeldOutPredictions, Trained, Version

#: Of every tag of ours.
PREFIX = "pyroshock."
#: Of every parameter and metric that a training searched or found: MLflow's page lists them below
#: each other.
FIT = "fit."

#: A version without it is none of ours.
TASK_TAG = PREFIX + "task"


#: The SHA-256 of every file of the version.
FILES_TAG = PREFIX + "files"
#: Rises with each registration.
ORDER_TAG = PREFIX + "order"


#: The same for every split of one training.
TRAINING_TAG = PREFIX + "training"
#: Start of the tags that hold the records of further splits.
SPLIT_TAG = PREFIX + "split."

#: When a version was made champion, the last time.
PROMOTED_TAG = PREFIX + "promoted_at"
#: Fields of `DatasetName` that versions of older software do not have.
_KINDS = ("bench_kind", "velocity_kind")


def version_tags(
    trained: Trained, sha256: str, files: Mapping[str, str], order: int
) -> dict[str, str]:
    """Everything that a listing tells of a version: it is written in one go with the version
    itself."""
    return {
        TASK_TAG: trained.task.key,
        TRAINING_TAG: trained.task.training_key,
        PREFIX + "dataset": trained.dataset.name,
        PREFIX + "dataset_hash": trained.dataset.hash,
        PREFIX + "predictor_set": trained.dataset.predictor_set,
        PREFIX + "split": trained.task.split,
        PREFIX + "seed": str(trained.task.seed),
        PREFIX + "metrics": json.dumps(
            {name: asdict(value) for name, value in trained.metrics.items()}
        ),
        PREFIX + "cost": json.dumps(asdict(trained.cost)),
        PREFIX + "sha256": sha256,
        FILES_TAG: json.dumps(files),
        ORDER_TAG: str(order),
        **{
            PREFIX + name: value
            for name in _KINDS
            if (value := getattr(trained.dataset, name)) is not None
        },
    }


def version_from(
    name: str,
    version: int,
    run_id: str,
    created_ms: int,
    tags: Mapping[str, str],
    champion_of: str | None,
) -> Version:
    """A version as it was written."""
    own = {key.removeprefix(PREFIX): value for key, value in tags.items()}
    return Version(
        name=name,
        version=version,
        dataset=DatasetName(
            own["dataset"],
            own["dataset_hash"],
            own["predictor_set"],
            **{name: own.get(name) for name in _KINDS},
        ),
        split=own["split"],
        seed=int(own["seed"]),
        metrics={key: Estimate(**value) for key, value in json.loads(own["metrics"]).items()},
        cost=Cost(**json.loads(own["cost"])),
        task_key=own["task"],
        run_id=run_id,
        sha256=own["sha256"],
        registered_at=datetime.fromtimestamp(created_ms / 1000, UTC),
        champion_of=champion_of,
        order=int(own.get("order", "0")),
        promoted_at=tags.get(PROMOTED_TAG, ""),
        files=json.loads(tags.get(FILES_TAG, "{}")),
    )


def split_tag(
    trained: Trained,
    sha256: str,
    files: Mapping[str, str],
    order: int,
    run_id: str,
    model_id: str,
    seconds: float,
) -> tuple[str, str]:
    """Name and value of the tag that holds the record of a further split, registered at `seconds`
    since 1970."""
    digest = hashlib.sha256(trained.task.split.encode()).hexdigest()[:16]
    record = {
        "split": trained.task.split,
        "metrics": {name: asdict(value) for name, value in trained.metrics.items()},
        "cost": asdict(trained.cost),
        "task": trained.task.key,
        "sha256": sha256,
        "files": dict(files),
        "order": order,
        "run_id": run_id,
        "model_id": model_id,
        "registered_at": seconds,
    }
    return SPLIT_TAG + digest, json.dumps(record)


def further_splits(version: Version, tags: Mapping[str, str]) -> list[Version]:
    """The records of a version's further splits, from the tags of the version."""
    records = [json.loads(text) for name, text in tags.items() if name.startswith(SPLIT_TAG)]
    return [
        replace(
            version,
            split=record["split"],
            metrics={key: Estimate(**value) for key, value in record["metrics"].items()},
            cost=Cost(**record["cost"]),
            task_key=record["task"],
            run_id=record["run_id"],
            sha256=record["sha256"],
            registered_at=datetime.fromtimestamp(record["registered_at"], UTC),
            order=record["order"],
            model_id=record["model_id"],
            files=record.get("files", {}),
        )
        for record in records
    ]


def about(trained: Trained) -> dict[str, Any]:
    """What stands beside a model in its file: what it may be asked, and what it learned from."""
    return {
        "predictors": [asdict(predictor) for predictor in trained.predictors],
        "domain": trained.domain.to_json(),
        "dataset": asdict(trained.dataset),
        "split": trained.task.split,
        "seed": trained.task.seed,
        "pulses": len(trained.held_out.trained_on),
        "units": units(trained.predictors),
    }


def fit_parameters(trained: Trained) -> dict[str, str]:
    """What a training searched and found, as parameters of its run."""
    settings = trained.fit_report.parameters([predictor.name for predictor in trained.predictors])
    return {
        FIT + name: value if isinstance(value, str) else json.dumps(value)
        for name, value in settings.items()
    }


def fit_settings(parameters: Mapping[str, str]) -> dict[str, SettingValue]:
    """Settings from what `fit_parameters` wrote; none of a run of older software."""
    own = {
        name.removeprefix(FIT): text for name, text in parameters.items() if name.startswith(FIT)
    }
    return {name: _number_or_text(text) for name, text in own.items()}


def _number_or_text(text: str) -> SettingValue:
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, bool | int | float) and math.isfinite(value) else text


def sha256_of_keys(keys: NDArray[np.str_]) -> str:
    """The content of some pulses, whatever their order."""
    return hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()


def read_about(document: Mapping[str, Any]) -> tuple[tuple[Predictor, ...], Domain]:
    """Predictors and validity domain from what `about` made."""
    predictors = tuple(
        Predictor(entry["name"], entry["unit"], tuple(entry["levels"]))
        for entry in document["predictors"]
    )
    return predictors, Domain.from_json(document["domain"])


def units(predictors: tuple[Predictor, ...]) -> dict[str, dict[str, str]]:
    """Unit of every input and output; a category's is the list of its levels."""
    given = {
        input_column(p): " | ".join(p.levels) if p.levels else p.unit or "1" for p in predictors
    }
    bench = dict(zip(BENCH_COLUMNS, ("kg", "m"), strict=True))
    pulse = {name: "s" if name.endswith("_s") else "N" for name in output_columns()}
    return {"inputs": bench | given, "outputs": pulse}


def write_held_out(held_out: HeldOutPredictions, file: Path) -> None:
    """The predictions that the metrics came from, so that models are compared without being run
    again."""
    p = held_out.prediction
    spreads = {"force_spread_n": p.force_spread_n, "contact_time_spread_s": p.contact_time_spread_s}
    np.savez_compressed(
        file,
        allow_pickle=False,
        key=held_out.keys.astype(np.bytes_),
        trained_on=held_out.trained_on.astype(np.bytes_),
        force_n=p.force_n,
        contact_time_s=p.contact_time_s,
        **{name: values for name, values in spreads.items() if values is not None},
    )


class HeldOutError(ValueError):
    """A file of held-out predictions is not what was written."""


def read_held_out(file: Path) -> HeldOutPredictions:
    """Raises `HeldOutError` for a file that is not one of these."""
    try:
        with np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        prediction = ContactPrediction(
            arrays["force_n"],
            arrays["contact_time_s"],
            arrays.get("force_spread_n"),
            arrays.get("contact_time_spread_s"),
        )
        return HeldOutPredictions(
            arrays["key"].astype(np.str_), prediction, arrays["trained_on"].astype(np.str_)
        )
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, KeyError, ValueError) as error:
        raise HeldOutError(f"{file} holds no held-out predictions: {error}") from error


#: A run with it is none of a training.
DECISION_TAG = PREFIX + "decision"


def decision_tags(decision: Decision) -> dict[str, str]:
    """A decision as one tag."""
    fields = asdict(replace(decision, figures=dict(decision.figures)))
    fields["when"] = decision.when.isoformat()
    return {DECISION_TAG: json.dumps(fields)}


def decision_from(tags: Mapping[str, str]) -> Decision:
    """A decision as it was written."""
    fields = json.loads(tags[DECISION_TAG])
    return Decision(**fields | {"when": datetime.fromisoformat(fields["when"])})


def flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Nested settings as parameters: {"force": {"kind": .., "settings": {"rank": 3}}} has
    "force.rank"."""
    flattened: dict[str, str] = {}
    for key, value in settings.items():
        if isinstance(value, dict) and value.keys() == {"kind", "settings"}:
            flattened[prefix + key] = value["kind"]
            flattened |= flat(value["settings"], f"{prefix}{key}.")
        else:
            flattened[prefix + key] = (
                value if isinstance(value, str) else json.dumps(value, default=str)
            )
    return flattened
