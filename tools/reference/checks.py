"""Every quality check: of a campaign's recordings, and of any recording alone."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from pyroshock.signals import checks
from pyroshock.signals.checks import levels

from .markdown import code, escaped, joined, prose
from .values import constants_table


def page() -> str:
    """A section a check: what it finds, its limits and their reasons."""
    return joined(
        "## Of a record",
        "Made of every channel when a campaign is ingested, in this order, and by "
        f"{code('pyroshock srs')}. Those of an ingest are stored with their evidence.",
        *(_section(check) for check in checks.CHECKS),
        "### What several of them share",
        constants_table(levels),
        "## Of a spectrum",
        f"Made by {code('pyroshock srs')}.",
        *(_section(check) for check in checks.SPECTRUM_CHECKS),
    )


def name_of(check: Callable[..., Any]) -> str:
    """As findings call it: "zero-shift"."""
    return check.__name__.removeprefix("check_").replace("_", "-")


def _section(check: Callable[..., Any]) -> str:
    module = import_module(check.__module__)
    title = f"### {name_of(check)}"
    file = code(check.__module__.removeprefix("pyroshock.").replace(".", "/") + ".py")
    return joined(
        title,
        prose(module.__doc__),
        prose(check.__doc__),
        constants_table(module),
        f"In {escaped(file)}.",
    )
