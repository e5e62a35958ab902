"""The bench that a twin is made of: a campaign's, a file's, or the shipped one; each part says
where it is from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...array_types import Floats
from ...files.toml_text import check_keys, read_toml_text, toml_table
from ...twin.gun.bench import GunBench

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.benches import Plate
    from ...schema.campaigns import Campaign
    from ...twin.plate.modal import ModalPlate


Point = tuple[float, float]

#: Section 2.1.1 of the thesis: 10 mm, in the shape of a diamond whose size is only drawn: 1 m by
#: 0.6 m is assumed.
THICKNESS_M = 0.010
OUTLINE_M: tuple[Point, ...] = ((0.0, 0.3), (0.5, 0.0), (1.0, 0.3), (0.5, 0.6))
DAMPING_RATIO = 0.005
#: The kind of campaigns that are fired, and the bullet where a shot says none.
GUN, BULLET_MASS_KG = "gun", 0.5
#: A bench's plate is between these.
_FARTHEST_M, _SMALLEST_M2 = 1000.0, 1e-9


@dataclass(frozen=True)
class PlateDrawing:
    """What the finite element model of a plate needs but its material; points in m, as the outline.

    Where no points are known, #1 is the centroid, #2 and #3 a third of the way from there to the
    second and the fourth corner; `acceleration_1` stands halfway to the first, `acceleration_2` to
    the middle of the side from the second to the third.
    """

    thickness_m: float
    outline_m: tuple[Point, ...]
    impact_points: Mapping[str, Point]
    sensors: Mapping[str, Point]
    damping_ratio: float
    source: str

    @classmethod
    def of(
        cls, outline_m: Sequence[Point], source: str, thickness_m: float = THICKNESS_M
    ) -> PlateDrawing:
        outline = tuple((float(x), float(y)) for x, y in outline_m)
        _refuse_no_area(outline)
        points, sensors = _default_layout(outline)
        return cls(thickness_m, outline, points, sensors, DAMPING_RATIO, source)

    @property
    def area_m2(self) -> float:
        from ...dataset.rows import polygon_area

        return polygon_area(self.outline_m) or 0.0

    def at(self, impact_points: Sequence[Point], sensors: Sequence[Point]) -> PlateDrawing:
        """With points of one's own, named #1, #2... and acceleration_1, acceleration_2...; none: as
        they are."""
        named = {f"#{i}": point for i, point in enumerate(impact_points, 1)}
        channels = {f"acceleration_{i}": point for i, point in enumerate(sensors, 1)}
        return replace(
            self, impact_points=named or self.impact_points, sensors=channels or self.sensors
        )

    def raised(self, height_m: float) -> PlateDrawing:
        """A plate that hangs higher: the gun's axis meets it lower by that, its sensors move with
        it. y is upwards.

        Raises `ValueError` for a point outside of the outline.
        """
        if not height_m:
            return self
        points = {name: (x, y - height_m) for name, (x, y) in self.impact_points.items()}
        for name, point in points.items():
            if not _inside(self.outline_m, point):
                raise ValueError(
                    f"chain height {1e3 * height_m:g} mm: impact position {name} would be at "
                    f"({point[0]:.3g}, {point[1]:.3g}) m, outside of the plate"
                )
        return replace(self, impact_points=points)


def _inside(outline_m: Sequence[Point], point: Point) -> bool:
    """By the crossings of a ray to the right."""
    x, y = point
    crossings = 0
    for (x0, y0), (x1, y1) in zip(outline_m, (*outline_m[1:], outline_m[0]), strict=True):
        if (y0 > y) != (y1 > y):
            crossings += x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    return crossings % 2 == 1


@dataclass(frozen=True, eq=False)
class Bench:
    """Gun and plate, and where they are from. `modes` is a measured table, which goes before the
    drawing.

    `kind` is that of its campaigns; a bench of another kind than "gun" has no gun of its own, and
    shots on it have an impact velocity. `impactor_mass_kg` is the mass where a shot says none: the
    hammer's, or a usual bullet's.
    """

    gun: GunBench
    gun_source: str
    drawing: PlateDrawing
    plate_material: str
    modes: ModalPlate | None = None
    modes_source: str = ""
    campaign: str | None = None
    kind: str = GUN
    impactor_mass_kg: float = BULLET_MASS_KG

    @property
    def has_gun(self) -> bool:
        return self.kind == GUN

    def impact_points(self, own: Sequence[Point]) -> tuple[str, ...]:
        """Names of the points of the plate that can be struck, where `own` points are placed."""
        if self.modes is not None:
            return self.modes.impact_points
        return tuple(self.drawing.at(own, ()).impact_points)


def shipped_bench() -> Bench:
    """The gun of the thesis's first shots, and a plate of assumed size."""
    text = (files("pyroshock") / "examples" / "first-shots" / "campaign.toml").read_text(
        encoding="utf-8"
    )
    gun = GunBench(**toml_table(text)["bench"]["gun"])
    return Bench(
        gun,
        "first-shots, shipped",
        PlateDrawing.of(OUTLINE_M, "assumed outline, 1 m x 0.6 m"),
        "aluminum",
    )


def bench_of_campaign(session: Session, name: str | None) -> Bench:
    """Of a campaign, else of the newest one that states a gun, else of the newest of the kind gun;
    what it does not tell is the shipped bench's.

    Raises `LookupError` for a campaign there is none of.
    """
    bench, campaign = shipped_bench(), _campaign(session, name)
    if campaign is None:
        return bench
    if campaign.gun is not None:
        from ...dataset.rows import gun_bench

        bench = replace(bench, gun=gun_bench(campaign.gun), gun_source=f"campaign {campaign.name}")
    if campaign.hammer is not None:
        bench = replace(bench, impactor_mass_kg=campaign.hammer.mass_kg)
    if campaign.plate is not None:
        bench = _with_plate(session, bench, campaign.plate, f"campaign {campaign.name}")
    return replace(bench, campaign=campaign.name, kind=campaign.kind)


