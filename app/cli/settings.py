"""The extraction's settings as options of `ingest` and `extract`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from ...ingest.settings import ExtractionSettings

Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS = (
    click.option("--segmentation", type=click.Choice(["walk", "mask"]), help="How a contact is delimited. [walk]"),
    click.option("--threshold", type=float, help="Share of the peak where contact begins and ends. [0.005]"),
    click.option("--smoothing", type=float, help="csaps parameter of the spline, on the sample index. [0.99]"),
    click.option("--refinement", type=int, help="Points of the fine pulse per recorded sample. [10]"),
    click.option("--points", type=int, help="Equidistant points of the force. [20]"),
    click.option("--event-share", type=float, help="An impact reaches this share of the record's largest. [0.1]"),
    click.option("--separation", "separation_s", metavar="SECONDS", help="Nearer contacts are one impact. [100ms]"),
)


def settings_options(function: Function) -> Function:
    """Add the options of the extraction; those not given keep their defaults."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def settings_from(given: dict[str, Any]) -> ExtractionSettings:
    """Settings from the options; `ValueError` names the one that is out of bounds."""
    from ...ingest.settings import ExtractionSettings
    from ..library.quantities import parse_quantity

    chosen = {key: value for key, value in given.items() if value is not None}
    if "separation_s" in chosen:
        chosen["separation_s"] = parse_quantity(chosen["separation_s"], "s", "--separation")
    return ExtractionSettings(**chosen)
