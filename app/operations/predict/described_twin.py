"""What is told of a twin where the twin itself is not: on the machine of a client."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...twins.building import BuiltTwin


@dataclass(frozen=True)
class DescribedBench:
    """The campaign whose bench it is; None for the bench that ships with the software."""

    campaign: str | None


@dataclass(frozen=True)
class DescribedTwin:
    """What a built twin tells of itself. The server that built it keeps the twin."""

    bench: DescribedBench
    notes: tuple[str, ...]
    models: Mapping[str, str]
    sensor_names: tuple[str, ...]
    rests_on: str


def describe(built: BuiltTwin | DescribedTwin) -> DescribedTwin:
    """The description of a twin.

    Parameters:
        built: The twin, or what is told of it already.
    """
    if isinstance(built, DescribedTwin):
        return built
    rests_on = built.twin.rests_on
    return DescribedTwin(
        DescribedBench(built.bench.campaign),
        tuple(built.notes),
        dict(built.twin.models),
        tuple(built.twin.sensor_names),
        "" if rests_on is None else rests_on.sentence,
    )