def bench_of_file(path: Path, bench: Bench) -> Bench:
    """The tables [gun] and [plate] of a TOML file in place of those of `bench`. Raises `ValueError`
    naming the key."""
    try:
        table = toml_table(read_toml_text(path))
        check_keys(table, ("gun", "plate"), "the file")
        if "gun" in table:
            gun_keys = tuple(field.name for field in fields(GunBench))
            check_keys(table["gun"], gun_keys, "[gun]", required=gun_keys)
            bench = replace(bench, gun=GunBench(**table["gun"]), gun_source=path.name, kind=GUN)
        return _with_plate_table(bench, table["plate"], path) if "plate" in table else bench
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{path.name}: {error}") from error


_PLATE_KEYS = (
    "material",
    "thickness_m",
    "outline_m",
    "damping_ratio",
    "impact_points",
    "sensors",
    "modes",
)


def _with_plate_table(bench: Bench, table: Mapping[str, Any], path: Path) -> Bench:
    check_keys(table, _PLATE_KEYS, "[plate]")
    thickness = float(table.get("thickness_m", bench.drawing.thickness_m))
    drawing = replace(bench.drawing, thickness_m=thickness)
    if "outline_m" in table:
        drawing = PlateDrawing.of(table["outline_m"], path.name, thickness)
    points, sensors = (_points(table.get(key, {})) for key in ("impact_points", "sensors"))
    drawing = replace(
        drawing,
        damping_ratio=float(table.get("damping_ratio", drawing.damping_ratio)),
        impact_points=points or drawing.impact_points,
        sensors=sensors or drawing.sensors,
    )
    bench = replace(
        bench, drawing=drawing, plate_material=str(table.get("material", bench.plate_material))
    )
    return (
        with_modes(bench, path.parent / str(table["modes"]))
        if "modes" in table
        else replace(bench, modes=None)
    )


def with_modes(bench: Bench, path: Path) -> Bench:
    """The bench with the modal table of a file. Raises as `read_modal_table`."""
    from ...twin.plate.table import read_modal_table

    return replace(bench, modes=read_modal_table(path), modes_source=f"modal table {path.name}")


def _points(table: Mapping[str, Any]) -> dict[str, Point]:
    if not isinstance(table, Mapping):
        raise ValueError(f"points are {table!r:.100}; expected a table of names and places [x, y]")
    return {name: (float(x), float(y)) for name, (x, y) in table.items()}


def _campaign(session: Session, name: str | None) -> Campaign | None:
    from sqlalchemy import select

    from ...schema.campaigns import Campaign
    from ...schema.listings import get_campaign_id

    if name is not None:
        return session.get_one(Campaign, get_campaign_id(session, name))
    newest = select(Campaign).order_by(Campaign.date.desc(), Campaign.id.desc())
    with_gun = session.scalars(newest.where(Campaign.gun_id.is_not(None))).first()
    # A campaign of a gun that states no bench still has shots: those of the shipped bench's
    # numbers.
    return with_gun or session.scalars(newest.where(Campaign.kind == GUN)).first()


def _with_plate(session: Session, bench: Bench, plate: Plate, source: str) -> Bench:
    from ...dataset.rows import modal_plate
    from ...schema.benches import Material, ModalTable

    drawing = replace(bench.drawing, thickness_m=plate.thickness_m or bench.drawing.thickness_m)
    if plate.outline_m:
        drawing = PlateDrawing.of(plate.outline_m, source, drawing.thickness_m)
    bench = replace(bench, drawing=drawing)
    if plate.material_id is not None:
        bench = replace(bench, plate_material=session.get_one(Material, plate.material_id).name)
    if plate.modal_table_id is None:
        return bench
    modes = modal_plate(session.get_one(ModalTable, plate.modal_table_id))
    return replace(bench, modes=modes, modes_source=f"modal table of {source}")


def _refuse_no_area(outline: tuple[Point, ...]) -> None:
    """Corners in millimetres, or on one line, would give a plate of no use, or none."""
    x, y = zip(*outline, strict=True) if outline else ((), ())
    within = len(outline) >= 3 and all(abs(value) <= _FARTHEST_M for value in (*x, *y))
    cross = sum(x[i - 1] * y[i] - x[i] * y[i - 1] for i in range(len(outline))) if within else 0.0
    if not abs(cross) > _SMALLEST_M2:
        raise ValueError(
            f"outline_m is {list(outline)!r:.100}; "
            f"expected three corners or more, around an area, within {_FARTHEST_M:g} m"
        )


def _default_layout(outline: tuple[Point, ...]) -> tuple[dict[str, Point], dict[str, Point]]:
    corners = np.array(outline)
    x, y = corners.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    centre = ((corners + np.roll(corners, -1, axis=0)) * cross[:, None]).sum(axis=0) / (
        3 * cross.sum()
    )

    def towards(corner: Floats, share: float) -> Point:
        a, b = centre + share * (corner - centre)
        return float(a), float(b)

    fourth = corners[3 % len(corners)]
    points = {
        "#1": towards(centre, 0.0),
        "#2": towards(corners[1], 1 / 3),
        "#3": towards(fourth, 1 / 3),
    }
    # Not across from each other: on a symmetric outline two sensors would feel the same.
    sides = {"acceleration_1": corners[0], "acceleration_2": (corners[1] + corners[2]) / 2}
    return points, {name: towards(at, 0.5) for name, at in sides.items()}


#: The regulator holds no less (gauge).
LEAST_PRESSURE_PA = 0.2e5
