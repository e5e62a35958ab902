"""A campaign deleted from the store, with a tombstone that tells what stood on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.removal.part import Part, campaign_part
from ...schema.removal.removing import remove
from ...schema.removal.standing import adopted_on, datasets_on
from ...schema.session import Store
from ...schema.tombstones import CAMPAIGN, Tombstone
from ..models.training import models_extra, registry_of
from ..twins.adopting import Adopted, adopted_for


class DeletionRefusedError(ValueError):
    """Something else would change with the deletion; the message names it and what to do first."""


def delete_campaign(store: Store, url: str, campaign: str, reason: str) -> dict[str, Any]:
    """Delete a campaign with its recordings, hits, diagnoses and adopted effects; its tombstone, as `told` gives it.

    `url` is the store's address, beside which the models lie. Raises `LookupError` for an unknown campaign, and
    `DeletionRefusedError` where predictions of other campaigns would change.
    """
    with store.reading() as session:
        models = _models_on(url, datasets_on(session, campaign_part(session, campaign)))
    return store.write(lambda session: _deleted(session, campaign_part(session, campaign), _reason(reason), models))


def told(stone: Tombstone) -> dict[str, Any]:
    """A tombstone as plain data; reports of diagnoses are left out, which only the store keeps."""
    stood_on = {
        **stone.stood_on,
        "diagnoses": [{k: v for k, v in each.items() if k != "report"} for each in stone.stood_on["diagnoses"]],
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
    }


def list_tombstones(session: Session, campaign: str | None = None) -> list[dict[str, Any]]:
    """What was deleted, the oldest first; of one campaign, or of all."""
    query = select(Tombstone).order_by(Tombstone.id)
    return [told(row) for row in session.scalars(query if campaign is None else query.filter_by(campaign=campaign))]


def _reason(reason: str) -> str:
    words = " ".join(reason.split())
    if not words:
        raise ValueError('the reason is empty; say why it is deleted: --reason "wrong sensor, repeated as spring-2"')
    return words


def _models_on(url: str, datasets: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Registered models that were trained on one of these datasets."""
    if not datasets:
        return []
    hashes = {each["hash"] for each in datasets}
    with models_extra():
        versions = registry_of(url).versions()
    return [
        {"model": version.label, "dataset": version.dataset.name, "hash": version.dataset.hash}
        for version in reversed(versions)
        if version.dataset.hash in hashes
    ]


def _deleted(session: Session, part: Part, reason: str, models: Sequence[dict[str, Any]]) -> dict[str, Any]:
    speaks = part.kind == CAMPAIGN and bool(adopted_on(session, part))
    before = _adopted_elsewhere(session, part) if speaks else {}
    stone = remove(session, part, reason, models)
    after = _adopted_elsewhere(session, part) if speaks else {}
    for other, effects in before.items():
        if effects != after[other]:
            _refuse(part.campaign, other, effects)
    return told(stone)


def _adopted_elsewhere(session: Session, part: Part) -> dict[str, list[Adopted]]:
    """What predictions of each other campaign take up."""
    session.expire_all()
    names = session.scalars(select(Campaign.name).where(Campaign.name != part.campaign).order_by(Campaign.name)).all()
    return {name: adopted_for(session, name) for name in names}


def _refuse(campaign: str, other: str, effects: Sequence[Adopted]) -> None:
    own = next((each for each in effects if each.campaign == campaign), None)
    what = "" if own is None else f" (version {own.version}: {', '.join(effect.id for effect in own.effects)})"
    raise DeletionRefusedError(
        f"what was adopted from campaign {campaign!r}{what} decides predictions of campaign {other!r}, which has the "
        f"same bench; adopt from a campaign that stays first: pyroshock diagnose {other} --adopt EFFECT (or none)"
    )
