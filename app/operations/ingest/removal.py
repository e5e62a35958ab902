"""A campaign deleted from the store, or one recording discarded or replaced by what its folder
holds now: with a tombstone that tells what stood on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....ingest.storing.plan_link import PlanLinks, link_within
from ....ingest.storing.replacement import Replacement
from ....schema.campaigns import Campaign, Plan, PlannedRun
from ....schema.provenance import CAMPAIGN, Tombstone
from ....schema.removal.part import Part, campaign_part, recording_part
from ....schema.removal.removing import adopted_on, datasets_on, diagnoses_on, remove, row_counts
from ....schema.run_states import run_status
from ....schema.session import Store
from ...common.model_registry import models_extra, registry_of
from ...twins.adopted_effects import AdoptedEffects, adopted_for


def standing_on(
    store: Store, url: str, campaign: str, recording: str | None = None
) -> dict[str, Any]:
    """Rows that would go ("counts") and what stands on them ("stood_on"), as a tombstone has it;
    nothing is written.

    `url` is the store's address, beside which the models lie. Raises `LookupError` for what is not
    in the store.
    """
    with store.reading() as session:
        part = (
            campaign_part(session, campaign)
            if recording is None
            else recording_part(session, campaign, recording)
        )
        datasets = datasets_on(session, part)
        dependents: dict[str, Any] = {
            "campaign": campaign,
            "recording": recording,
            "counts": row_counts(session, part),
            "stood_on": {
                **_short(datasets, diagnoses_on(session, part)),
                "adopted": adopted_on(session, part),
                "reopened": [],
            },
        }
    dependents["stood_on"]["models"] = models_on(url, datasets)
    return dependents


def models_of(store: Store, url: str, part: Part) -> list[dict[str, Any]]:
    """Registered models that were trained on a dataset with pulses of the part: label, dataset,
    hash."""
    with store.reading() as session:
        datasets = datasets_on(session, part)
    return models_on(url, datasets)


def models_on(url: str, datasets: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Registered models that were trained on one of these datasets."""
    if not datasets:
        return []
    hashes = {dataset["hash"] for dataset in datasets}
    with models_extra():
        versions = registry_of(url).versions()
    return [
        {"model": version.label, "dataset": version.dataset.name, "hash": version.dataset.hash}
        for version in reversed(versions)
        if version.dataset.hash in hashes and version.is_served
    ]


