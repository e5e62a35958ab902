"""A campaign deleted from the store, with a tombstone that tells what stood on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.provenance import CAMPAIGN, Tombstone
from ...schema.removal.part import Part, campaign_part
from ...schema.removal.removing import adopted_on, remove
from ...schema.session import Store
from ..twins.adopted_effects import Adopted, adopted_for
from .standing import models_of, without


class DeletionRefusedError(ValueError):
    """Something else would change with the deletion; the message names it and what to do first."""


def delete_campaign(store: Store, url: str, campaign: str, reason: str) -> dict[str, Any]:
    """Delete a campaign with its recordings, hits, diagnoses and adopted effects; its tombstone, as `told` gives it.

    `url` is the store's address, beside which the models lie. Raises `LookupError` for an unknown campaign, and
    `DeletionRefusedError` where predictions of other campaigns would change.
    """
    words = checked_reason(reason)
    with store.reading() as session:
        part = campaign_part(session, campaign)
    models = models_of(store, url, part)
    return store.write(lambda session: told(taken_out(session, campaign_part(session, campaign), words, models)))


def told(stone: Tombstone) -> dict[str, Any]:
    """A tombstone as plain data; reports of diagnoses and digests of pulses stay in the store."""
    stood_on = {
        **stone.stood_on,
        "datasets": [without(dataset, "members") for dataset in stone.stood_on["datasets"]],
        "diagnoses": [without(diagnosis, "report") for diagnosis in stone.stood_on["diagnoses"]],
    }
    return {
        "id": stone.id,
        "kind": stone.kind,
        "campaign": stone.campaign,
        "recording": stone.recording,
        "content_hash": stone.content_hash,
        "deleted_at": stone.deleted_at.isoformat(timespec="seconds"),
        "reason": stone.reason,
        "counts": stone.counts,
        "stood_on": stood_on,
        "file_sha256": stone.file_sha256,
        "replaced_by": stone.replaced_by,
        "archive_path": stone.archive_path,
        "archive_sha256": stone.archive_sha256,
        "restored_at": None if stone.restored_at is None else stone.restored_at.isoformat(timespec="seconds"),
    }


def list_tombstones(session: Session, campaign: str | None = None) -> list[dict[str, Any]]:
    """What was deleted, the oldest first; of one campaign, or of all."""
    query = select(Tombstone).order_by(Tombstone.id)
    return [told(row) for row in session.scalars(query if campaign is None else query.filter_by(campaign=campaign))]


def checked_reason(reason: str) -> str:
    """The reason on one line. Raises `ValueError` for an empty one."""
    words = " ".join(reason.split())
    if not words:
        raise ValueError('the reason is empty; say why it is deleted: --reason "wrong sensor, repeated as spring-2"')
    return words


def taken_out(
    session: Session,
    part: Part,
    reason: str,
    models: Sequence[dict[str, Any]],
    archive: tuple[str, str] | None = None,
) -> Tombstone:
    """A campaign deleted in a transaction of the caller's. Raises `DeletionRefusedError` as `delete_campaign`."""
    speaks = part.kind == CAMPAIGN and bool(adopted_on(session, part))
    before = adopted_elsewhere(session, part) if speaks else {}
    stone = remove(session, part, reason, models, archive)
    after = adopted_elsewhere(session, part) if speaks else {}
    for other, effects in before.items():
        if effects != after[other]:
            _refuse(part.campaign, other, effects)
    return stone


def adopted_elsewhere(session: Session, part: Part) -> dict[str, list[Adopted]]:
    """What predictions of each campaign but the part's take up, by the campaign's name."""
    session.expire_all()
    names = session.scalars(select(Campaign.name).where(Campaign.name != part.campaign).order_by(Campaign.name)).all()
    return {name: adopted_for(session, name) for name in names}


def _refuse(campaign: str, other: str, effects: Sequence[Adopted]) -> None:
    own = next((effect for effect in effects if effect.campaign == campaign), None)
    what = "" if own is None else f" (version {own.version}: {', '.join(effect.id for effect in own.effects)})"
    raise DeletionRefusedError(
        f"what was adopted from campaign {campaign!r}{what} decides predictions of campaign {other!r}, which has the "
        f"same bench; adopt from a campaign that stays first: pyroshock diagnose {other} --adopt EFFECT (or none)"
    )
