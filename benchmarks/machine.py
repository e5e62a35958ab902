"""On what was measured: the machine, Python, and the versions of ours and of the peers."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from pathlib import Path

from .peers import version_of

#: What ours stands on, and the peers, as they are called in the registry of packages.
FOUNDATIONS = ("numpy", "scipy", "numba", "h5py", "numcodecs", "SQLAlchemy", "psycopg", "torch")
PEERS = (
    "pyyeti", "endaq", "pyDOE3", "smt", "botorch", "gpytorch", "GPy", "scikit-learn", "qcodes", "pandas", "mlflow",
)  # fmt: skip


def cores() -> int:
    """That may be used."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine() -> str:
    """Processor, cores that may be used, and system."""
    return f"{_processor()}, {cores()} cores, {platform.system()}"


def versions(packages: Sequence[str]) -> str:
    return ", ".join(f"{name} {version_of(name) or '(not installed)'}" for name in packages)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
