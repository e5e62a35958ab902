"""Impacts with their figures, and shots of the gun: listed by campaign and conditions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any

from ..fields import Key, Presentation, Texts, request_field, row_limit
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....schema.conditions import Condition

#: Rows that a request over the network has, unless it says how many, and at most.
_USUAL_ROWS, _MOST_ROWS = 100, 2000


class Selection(Request):
    """The impacts or shots of a campaign that meet conditions."""

    campaign: str | None = request_field(
        None,
        max_length=1000,
        help="Take the impacts of this campaign only.",
        presentation=Presentation(metavar="NAME", completion="campaign_names"),
    )
    where: Texts = request_field(
        (),
        max_length=40,
        help="Select by FIELD=VALUE, also with != < <= > >=, such as "
        '"tip_material=steel". Several conditions must all hold.',
        presentation=Presentation(metavar="CONDITION"),
    )

    def conditions(self) -> tuple[Condition, ...]:
        """The conditions in SI. Raises `ConditionError` for one that cannot be read."""
        from ...common.filters import parse_where

        return parse_where(self.where)


class SelectedRows(Selection):
    """Impacts or shots in the order of their numbers, or a page of them."""

    after: Key | None = request_field(
        None, help="Begin behind the row with this `id`, the last one of the page before."
    )
    limit: row_limit(_USUAL_ROWS, _MOST_ROWS) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help="List at most this number of rows. [default: all; over the network, 100 of at most "
        "2000]",
    )

    def taken(self, rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
        """As many of these rows as are asked for."""
        return list(islice(rows, self.limit))

    def page(self) -> int:
        """Rows that are read of the store at once."""
        return min(self.limit or _MOST_ROWS, _MOST_ROWS)


@dataclass(frozen=True)
class ImpactRows(Rows):
    """Impacts; a table has no figures of accelerations where no impact has any."""

    @cached_property
    def _hidden(self) -> Sequence[str]:
        from ....schema.conditions import CHANNEL_COLUMNS

        measured = any(row[name] is not None for row in self.rows for name in CHANNEL_COLUMNS)
        return () if measured else tuple(CHANNEL_COLUMNS)

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """An impact as a line of a table."""
        return {name: value for name, value in row.items() if name not in self._hidden}


def _impacts(request: SelectedRows, laboratory: Laboratory, _: Progress) -> ImpactRows:
    from ....schema.listings import iter_impacts

    with laboratory.store.reading() as session:
        conditions = request.conditions()
        rows = request.taken(
            iter_impacts(session, request.campaign, conditions, request.page(), request.after)
        )
        return ImpactRows(rows, "" if rows else _no_match(session, conditions))


def _no_match(session: Session, conditions: Iterable[Condition]) -> str:
    """That nothing matches, with the levels that the store has of each factor that was asked
    for."""
    from ....schema.listings import list_levels
    from ...common.quantities import cell, heading

    levels = list_levels(session, fewest=1)
    fields = dict.fromkeys(condition.field for condition in conditions if condition.field in levels)
    level_words = [
        f"{heading(field)} {', '.join(cell(field, level) for level in levels[field])}"
        for field in fields
    ]
    return "; the store has ".join(["no impacts match", *level_words])


def _shots(request: SelectedRows, laboratory: Laboratory, _: Progress) -> Rows:
    from ....schema.listings import iter_shots
    from ...common.nominal_velocity import with_predictions

    with laboratory.store.reading() as session:
        shots = iter_shots(
            session, request.campaign, request.conditions(), request.page(), request.after
        )
        return Rows(request.taken(with_predictions(session, shots)), "no shots match")


_SHOWN = {"form": "It changes nothing; a page of its own shows the list."}

IMPACT_LIST: Operation[SelectedRows, ImpactRows] = Operation(
    name="impact-list",
    request=SelectedRows,
    run=_impacts,
    help="""List impacts with their factors and figures.

The figures are those of the pulse in use, and those of the acceleration channel with the largest
peak. Files and JSON have SI units.""",
    example="""pyroshock impacts --campaign rehearsal --where tip_material=steel \\
    --where "peak_force_n>1000"
pyroshock impacts --sort -peak_force_n --columns id,tip_material,peak_force_n --csv""",
    command=("impacts", "list"),
    route=("GET", "/impacts"),
    listing=True,
    absent=_SHOWN,
)
SHOT_LIST: Operation[SelectedRows, Rows] = Operation(
    name="shot-list",
    request=SelectedRows,
    run=_shots,
    help="""List the shots of the gun with tank pressure (gauge), bullet mass, measured velocity and
the velocity of the nominal model. Files and JSON have SI units.""",
    example="pyroshock shots --campaign first-shots",
    command=("shots",),
    route=("GET", "/shots"),
    listing=True,
    absent=_SHOWN,
)
