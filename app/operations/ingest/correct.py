"""Add or correct facts of a stored campaign, with a reason; the earlier values are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any
from urllib.parse import quote

from pydantic import Field

from ..faults import FieldError
from ..fields import Presentation, pairs, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Result, ResultTable
from .removed import DryRunnable, Reason
from .request import NamedCampaign


def _typed(_: str, fact: str, value: Any) -> str:
    text = str(value).strip()
    if not text:
        raise ValueError(
            f"facts: {fact} has no value; expected NAME=VALUE, such as tip_radius_mm=30"
        )
    return text


class FactsCorrection(DryRunnable, NamedCampaign):
    """Facts of a stored campaign that are added or corrected."""

    facts: pairs(_typed, str) = request_field(  # type: ignore[valid-type]
        min_length=1,
        help="State a fact with its value, by the key of campaign.toml or the column of runs.csv: "
        "`bench.plate.thickness_m=12mm`, `tip_radius_mm=30`. The option can be repeated.",
        presentation=Presentation(metavar="NAME=VALUE", option="set"),
    )
    run: tuple[Annotated[int, Field(ge=0, le=2**31 - 1)], ...] = request_field(
        (),
        max_length=1000,
        help="Correct this run alone. The option can be repeated. [default: all runs]",
        presentation=Presentation(metavar="N"),
    )
    only_missing: bool = request_field(
        False, help="Leave the runs alone that state the fact already."
    )
    reason: Reason = request_field(
        help="Say why. The store keeps the reason.", presentation=Presentation(metavar="TEXT")
    )


@dataclass(frozen=True)
class FactsCorrected(Result):
    """What was corrected, a row for each fact; `stands_on` says what was made with the earlier
    values, and keeps them."""

    campaign: str
    rows: list[dict[str, Any]]
    stands_on: list[str]
    dry_run: bool = False

    def notes(self) -> Sequence[str]:
        """What was corrected, and what rests on the earlier values."""
        if not self.rows:
            return (f"{self.campaign}: states this already; nothing was changed",)
        start = "dry run, nothing is changed; would correct" if self.dry_run else "corrected"
        return (
            *(
                f"{self.campaign}: {start} {row['fact']} from {row['earlier']} to {row['value']}"
                + (f" in {row['hits']} impacts or shots" if row["hits"] else "")
                for row in self.rows
            ),
            "  stored pulses, figures and findings are not made anew",
            *(f"  rests on the earlier value: {line}" for line in self.stands_on),
        )

    def tables(self) -> Sequence[ResultTable]:
        """The facts."""
        return (ResultTable("", self.rows, "nothing was changed"),)

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"campaign": self.campaign, "corrected": self.rows, "stands_on": self.stands_on}

    def address(self) -> str:
        """The page of the campaign, where it lists its corrections."""
        return f"/campaigns/{quote(self.campaign, safe='')}#corrections"

    def summary(self) -> str:
        """The facts, in a few words."""
        return f"{self.campaign}: {', '.join(row['fact'] for row in self.rows) or 'nothing'}"


def _correct(request: FactsCorrection, laboratory: Laboratory, _: Progress) -> FactsCorrected:
    from ....ingest.storing.corrections import correct_facts

    store, facts = laboratory.store, dict(request.facts)
    changes = store.write(
        lambda session: correct_facts(
            store,
            session,
            request.campaign,
            facts,
            request.reason,
            request.run,
            only_missing=request.only_missing,
        )
    )
    rows = [
        {
            "fact": change.fact,
            "earlier": _earlier(change.earlier),
            "value": change.value,
            "hits": sum(len(hits) for _, hits in change.earlier),
        }
        for change in changes
    ]
    stands_on = _standing(laboratory, request.campaign) if changes else []
    return FactsCorrected(request.campaign, rows, stands_on, request.dry_run)


def _earlier(values: Sequence[tuple[str | None, Sequence[Any]]]) -> str:
    words = [
        ("not stated" if value is None else value) + (f" ({len(hits)})" if hits else "")
        for value, hits in values
    ]
    return ", ".join(words)


def _standing(laboratory: Laboratory, campaign: str) -> list[str]:
    from .removal import standing_on
    from .removed import standing_lines

    stood: Mapping[str, Any] = standing_on(laboratory.store, laboratory.db, campaign)
    return standing_lines(stood)


def _is_stored(request: FactsCorrection, laboratory: Laboratory) -> None:
    """Raises `LookupError` for a campaign that there is not, `FieldError` for a run."""
    from ....schema.conditions import get_campaign_id

    with laboratory.store.reading() as session:
        get_campaign_id(session, request.campaign)
    if request.run and not request.facts:
        raise FieldError("facts", "State at least one fact.")


CAMPAIGN_CORRECT: Operation[FactsCorrection, FactsCorrected] = Operation(
    name="campaign-correct",
    request=FactsCorrection,
    run=_correct,
    check=_is_stored,
    help="""Add facts to a stored CAMPAIGN, or correct them, with a reason.

A fact is one of the campaign and its bench, such as the thickness of the plate or the mass of the
hammer, or a factor of its runs, such as the radius of the tip. The store keeps the earlier value,
the reason, the time and the person. Datasets keep the facts that they were built with, and say that
these were corrected since then; so do the models and diagnoses that rest on them. Pulses and
figures are not made anew. A folder that states the earlier value is refused afterwards.""",
    example="pyroshock campaigns correct rehearsal --set bench.plate.thickness_m=12mm "
    '--reason "measured with a calliper" --dry-run\n'
    "pyroshock campaigns correct rehearsal --set tip_radius_mm=45 --run 3 "
    '--reason "the label of the tip was wrong"',
    command=("campaigns", "correct"),
    route=("POST", "/campaigns/{campaign}/facts"),
    absent={
        "form": "The page /campaigns/NAME/facts has a control for each fact of a campaign.",
        "python": "A correction needs a person who gives the reason; the command asks for it.",
    },
)
