"""Where each run hits the plate."""

from __future__ import annotations

from ....twin.plate.modal import ModalPlate
from ...record import CampaignRecord, Factor

FACTOR = "impact_position"


def impact_points(record: CampaignRecord, plate: ModalPlate) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The impact point of every run by its name on the plate, and what is taken for granted of them.

    A plate with one point is hit there. Raises `ValueError` for a position that a plate with several has not.
    """
    named = [_name(configuration.factors.get(FACTOR)) for configuration in record.configurations]
    first = plate.impact_points[0]
    if len(plate.impact_points) == 1:
        others = sorted({name for name in named if name is not None} - {first})
        told = f"impact positions {', '.join(others)} are taken for {first}: the plate has shapes at no other"
        return (first,) * len(record.runs), (told,) if others else ()
    for configuration, name in zip(record.configurations, named, strict=True):
        if name is not None and name not in plate.impact_points:
            raise ValueError(
                f"{configuration.label}: {FACTOR} {name!r} is not on the plate; it has {', '.join(plate.impact_points)}"
            )
    missing = f"where no {FACTOR} is stated the plate is taken to be hit at {first}"
    return tuple(named[run.configuration] or first for run in record.runs), (missing,) if None in named else ()


def _name(factor: Factor | None) -> str | None:
    if factor is None or factor == "":
        return None
    return factor if isinstance(factor, str) else f"#{factor:g}"
