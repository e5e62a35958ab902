"""What tests may lack on a machine: shells, browsers and servers, and nothing else.

A test that lacks one of them is skipped, and the end of the run says how many were
(`tests/conftest.py`). Whatever else a test needs is in the repository or installed with it
(`pyproject.toml`), so that its absence fails the test.
"""

from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Iterable
from typing import NoReturn

import pytest

#: What may be missing, and what it is.
MAY_BE_MISSING = {
    "bash": "shell",
    "zsh": "shell",
    "fish": "shell",
    "chromium": "browser",
    "PostgreSQL": "server",
}
_WANT = "for want of "
_REASON = re.compile(rf"{_WANT}(\w+)")


def needs_program(name: str, *alternatives: str) -> str:
    """The path of a program, or of one that does the same; skips the test without any where it may
    be missing."""
    path = next(filter(None, map(shutil.which, (name, *alternatives))), None)
    if path is None:
        skip_for_want_of(name, f"PATH has no {' nor '.join((name, *alternatives))}")
    return path


def skip_for_want_of(name: str, why: str) -> NoReturn:
    """Skips the test, or fails it where tests may not lack this."""
    if name not in MAY_BE_MISSING:
        pytest.fail(
            f"{name} is missing: {why}. Tests may lack shells, browsers and servers alone: take a "
            "Python package that does the same, and enter it in pyproject.toml"
        )
    pytest.skip(f"{_WANT}{name}: {why}")


def summary_of(reasons: Iterable[str]) -> str:
    """ "3 tests skipped for want of: fish (1), zsh (2)"; "" where no test was."""
    counts = Counter(match[1] for reason in reasons if (match := _REASON.search(reason)))
    if not counts:
        return ""
    total, listed = (
        sum(counts.values()),
        ", ".join(f"{name} ({counts[name]})" for name in sorted(counts)),
    )
    return f"{total} test{'s' if total > 1 else ''} skipped for want of: {listed}"
