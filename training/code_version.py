"""Which code, and which libraries, trained a model."""

from __future__ import annotations

import platform
import subprocess
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .tasks import TRAINING_VERSION

_PACKAGE = Path(__file__).resolve().parent.parent

#: Those whose version may change a number.
_LIBRARIES = ("numpy", "scipy", "scikit-learn", "torch", "gpytorch", "optuna", "skops", "mlflow")

#: Those that a stored model needs to predict: its arrays are evaluated by numpy and scipy, or by scikit-learn's trees.
_TO_PREDICT = ("numpy", "scipy", "scikit-learn", "skops")


def code_version() -> dict[str, str]:
    """Name -> value: the package's version, the commit where there is one, the libraries."""
    found = {
        "pyroshock": _version("pyroshock"),
        "training_version": str(TRAINING_VERSION),
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: _version(name) for name in _LIBRARIES},
    }
    commit, dirty = _commit()
    return found | ({"commit": commit, "uncommitted_changes": str(dirty).lower()} if commit else {})


def requirements() -> list[str]:
    """What pip needs to predict with a stored model, pinned to what it was trained with."""
    return [f"pyroshock=={_version('pyroshock')}", *(f"{name}=={_version(name)}" for name in _TO_PREDICT)]


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
