"""A finished training as MLflow keeps it: parameters, datasets, histories, plots, the model and its
metrics.

Which code, and which libraries, trained a model, and which it needs to predict.
"""

from __future__ import annotations

import json
import platform
import shutil
import subprocess
import time
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...dataset.table import Predictor
from ..models.serialization import parts_within, plugin_of, write_model
from ..models.training_task import TRAINING_VERSION
from ..tuning.importance import with_importance
from .loading import BENCH_COLUMNS, input_column, output_columns
from .records import Trained
from .tags import FIT, about, fit_parameters, flat, sha256_of_keys, write_held_out

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Dataset, Metric
    from mlflow.types import Schema


_PACKAGE = Path(__file__).resolve().parent.parent

#: Which every model is fitted and evaluated with, and MLflow, which keeps it.
_ALWAYS = ("numpy", "scipy")
#: Kinds that are pipelines of scikit-learn, kept by skops.
_PIPELINES = ("linear", "pls", "tree", "ensemble", "svr", "svr-kernel", "kernel-ridge")
#: Kind -> libraries whose version may change what it learns; a kind that is not listed needs no
#: more than `_ALWAYS`.
TO_FIT: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(_PIPELINES, ("scikit-learn", "skops")),
    **dict.fromkeys(("coregional", "single-outputs"), ("gpytorch", "torch")),
    "network": ("torch",),
    "genetic-network": ("torch", "scikit-learn"),
    "contact-time": ("gpytorch", "optuna", "scikit-learn", "torch"),
    "calibrated": ("scikit-learn",),
}
#: Kind -> libraries that a stored model of it is evaluated by, beside those of a kernel that was
#: handed in.
TO_PREDICT: Mapping[str, tuple[str, ...]] = dict.fromkeys(_PIPELINES, ("scikit-learn", "skops"))


def code_version(model: Mapping[str, Any]) -> dict[str, str]:
    """Name -> value: the package's version, the commit where there is one, the libraries that this
    model used.

    `model` describes it, as `models.kinds.describe` does.
    """
    versions = {
        "pyroshock": _version("pyroshock"),
        "training_version": str(TRAINING_VERSION),
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: _version(name) for name in (*_libraries(model, TO_FIT), "mlflow")},
    }
    commit, dirty = _commit()
    return versions | (
        {"commit": commit, "uncommitted_changes": str(dirty).lower()} if commit else {}
    )


def requirements(model: Mapping[str, Any]) -> list[str]:
    """What pip needs to predict with a stored model, pinned to what it was trained with; MLflow
    adds itself."""
    return [f"{name}=={_version(name)}" for name in ("pyroshock", *_libraries(model, TO_PREDICT))]


def _libraries(model: Mapping[str, Any], by_kind: Mapping[str, Iterable[str]]) -> list[str]:
    """Those of all parts of a model, in a fixed order."""
    own = {
        library
        for part in parts_within(model)
        for library in (*by_kind.get(part["kind"], ()), *_of_kernel(part), *_of_package(part))
    }
    return [*_ALWAYS, *sorted(own)]


def _of_kernel(part: Mapping[str, Any]) -> tuple[str, ...]:
    """A kernel that was handed in is described by a mapping, and evaluated by GPyTorch; one with a
    name by NumPy."""
    return ("gpytorch", "torch") if isinstance(part["settings"].get("kernel"), Mapping) else ()


def _of_package(part: Mapping[str, Any]) -> tuple[str, ...]:
    """The package of somebody else that has the kind."""
    plugin = plugin_of(part["kind"])
    return (plugin.package,) if plugin else ()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


@lru_cache(maxsize=1)
def _commit() -> tuple[str, bool]:
    """The commit of the package's own clone, and whether its Python files differ from it; empty
    elsewhere."""
    if not (_PACKAGE / ".git").exists():
        return "", False
    try:
        commit = _git("rev-parse", "HEAD")
        return commit, bool(_git("status", "--porcelain", "--", "*.py"))
    except (OSError, subprocess.SubprocessError):
        return "", False


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(_PACKAGE), *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=10
    ).stdout.strip()


#: The predictions that the metrics came from.
HELD_OUT = "held_out.npz"
#: The trials of the searches for settings, and the importance of these; not written where nothing
#: was searched.
SEARCHES = "searches.json"
#: Of a history so many points are kept, evenly with the first and the last: a picture shows no
#: more.
MOST_STEPS = 200


def log_files(client: MlflowClient, run_id: str, trained: Trained, room: Path) -> None:
    """Held-out predictions, searches with the importance of their settings, plots and versions of
    the code, all in one call."""
    room.mkdir()
    write_held_out(trained.held_out, room / HELD_OUT)
    versions = code_version(trained.packed[0]["model"])
    (room / "code_version.json").write_text(json.dumps(versions, indent=2), encoding="utf-8")
    searches = {
        name: with_importance(search).as_json()
        for name, search in trained.fit_report.searches.items()
    }
    if searches:
        (room / SEARCHES).write_text(json.dumps(searches), encoding="utf-8")
    for name, content in trained.figures.items():
        (room / name).write_bytes(content)
    client.log_artifacts(run_id, str(room))


