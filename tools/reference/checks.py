"""Every quality check: of a campaign's recordings, and of any recording alone."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from pyroshock.signals import checks as quality
from pyroshock.signals.checks import levels as recorded_levels
from pyroshock.twin.srs import checks as alone
from pyroshock.twin.srs.checks import base as alone_base

from .markdown import code, escaped, joined, prose
from .values import constants_table


def page() -> str:
    """A section a check: what it finds, its limits and their reasons."""
    return joined(
        "## Of a campaign's recordings",
        "Made when a campaign is ingested, of every channel, in this order; findings are stored with their evidence.",
        *(_section(check) for check in quality.CHECKS),
        "### What several of them share",
        constants_table(recorded_levels),
        "## Of any recording alone",
        f"Made by {code('pyroshock srs')} and beside every spectrum.",
        *(_section(check, "of a recording alone") for check in alone.CHECKS),
        "### What several of these share",
        constants_table(alone_base),
    )


def name_of(check: Callable[..., Any]) -> str:
    """As findings call it: "zero-shift"."""
    return check.__name__.removeprefix("check_").replace("_", "-")


def _section(check: Callable[..., Any], where: str = "") -> str:
    module = import_module(check.__module__)
    title = f"### {name_of(check)}" + (f", {where}" if where else "")
    file = code(check.__module__.removeprefix("pyroshock.").replace(".", "/") + ".py")
    return joined(title, prose(module.__doc__), prose(check.__doc__), constants_table(module), f"In {escaped(file)}.")
