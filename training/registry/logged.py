"""A finished training as MLflow keeps it: parameters, datasets, plots, the model and its metrics."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ...dataset.table import POINTS, Predictor
from ..code_version import code_version, requirements
from ..models.pack import write_model
from ..records import Trained
from .written import about, flat, write_held_out

#: The predictions that the metrics came from.
HELD_OUT = "held_out.npz"


def log_run(trained: Trained, room: Path) -> None:
    """Parameters, datasets, predictions and plots of the active run."""
    import mlflow

    task = trained.task
    given = {"model": task.model, "split": task.split, "seed": task.seed, "dataset": trained.dataset.name}
    mlflow.log_params(given | {"dataset_hash": trained.dataset.hash} | flat(task.settings, "settings."))
    mlflow.log_input(_dataset(trained, "training"), context="training")
    mlflow.log_input(_dataset(trained, "held-out"), context="held-out")
    write_held_out(trained.held_out, room / HELD_OUT)
    mlflow.log_artifact(str(room / HELD_OUT))
    mlflow.log_dict(code_version(), "code_version.json")
    for name, content in trained.figures.items():
        (room / name).write_bytes(content)
        mlflow.log_artifact(str(room / name))


def log_model(trained: Trained, folder: Path) -> tuple[str, str]:
    """The model and its metrics on the held-out pulses; its address, and the digest of its file."""
    import mlflow

    sha256 = write_model(trained.packed, about(trained), folder)
    info = mlflow.pyfunc.log_model(
        name=trained.task.model,
        loader_module="pyroshock.training.loading",
        data_path=str(folder),
        signature=_signature(trained.predictors),
        metadata=about(trained) | {"sha256": sha256},
        pip_requirements=requirements(),
        model_type="contact-pulse",
        params={"split": trained.task.split, "seed": str(trained.task.seed)},
    )
    metrics = {"seconds": trained.cost.seconds, "peak_memory_mb": trained.cost.peak_memory_mb}
    for name, value in trained.metrics.items():
        metrics |= {name: value.mean, f"{name}.low": value.low, f"{name}.high": value.high}
    mlflow.log_metrics(metrics, model_id=info.model_id, dataset=_dataset(trained, "held-out"))
    shutil.rmtree(folder)
    return str(info.model_uri), sha256


def _dataset(trained: Trained, side: str) -> Any:
    """A side of the split as MLflow knows datasets: by name and a digest (of the pulses' keys)."""
    from mlflow.data.code_dataset_source import CodeDatasetSource
    from mlflow.data.meta_dataset import MetaDataset

    keys = trained.held_out.trained_on if side == "training" else trained.held_out.keys
    digest = hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()[:36]
    source = {
        "snapshot": trained.dataset.hash,
        "split": trained.task.split,
        "seed": str(trained.task.seed),
        "side": side,
    }
    name = f"{trained.dataset.name}, {trained.task.split}, {side}"
    return MetaDataset(CodeDatasetSource(source), name=name, digest=digest)


def _signature(predictors: tuple[Predictor, ...]) -> Any:
    from mlflow.models import ModelSignature
    from mlflow.types import Schema, TensorSpec

    def arrays(shapes: dict[str, tuple[int, ...]]) -> Any:
        return Schema([TensorSpec(np.dtype(np.float64), shape, name) for name, shape in shapes.items()])

    inputs = arrays({"x": (-1, len(predictors)), "impactor_mass_kg": (-1,), "plate_thickness_m": (-1,)})
    pulse: dict[str, tuple[int, ...]] = {"force_n": (-1, POINTS), "contact_time_s": (-1,)}
    pulse |= {"force_spread_n": (-1, POINTS), "contact_time_spread_s": (-1,)}
    return ModelSignature(inputs=inputs, outputs=arrays(pulse))
