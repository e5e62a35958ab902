"""Which code, and which libraries, trained a model, and which it needs to predict."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Iterable, Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ..models.serialization import parts_within
from ..models.training_task import TRAINING_VERSION

_PACKAGE = Path(__file__).resolve().parent.parent

#: Which every model is fitted and evaluated with, and MLflow, which keeps it.
_ALWAYS = ("numpy", "scipy")
#: Kinds that are pipelines of scikit-learn, kept by skops.
_PIPELINES = ("linear", "pls", "tree", "ensemble", "svr", "svr-kernel", "kernel-ridge")
#: Kind -> libraries whose version may change what it learns; a kind that is not listed needs no more than `_ALWAYS`.
TO_FIT: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(_PIPELINES, ("scikit-learn", "skops")),
    **dict.fromkeys(("coregional", "single-outputs"), ("gpytorch", "torch")),
    "network": ("torch",),
    "genetic-network": ("torch", "scikit-learn"),
    "contact-time": ("gpytorch", "optuna", "scikit-learn", "torch"),
    "calibrated": ("scikit-learn",),
}
#: Kind -> libraries that a stored model of it is evaluated by, beside those of a kernel that was handed in.
TO_PREDICT: Mapping[str, tuple[str, ...]] = dict.fromkeys(_PIPELINES, ("scikit-learn", "skops"))


def code_version(model: Mapping[str, Any]) -> dict[str, str]:
    """Name -> value: the package's version, the commit where there is one, the libraries that this model used.

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
    return versions | ({"commit": commit, "uncommitted_changes": str(dirty).lower()} if commit else {})


def requirements(model: Mapping[str, Any]) -> list[str]:
    """What pip needs to predict with a stored model, pinned to what it was trained with; MLflow adds itself."""
    return [f"{name}=={_version(name)}" for name in ("pyroshock", *_libraries(model, TO_PREDICT))]


def _libraries(model: Mapping[str, Any], by_kind: Mapping[str, Iterable[str]]) -> list[str]:
    """Those of all parts of a model, in a fixed order."""
    own = {library for part in parts_within(model) for library in (*by_kind.get(part["kind"], ()), *_of_kernel(part))}
    return [*_ALWAYS, *sorted(own)]


def _of_kernel(part: Mapping[str, Any]) -> tuple[str, ...]:
    """A kernel that was handed in is described by a mapping, and evaluated by GPyTorch; one with a name by NumPy."""
    return ("gpytorch", "torch") if isinstance(part["settings"].get("kernel"), Mapping) else ()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


@lru_cache(maxsize=1)
def _commit() -> tuple[str, bool]:
    """The commit of the package's own clone, and whether its Python files differ from it; empty elsewhere."""
    if not (_PACKAGE / ".git").exists():
        return "", False
    try:
        commit = _git("rev-parse", "HEAD")
        return commit, bool(_git("status", "--porcelain", "--", "*.py"))
    except (OSError, subprocess.SubprocessError):
        return "", False


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(_PACKAGE), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
