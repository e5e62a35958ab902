"""Lists of impacts and shots: filtered and sorted in the database, with actions on the impacts that
are ticked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Form, Query
from sqlalchemy import Select, select
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...dataset.snapshot import build_snapshot
from ...files.delimited_text import parse_number
from ...schema.campaigns import Campaign
from ...schema.conditions import QUALITIES, QUALITY, list_campaign_names
from ...schema.impacts import Impact
from ...schema.listings import (
    count_impacts,
    count_shots,
    impacts_of_shots,
    list_impacts_page,
    list_impacts_sorted,
    list_levels,
    list_shots_page,
    list_thumbnails,
)
from ...schema.person_roles import READER
from ..common.filters import parse_where
from ..common.nominal_velocity import with_predictions
from ..common.quantities import cell, display_of, heading, velocities_of, velocity_with_uncertainty
from ..operations.faults import FieldError
from ..operations.impacts.listing import ImpactRows
from ..operations.train.build_dataset import DATASET_BUILD
from ..web.dependencies import OpenStore, Text
from ..web.forms import status_of_fault
from ..web.page_sources import THE_STORE
from ..web.rendering import page, part, query
from ..web.role_needs import NeedsRole, role_of

router = APIRouter()
_READS = NeedsRole(READER, "the comparison of impacts")
PAGE = 100
#: Impacts of a filter that are counted; of more it is said that they are more.
COUNTED = 100_000
Where = Annotated[list[str], Query(max_length=40)]
Columns = Annotated[list[str], Query(max_length=60)]
After = Annotated[int | None, Query(ge=1, le=2**31 - 1)]
#: Rows that are passed over in a sorted list; beyond, a filter is the better way.
Offset = Annotated[int, Query(ge=0, le=100_000)]
#: What a telephone shows beside the thumbnail of the pulse.
MAIN = ("id", "quality", "peak_force_n", "contact_time_s")
#: Width and height of a thumbnail, in its own units.
_WIDTH, _HEIGHT = 76.0, 24.0


#: Choices of a select; of more, a value is typed and the choices are suggested.
MOST_OPTIONS = 12
#: Before the name of a factor whose value is typed.
TYPED = "level."


@dataclass(frozen=True)
class Menu:
    """The choices of one factor, or of the quality: conditions of the address and the words of
    each."""

    label: str
    options: tuple[tuple[str, str], ...]
    chosen: str
    key: str = ""

    @property
    def typed(self) -> str:
        """The words of what was chosen, for a field in which one types."""
        return next((words for text, words in self.options if text == self.chosen), "")

    @property
    def is_long(self) -> bool:
        """Whether there are too many choices for a select: they are suggestions of a field then."""
        return len(self.options) > MOST_OPTIONS


@router.get("/impacts", dependencies=[Depends(THE_STORE)])
def impacts(
    request: Request,
    store: OpenStore,
    where: Where = [],  # noqa: B006
    campaign: str = "",
    sort: str = "",
    offset: Offset = 0,
    after: After = None,
    columns: Columns = [],  # noqa: B006
) -> Response:
    where = [condition for condition in where if condition.strip()]
    error, status, following = "", 200, None
    rows: list[dict[str, Any]] = []
    thumbnails: dict[int, list[float]] = {}
    total = rows_before = 0
    address = {"campaign": campaign, "where": where, "sort": sort, "columns": columns}
    with store.reading() as session:
        campaigns, levels = list_campaign_names(session), list_levels(session)
        where += _typed_conditions(levels, request.query_params)
        try:
            conditions = parse_where(tuple(where))
            if sort:
                column, falling = sort.removeprefix("-"), sort.startswith("-")
                rows, more = list_impacts_sorted(
                    session,
                    campaign or None,
                    conditions,
                    column,
                    descending=falling,
                    offset=offset,
                    limit=PAGE,
                )
                following = query({**address, "offset": offset + PAGE}) if more else None
            else:
                rows, last = list_impacts_page(session, campaign or None, conditions, after, PAGE)
                following = query({**address, "after": last}) if last else None
            total = count_impacts(session, campaign or None, conditions, COUNTED)
            rows_before = offset
            if after is not None:
                rows_before = count_impacts(session, campaign or None, conditions, COUNTED, after)
            thumbnails = list_thumbnails(session, [row["id"] for row in rows])
        except (ValueError, LookupError) as why:
            error, status = str(why), status_of_fault(why)
    listed = ImpactRows(rows, "")
    rows = [listed.shortened(row) for row in rows]
    names = list(dict.fromkeys(name for row in rows for name in row))
    shown = [name for name in names if name in columns] if columns else _varied(rows, names)
    menus = _menus(levels, where)
    with velocities_of(rows):
        return page(
            request,
            "impacts.html",
            status=status,
            rows=rows,
            names=[name for name in names if name not in ("id", QUALITY)],
            shown=[name for name in shown if name not in ("id", QUALITY)],
            main=MAIN,
            thumbnails={key: thumbnail_points(forces) for key, forces in thumbnails.items()},
            size=(_WIDTH, _HEIGHT),
            campaigns=campaigns,
            campaign=campaign,
            menus=menus,
            conditions=[
                condition for condition in where if condition not in {menu.chosen for menu in menus}
            ],
            error=error,
            position=_position(rows_before, len(rows), total),
            sort=sort,
            sorts={name: _sorted_address(address, sort, name) for name in names},
            following=following or "",
            beginning=(query(address) or "/impacts") if after or offset else "",
            compared=query({"campaign": campaign, "where": where}),
        )


def _position(rows_before: int, rows_shown: int, total: int, noun: str = "impact") -> str:
    """`Impacts 101 to 200 of 10,077`; a number beyond `COUNTED` is not exact."""
    if not rows_shown:
        return ""
    of = f"{total:,}" if total <= COUNTED else f"more than {COUNTED:,}"
    if rows_before > COUNTED:
        return f"{rows_shown} of {of} {noun}s, beyond the first {COUNTED:,}"
    if rows_shown == total:
        return f"{total:,} {noun}{'s' if total > 1 else ''}"
    return f"{noun.capitalize()}s {rows_before + 1:,} to {rows_before + rows_shown:,} of {of}"


def _varied(rows: Sequence[Mapping[str, Any]], names: Iterable[str]) -> list[str]:
    """Columns that are worth their place: those whose values differ, and those that people look for
    first."""
    always = {"campaign", "run", "repetition", "peak_force_n", "contact_time_s"}
    return [
        name for name in names if name in always or len({str(row.get(name)) for row in rows}) > 1
    ]


def _sorted_address(address: Mapping[str, Any], sort: str, column: str) -> str:
    """The list in order of a column, the largest first; the other way round where it is sorted
    so."""
    return (
        query({**address, "sort": column if sort == f"-{column}" else f"-{column}"}) or "/impacts"
    )


def _menus(levels: Mapping[str, Sequence[float | str]], where: Sequence[str]) -> list[Menu]:
    """A menu for the quality and one for each factor with levels to choose from."""
    choices = {QUALITY: [(f"{QUALITY}={name}", name) for name in QUALITIES]}
    for key, values in levels.items():
        choices[key] = [(f"{key}={value}", cell(key, value)) for value in values]
    return [
        Menu(
            heading(key),
            tuple(options),
            next((text for text, _ in options if text in where), ""),
            key,
        )
        for key, options in choices.items()
    ]


def _typed_conditions(
    levels: Mapping[str, Sequence[float | str]], sent: Mapping[str, str]
) -> list[str]:
    """Conditions of values that were typed into the field of a factor: one of its levels as a page
    shows it, or another value in the unit of the page."""
    conditions = []
    for key, values in levels.items():
        text = sent.get(f"{TYPED}{key}", "").strip()
        if text:
            level = next((value for value in values if cell(key, value) == text), None)
            conditions.append(f"{key}={_in_si(key, text) if level is None else level}")
    return conditions


def _in_si(key: str, text: str) -> float | str:
    """A number in the unit of the page as one in SI; a word as it is."""
    try:
        return float(f"{parse_number(text) / display_of(key).scale:.12g}")
    except ValueError:  # a level that is a word
        return text


def thumbnail_points(forces_n: Sequence[float]) -> str:
    """The points of an SVG polyline of a pulse (n,), as high as its peak; empty for a pulse without
    force."""
    peak = max(forces_n, default=0.0)
    if peak <= 0:
        return ""
    step = _WIDTH / max(1, len(forces_n) - 1)
    heights = (min(_HEIGHT, max(1.0, 1 + (_HEIGHT - 2) * (1 - force / peak))) for force in forces_n)
    return " ".join(f"{i * step:.1f},{height:.1f}" for i, height in enumerate(heights))


@router.get("/shots", dependencies=[Depends(THE_STORE)])
def shots(
    request: Request,
    store: OpenStore,
    where: Where = [],  # noqa: B006
    campaign: str = "",
    after: After = None,
) -> Response:
    where = [condition for condition in where if condition.strip()]
    error, status, following = "", 200, None
    rows: list[dict[str, Any]] = []
    total = rows_before = 0
    with store.reading() as session:
        campaigns = list_campaign_names(session)
        try:
            conditions = parse_where(tuple(where))
            shot_rows, following = list_shots_page(
                session, campaign or None, conditions, after, PAGE
            )
            total = count_shots(session, campaign or None, conditions, COUNTED)
            if after is not None:
                rows_before = count_shots(session, campaign or None, conditions, COUNTED, after)
            impact_by_shot = impacts_of_shots(session, [row["id"] for row in shot_rows])
            rows = [
                _shot_row(row, impact_by_shot.get(row["id"]))
                for row in with_predictions(session, shot_rows)
            ]
        except (ValueError, LookupError) as why:
            error, status = str(why), status_of_fault(why)
    address = {"campaign": campaign, "where": where}
    return page(
        request,
        "shots.html",
        status=status,
        rows=rows,
        campaigns=campaigns,
        campaign=campaign,
        where=where,
        error=error,
        position=_position(rows_before, len(rows), total, "shot"),
        following=query({**address, "after": following}) if following else "",
        beginning=(query(address) or "/shots") if after else "",
    )


def _shot_row(shot: Mapping[str, Any], impact: int | None) -> dict[str, Any]:
    """A shot as a line of the table: its own number, then that of its impact, which may be none."""
    rest = {name: value for name, value in shot.items() if name != "id"}
    return {"shot": shot["id"], "impact": impact, **velocity_with_uncertainty(rest)}


Ticked = Annotated[list[int], Form(max_length=PAGE)]


@router.post("/impacts/compare", dependencies=[Depends(_READS)])
def compareticked(impact: Ticked = []) -> Response:  # noqa: B006
    """On to the spectra and pulses of the impacts that are ticked."""
    return RedirectResponse(f"/compare/spectra?impacts={','.join(map(str, ticked(impact)))}", 303)


@router.post("/impacts/dataset", dependencies=[Depends(role_of(DATASET_BUILD))])
def freezeticked(
    store: OpenStore,
    impact: Ticked = [],  # noqa: B006
    dataset: Annotated[Text, Form(max_length=200)] = "",
) -> Response:
    """Freeze the pulses of the impacts that are ticked as a dataset, which models can be trained
    on."""
    keys = ticked(impact)
    if not dataset.strip():
        raise FieldError(
            "dataset",
            "Name the new dataset. Pulses are not added to one that exists: it is frozen.",
        )
    with store.reading() as session:
        campaigns = session.scalars(
            select(Campaign.name).where(Campaign.id.in_(_campaigns(keys)))
        ).all()
    try:
        built = build_snapshot(store, dataset.strip(), campaigns, impacts=keys)
    except (ValueError, LookupError) as error:
        raise FieldError("dataset", str(error)) from error
    return RedirectResponse(f"/datasets/{part(built.snapshot.name)}", 303)


def _campaigns(impacts: Sequence[int]) -> Select[int]:
    return select(Impact.campaign_id).where(Impact.id.in_(impacts)).distinct()


def ticked(impacts: Sequence[int]) -> list[int]:
    """The impacts that a form ticks. Raises `FieldError` where it ticks none."""
    if not impacts:
        raise FieldError(
            "", "No impact is ticked. Tick one or more in the first column of the table."
        )
    return list(impacts)
