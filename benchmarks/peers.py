"""The software that ours is measured beside: whether it is there, and which version.

What does not agree with our own pins has an environment of its own, `.venv/peers/NAME`, made by `make bench`.
"""

from __future__ import annotations

import sys
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from .measuring import ROOT

ABSENT = "not installed: `make bench` does it"
_OWN = ROOT / ".venv" / "peers"


def has(module: str) -> bool:
    """Whether `import module` finds something in this environment."""
    return find_spec(module) is not None


def version_of(package: str) -> str:
    """As pip calls it; "" where it is not installed, here or in an environment of its own."""
    try:
        return version(package)
    except PackageNotFoundError:
        return _own_version(package)


def python_of(name: str) -> Path | None:
    """The interpreter of the environment `.venv/peers/NAME`; None where there is none."""
    found = _OWN / name / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    return found if found.exists() else None


def _own_version(package: str) -> str:
    """Read from the name of its metadata folder: importing it there would start another interpreter."""
    wanted = package.lower().replace("-", "_")
    for folder in _OWN.glob("*/lib/python*/site-packages/*.dist-info"):
        name, _, number = folder.name.removesuffix(".dist-info").partition("-")
        if name.lower().replace("-", "_") == wanted:
            return number
    return ""
