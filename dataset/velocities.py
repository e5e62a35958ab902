"""One meaning of the impact velocity in a dataset: the kind of every row's, and velocities
converted to one kind.

An integral to the peak of the force is not the velocity before contact where the target gives way.
What the target does meanwhile follows from the pulse and from the plate
(`twin.contact.target_motion`), with an uncertainty.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..schema.impacts import BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED, velocity_kind
from ..schema.known_factors import NONE
from .rows import Levels, Row, case_of, rows_of_snapshot
from .sources import Materials

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: How `dataset build --velocity` names what a dataset is converted to -> the kind of a velocity
#: that it then has.
CHOICES = {"before-contact": TARGET_MOTION_ADDED, "integrated": INTEGRATED}
#: Converted velocities are kept to so many digits: they are computed again whenever a frozen
#: dataset is read.
_DIGITS = 6
_PLATE = ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3")


@dataclass(frozen=True, eq=False)
class ConvertedRows:
    """Rows with velocities of one kind; by impact, relative standard uncertainties, and why others
    have none."""

    rows: list[Any]
    relative_u: Mapping[int, float]
    refused: Mapping[int, str]


def kind_of_row(row: Row) -> str | None:
    """Of the velocity that `rows.case_of` takes: the impact's own, else the shot's. None without a
    velocity."""
    if row["impact_velocity_m_s"] is not None:
        return velocity_kind(row["velocity_source"])
    return None if row["measured_velocity_m_s"] is None else BEFORE_CONTACT


def one_kind(rows: Sequence[Row]) -> str | None:
    """The kind of all velocities; None where there is none. Raises `ValueError` for several
    kinds."""
    counts = Counter(kind for row in rows if (kind := kind_of_row(row)) is not None)
    if len(counts) > 1:
        words = ", ".join(f"{count} {kind}" for kind, count in counts.most_common())
        raise ValueError(
            f"impact velocities of several kinds ({words}): choose one kind for all of them: "
            f"--velocity {' or --velocity '.join(CHOICES)}"
        )
    return next(iter(counts), None)


def definition_of(
    kind: str | None, converted: ConvertedRows | None, impacts: Sequence[int]
) -> dict[str, Any]:
    """What a dataset's definition states of its velocities: kind, how many of the `impacts` have a
    converted one, and the median relative standard uncertainty of these."""
    relative_u = {} if converted is None else converted.relative_u
    shares = [relative_u[impact] for impact in impacts if impact in relative_u]
    return {
        "kind": kind,
        "converted": len(shares),
        "relative_u": float(np.median(shares)) if shares else None,
    }


def kind_of_snapshot(session: Session, digest: str, definition: Mapping[str, Any]) -> str | None:
    """The kind that a dataset's definition states; of one that was frozen before datasets did, the
    kind of most of the impacts of the dataset with this hash."""
    stated = definition.get("velocity")
    if stated is not None:
        return None if stated["kind"] is None else str(stated["kind"])
    from .catalog import get_snapshot_row

    rows = rows_of_snapshot(session, get_snapshot_row(session, digest).id)
    counts = Counter(kind for row in rows if (kind := kind_of_row(row)) is not None)
    return counts.most_common(1)[0][0] if counts else None


def converted(
    rows: Sequence[Row], levels: Mapping[int, Levels], materials: Materials, wanted: str
) -> ConvertedRows:
    """The rows with velocities of the `wanted` kind of `CHOICES`' values, each from its own pulse
    and plate.

    Refused are rows whose plate is not known. Rows without a velocity or a pulse are left as they
    are.
    """
    from ..twin.contact.impacts import plate_impedance
    from ..twin.contact.target_motion import (
        PulseMoments,
        TargetMotion,
        integrated_velocity,
        velocity_before_contact,
    )

    refused: dict[int, str] = {}
    chosen: list[tuple[int, float, float, tuple[float, ...], bool]] = []
    for place, row in enumerate(rows):
        kind = kind_of_row(row)
        if (
            row["pulse_id"] is None
            or kind is None
            or (kind == INTEGRATED) == (wanted == INTEGRATED)
        ):
            continue
        case = case_of(row, levels[row["configuration_id"]])
        figures = materials.get(case.plate or "", {})
        plate = (*(figures.get(name) for name in _PLATE), case.plate_thickness_m)
        plate_values = tuple(float(value) for value in plate if value is not None)
        if len(plate_values) < len(plate) or case.velocity_m_s is None:
            refused[row["impact_id"]] = (
                "a velocity that cannot be converted: the plate's material or thickness is unknown"
            )
            continue
        own_u = (
            (row["impact_velocity_u_m_s"] or 0.0) if row["impact_velocity_m_s"] is not None else 0.0
        )
        anvil = case.words.get("anvil_material", NONE) != NONE
        chosen.append((place, case.velocity_m_s, own_u, plate_values, anvil))
    out: list[Any] = list(rows)
    if not chosen:
        return ConvertedRows(out, {}, refused)
    places = [item[0] for item in chosen]
    velocity, own_u = (
        np.array([item[column] for item in chosen], dtype=np.float64) for column in (1, 2)
    )
    motion = TargetMotion.of(
        plate_impedance(*np.array([item[3] for item in chosen]).T),
        np.array([item[4] for item in chosen]),
    )
    pulses = PulseMoments.of(
        np.array([rows[place]["force_points_n"] for place in places], dtype=np.float64)
    )
    if wanted == INTEGRATED:
        values, uncertainty = integrated_velocity(velocity, pulses, motion)
        uncertainty = np.hypot(uncertainty, own_u / pulses.factor)
    else:
        values, uncertainty = velocity_before_contact(velocity, pulses, motion, own_u)
    shares = {}
    for place, value, deviation in zip(places, values, uncertainty, strict=True):
        out[place] = {**rows[place], "impact_velocity_m_s": float(f"{value:.{_DIGITS}g}")}
        shares[int(rows[place]["impact_id"])] = float(deviation / value)
    return ConvertedRows(out, shares, refused)
