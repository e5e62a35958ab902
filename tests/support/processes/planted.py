"""Modules that somebody has laid into a folder, for whoever looks for modules there."""

from __future__ import annotations

import sys
from pathlib import Path

#: Every module of Python, and what we, or those that we use, import.
PLANTED = sorted(
    set(sys.stdlib_module_names)
    | {
        "sitecustomize",
        "usercustomize",
        "numpy",
        "scipy",
        "pandas",
        "pyarrow",
        "h5py",
        "numba",
        "joblib",
        "threadpoolctl",
    }
    | {
        "click",
        "sqlalchemy",
        "alembic",
        "mlflow",
        "torch",
        "sklearn",
        "optuna",
        "git",
        "yaml",
        "uvicorn",
        "fastapi",
    }
)


def planted(folder: Path) -> Path:
    """Modules in `folder`, each of which would write its name into the file that is given."""
    trap = folder.parent / "the-trap-went-off"
    code = f"with open({str(trap)!r}, 'a') as trap:\n    trap.write(__name__ + ' ')\n"
    for name in PLANTED:
        (folder / f"{name}.py").write_text(code, encoding="utf-8")
    return trap


def ran(trap: Path) -> str:
    return trap.read_text() if trap.exists() else ""