def log_figures(client: MlflowClient, run_id: str, model_id: str, trained: Trained) -> None:
    """Datasets, parameters and metrics of a run and its model, in as few calls as MLflow allows."""
    from mlflow.entities import DatasetInput, InputTag, Param
    from mlflow.utils.mlflow_tags import MLFLOW_DATASET_CONTEXT

    sides = {side: _dataset(trained, side) for side in ("training", "held-out")}
    inputs = [
        DatasetInput(side_dataset, [InputTag(MLFLOW_DATASET_CONTEXT, side)])
        for side, side_dataset in sides.items()
    ]
    client.log_inputs(run_id, inputs)
    parameters = [Param(name, value) for name, value in _parameters(trained).items()]
    metrics = _held_out_metrics(trained, model_id, sides["held-out"]) + _fit_metrics(trained)
    client.log_batch(run_id, metrics, parameters)  # as many requests as MLflow's limits need


def log_model(trained: Trained, folder: Path) -> tuple[str, str, str]:
    """The model, of the active run: its address, its id, and the digest of its file."""
    import mlflow

    sha256 = write_model(trained.packed, about(trained), folder)
    info = mlflow.pyfunc.log_model(
        name=trained.task.model,
        loader_module="pyroshock.training.registry.loading",
        data_path=str(folder),
        signature=_signature(trained.predictors),
        metadata=about(trained) | {"sha256": sha256},
        pip_requirements=requirements(trained.packed[0]["model"]),
        model_type="contact-pulse",
        params={"split": trained.task.split, "seed": str(trained.task.seed)},
    )
    shutil.rmtree(folder)
    return str(info.model_uri), str(info.model_id), sha256


def _parameters(trained: Trained) -> dict[str, str]:
    task = trained.task
    given = {
        "model": task.model,
        "split": task.split,
        "seed": str(task.seed),
        "dataset": trained.dataset.name,
        "dataset_hash": trained.dataset.hash,
    }
    return given | flat(task.settings, "settings.") | fit_parameters(trained)


def _held_out_metrics(trained: Trained, model_id: str, held_out: Dataset) -> list[Metric]:
    """Of the model on its held-out pulses, and of its run."""
    from mlflow.entities import Metric

    figures = {"seconds": trained.cost.seconds, "peak_memory_mb": trained.cost.peak_memory_mb}
    for name, value in trained.metrics.items():
        figures |= {name: value.mean, f"{name}.low": value.low, f"{name}.high": value.high}
    of_it = {"model_id": model_id, "dataset_name": held_out.name, "dataset_digest": held_out.digest}
    now = time.time_ns() // 1_000_000
    return [Metric(name, value, now, 0, **of_it) for name, value in figures.items()]


def _fit_metrics(trained: Trained) -> list[Metric]:
    """Numbers that were searched or learned, which MLflow sorts and plots runs by, and histories by
    step."""
    from mlflow.entities import Metric

    report = trained.fit_report
    now = time.time_ns() // 1_000_000
    numbers = {
        name: float(value)
        for name, value in report.parameters(
            [predictor.name for predictor in trained.predictors]
        ).items()
        if isinstance(value, int | float)
        and not isinstance(value, bool)
        and name not in report.histories
    }
    metrics = [Metric(FIT + name, value, now, 0) for name, value in numbers.items()]
    for name, values in report.histories.items():
        metrics += [Metric(FIT + name, float(values[step]), now, step) for step in _steps(values)]
    return metrics


def _steps(values: Sequence[float]) -> list[int]:
    steps = np.linspace(0, len(values) - 1, min(len(values), MOST_STEPS)).round().astype(int)
    return [int(step) for step in steps]


def _dataset(trained: Trained, side: str) -> Dataset:
    """A side of the split as MLflow knows datasets: by name and digest, with its columns and where
    it is from.

    The digest is that of the pulses' keys, which tell what they hold; the snapshot's hash stands in
    the source.
    """
    from mlflow.entities import Dataset

    keys = trained.held_out.trained_on if side == "training" else trained.held_out.keys
    digest = sha256_of_keys(keys)
    source = {
        "snapshot": trained.dataset.hash,
        "split": trained.task.split,
        "seed": str(trained.task.seed),
        "side": side,
    }
    return Dataset(
        name=f"{trained.dataset.name}, {trained.task.split}, {side}",
        digest=digest[:36],
        source_type="code",
        source=json.dumps({"tags": source}),
        schema=json.dumps({"mlflow_colspec": _columns(trained.predictors).to_dict()}),
        profile=json.dumps(
            {"pulses": len(keys), "snapshot": trained.dataset.hash, "keys_sha256": digest}
        ),
    )


def _columns(predictors: tuple[Predictor, ...]) -> Schema:
    """Columns of the training and held-out pulses."""
    from mlflow.types import ColSpec, DataType, Schema

    types = {input_column(p): DataType.string if p.levels else DataType.double for p in predictors}
    return Schema([ColSpec(kind, name) for name, kind in types.items()])


def _signature(predictors: tuple[Predictor, ...]) -> Any:
    """Columns may be of any type to MLflow, which refuses whole numbers for "double": `loading`
    checks the values."""
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, DataType, Schema
    from mlflow.types.schema import AnyType

    needed = [input_column(predictor) for predictor in predictors]
    optional = [name for name in BENCH_COLUMNS if name not in needed]
    inputs = Schema(
        [ColSpec(AnyType(), name, required=name in needed) for name in needed + optional]
    )
    outputs = Schema([ColSpec(DataType.double, name) for name in output_columns()])
    return ModelSignature(inputs=inputs, outputs=outputs)