def _short(
    datasets: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """Datasets without the digests of their pulses, diagnoses without their reports."""
    return {
        "datasets": [
            {key: value for key, value in entry.items() if key != "members"} for entry in datasets
        ],
        "diagnoses": [
            {key: value for key, value in entry.items() if key != "report"} for entry in diagnoses
        ],
    }


class DeletionRefusedError(ValueError):
    """Something else would change with the deletion; the message names it and what to do first."""


def delete_campaign(store: Store, url: str, campaign: str, reason: str) -> dict[str, Any]:
    """Delete a campaign with its recordings, hits, diagnoses and adopted effects; its tombstone
    (`deletion_lines`).

    `url` is the store's address, beside which the models lie. Raises `LookupError` for an unknown
    campaign, and `DeletionRefusedError` where predictions of other campaigns would change.
    """
    words = checked_reason(reason)
    with store.reading() as session:
        part = campaign_part(session, campaign)
    models = models_of(store, url, part)
    return store.write(
        lambda session: deletion_lines(
            removal_lines(session, campaign_part(session, campaign), words, models)
        )
    )


def deletion_lines(stone: Tombstone) -> dict[str, Any]:
    """A tombstone as plain data; reports of diagnoses and digests of pulses stay in the store."""
    stood_on = stone.stood_on
    return {
        "id": stone.id,
        "kind": stone.kind,
        "campaign": stone.campaign,
        "recording": stone.recording,
        "content_hash": stone.content_hash,
        "deleted_at": stone.deleted_at.isoformat(timespec="seconds"),
        "reason": stone.reason,
        "counts": stone.counts,
        "stood_on": {**stood_on, **_short(stood_on["datasets"], stood_on["diagnoses"])},
        "file_sha256": stone.file_sha256,
        "replaced_by": stone.replaced_by,
        "archive_path": stone.archive_path,
        "archive_sha256": stone.archive_sha256,
        "restored_at": None
        if stone.restored_at is None
        else stone.restored_at.isoformat(timespec="seconds"),
    }


def list_tombstones(session: Session, campaign: str | None = None) -> list[dict[str, Any]]:
    """What was deleted, the oldest first; of one campaign, or of all."""
    query = select(Tombstone).order_by(Tombstone.id)
    return [
        deletion_lines(row)
        for row in session.scalars(
            query if campaign is None else query.filter_by(campaign=campaign)
        )
    ]


def checked_reason(reason: str) -> str:
    """The reason on one line. Raises `ValueError` for an empty one."""
    words = " ".join(reason.split())
    if not words:
        raise ValueError(
            'the reason is empty; say why it is deleted: --reason "wrong '
            'sensor, repeated as spring-2"'
        )
    return words


def removal_lines(
    session: Session,
    part: Part,
    reason: str,
    models: Sequence[dict[str, Any]],
    archive: tuple[str, str] | None = None,
) -> Tombstone:
    """A campaign deleted in a transaction of the caller's. Raises `DeletionRefusedError` as
    `delete_campaign`."""
    speaks = part.kind == CAMPAIGN and bool(adopted_on(session, part))
    before = adopted_elsewhere(session, part) if speaks else {}
    stone = remove(session, part, reason, models, archive)
    after = adopted_elsewhere(session, part) if speaks else {}
    for other, effects in before.items():
        if effects != after[other]:
            _refuse(part.campaign, other, effects)
    return stone


def adopted_elsewhere(session: Session, part: Part) -> dict[str, list[AdoptedEffects]]:
    """What predictions of each campaign but the part's take up, by the campaign's name."""
    session.expire_all()
    names = session.scalars(
        select(Campaign.name).where(Campaign.name != part.campaign).order_by(Campaign.name)
    ).all()
    return {name: adopted_for(session, name) for name in names}


def _refuse(campaign: str, other: str, effects: Sequence[AdoptedEffects]) -> None:
    own = next((effect for effect in effects if effect.campaign == campaign), None)
    what = (
        ""
        if own is None
        else f" (version {own.version}: {', '.join(effect.id for effect in own.effects)})"
    )
    raise DeletionRefusedError(
        f"what was adopted from campaign {campaign!r}{what} decides predictions of campaign "
        f"{other!r}, which has the same bench; adopt from a campaign that stays first: pyroshock "
        f"diagnose {other} --adopt EFFECT (or none)"
    )


def discard_recording(store: Store, url: str, part: Part, reason: str) -> dict[str, Any]:
    """Take a recording with its hits out of the store; its tombstone, as `deletion_lines` gives it.

    `part` is what `recording_part` or `recording_of_runs` gave; `url` is the store's address,
    beside which the models lie. A file keeps the recording, so that it can be restored. Raises
    `ValueError` for an empty reason, `LookupError` where it went meanwhile, `OSError` where the
    file cannot be written.
    """
    from .discarded import keep_recording

    words, models = checked_reason(reason), models_of(store, url, part)
    path = part.recording or ""
    keep_recording(store, url, part)
    return store.write(
        lambda session: deletion_lines(
            remove(session, recording_part(session, part.campaign, path), words, models)
        )
    )


def replace_recording(
    store: Store, url: str, replacement: Replacement, reason: str, plan: str | None = None
) -> dict[str, Any]:
    """Take the old recording out and store the new one, in one transaction; the tombstone as
    `deletion_lines` gives it.

    Also "returned": pulses that datasets got back, by name, and "links": what `link_campaign` gives
    of `plan`, or of the plan of the campaign's name. Raises `ValueError` for an empty reason,
    `IngestError` for an unknown plan.
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
        return {
            **deletion_lines(stone),
            "returned": returned,
            "links": None if links is None else vars(links),
        }

    return store.write(swap)


def _linked(session: Session, campaign: str, plan: str | None) -> PlanLinks | None:
    if plan is None and session.scalar(select(Plan.id).where(Plan.name == campaign)) is None:
        return None
    return link_within(session, campaign, plan or campaign)


def _forget_done(session: Session, stone: Tombstone) -> None:
    """Runs that the new recording has done again are not to do."""
    session.flush()
    query = select(Plan.name, PlannedRun.run).join(Plan, PlannedRun.plan_id == Plan.id)
    done = {(name, run) for name, run in session.execute(query.where(run_status() == "done"))}
    open_runs = [run for run in stone.stood_on["reopened"] if (run["plan"], run["run"]) not in done]
    stone.stood_on = {**stone.stood_on, "reopened": open_runs}
    session.flush()
