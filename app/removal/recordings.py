"""One recording discarded, or replaced by what its campaign folder holds now, with a tombstone."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...ingest.plan_link import PlanLinks, link_within
from ...ingest.replacing import Replacement
from ...schema.campaigns import Plan, PlannedRun
from ...schema.provenance import Tombstone
from ...schema.removal.part import Part, recording_part
from ...schema.removal.removing import remove
from ...schema.session import Store
from .deleting import checked_reason, told
from .standing import models_of


def discard_recording(store: Store, url: str, part: Part, reason: str) -> dict[str, Any]:
    """Take a recording with its hits out of the store; its tombstone, as `told` gives it.

    `part` is what `recording_part` or `recording_of_runs` gave; `url` is the store's address, beside which the models
    lie. Raises `ValueError` for an empty reason, `LookupError` where it went meanwhile.
    """
    words, models = checked_reason(reason), models_of(store, url, part)
    path = part.recording or ""
    return store.write(
        lambda session: told(remove(session, recording_part(session, part.campaign, path), words, models))
    )


def replace_recording(
    store: Store, url: str, replacement: Replacement, reason: str, plan: str | None = None
) -> dict[str, Any]:
    """Take the old recording out and store the new one, in one transaction; the tombstone as `told` gives it.

    Also "returned": pulses that datasets got back, by name, and "links": what `link_campaign` gives of `plan`, or of
    the plan of the campaign's name. Raises `ValueError` for an empty reason, `IngestError` for an unknown plan.
    """
    words = checked_reason(reason)
    with store.reading() as session:
        part = replacement.part(session)
    models = models_of(store, url, part)

    def swap(session: Session) -> dict[str, Any]:
        stone = remove(session, replacement.part(session), words, models)
        returned = replacement.write(session, stone)
        links = _linked(session, part.campaign, plan)
        _forget_done(session, stone)
        return {**told(stone), "returned": returned, "links": None if links is None else vars(links)}

    return store.write(swap)


def _linked(session: Session, campaign: str, plan: str | None) -> PlanLinks | None:
    if plan is None and session.scalar(select(Plan.id).where(Plan.name == campaign)) is None:
        return None
    return link_within(session, campaign, plan or campaign)


def _forget_done(session: Session, stone: Tombstone) -> None:
    """Runs that the new recording has done again are not to do."""
    session.flush()
    query = select(Plan.name, PlannedRun.run).join(Plan, PlannedRun.plan_id == Plan.id)
    done = {(name, run) for name, run in session.execute(query.where(PlannedRun.status == "done"))}
    open_runs = [run for run in stone.stood_on["reopened"] if (run["plan"], run["run"]) not in done]
    stone.stood_on = {**stone.stood_on, "reopened": open_runs}
    session.flush()
