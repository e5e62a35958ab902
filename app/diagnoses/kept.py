"""Diagnoses that the store keeps: listed page by page, and read back whole."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from ...schema.campaigns import Campaign
from ...schema.diagnoses import Diagnosis, TwinVersion
from ...schema.listings import get_campaign_id

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...diagnosis.verdict import Verdict


def list_diagnoses(
    session: Session, campaign: str | None = None, limit: int | None = 50, after: int | None = None
) -> list[dict[str, Any]]:
    """Diagnoses of a campaign (None: of all), the newest first: at most `limit` of those older than number `after`.

    `complete` says whether `kept_verdict` can read it back, `restricted` whether only some effects were considered
    (`--with`, `--without`). Raises `LookupError` for an unknown campaign.
    """
    complete = Diagnosis.details.is_not(None).label("complete")
    query = select(Diagnosis, Campaign.name, complete).join(Campaign, Diagnosis.campaign_id == Campaign.id)
    if campaign is not None:
        query = query.where(Diagnosis.campaign_id == get_campaign_id(session, campaign))
    if after is not None:
        query = query.where(Diagnosis.id < after)
    rows = session.execute(query.order_by(Diagnosis.id.desc()).limit(limit)).all()
    adopted = _adopted(session, [row.id for row, _, _ in rows])
    return [
        {**_first_answer(row), "campaign": name, "adopted": adopted.get(row.id), "complete": bool(complete)}
        for row, name, complete in rows
    ]


def _first_answer(row: Diagnosis) -> dict[str, Any]:
    from .restriction import restrictions_among

    first, gap = row.report["causes"][0], row.report["gap"]
    return {
        "id": row.id,
        "diagnosed_at": row.diagnosed_at.isoformat(timespec="seconds"),
        "simulator": row.simulator,
        "first": " or ".join(first["effects"]),
        "probability": first["probability"],
        "gap": gap["before"],
        "noise_floor": gap["noise_floor"],
        "metric": gap["metric"],
        "restricted": bool(restrictions_among(row.report["assumptions"])),
    }


def _adopted(session: Session, keys: Iterable[int]) -> dict[int, str]:
    """What became part of the twin, by diagnosis: "version 3: gun.valve_flow"; the first where there are several."""
    query = select(TwinVersion).where(TwinVersion.diagnosis_id.in_(list(keys))).order_by(TwinVersion.version.desc())
    return {
        row.diagnosis_id: f"version {row.version}: "
        + (" + ".join(effect["id"] for effect in row.configuration["effects"]) or "none")
        for row in session.scalars(query)
        if row.diagnosis_id is not None
    }


def kept_report(session: Session, diagnosis_id: int) -> dict[str, Any]:
    """The report as scripts read it, of any diagnosis. Raises `LookupError` for an unknown one."""
    return _row(session, diagnosis_id).report


def kept_verdict(session: Session, diagnosis_id: int) -> Verdict:
    """A kept diagnosis as it was made, pictures and fits with it.

    Raises `LookupError` for an unknown one, and for one that an older store keeps without what its page draws;
    `ValueError` for one that a newer software has kept.
    """
    from .verdict_json import verdict_from_json

    row = _row(session, diagnosis_id)
    if row.details is None:
        name = row.campaign.name
        raise LookupError(
            f"diagnosis {diagnosis_id} of {name} was kept without what its page draws: diagnose again "
            f"(pyroshock diagnose {name})"
        )
    return verdict_from_json(row.report, row.details)


def kept_options(session: Session, diagnosis_id: int) -> dict[str, Any]:
    """The request of a kept diagnosis, by the names of `DiagnosisRequest`; {} for one that is kept without it.

    An option that another version had is left out. Raises `LookupError` for an unknown diagnosis.
    """
    from .diagnosing import DiagnosisRequest

    options = (_row(session, diagnosis_id).details or {}).get("options", {})
    return {item.name: options[item.name] for item in fields(DiagnosisRequest) if item.name in options}


def _row(session: Session, diagnosis_id: int) -> Diagnosis:
    row = session.get(Diagnosis, diagnosis_id)
    if row is None:
        raise LookupError(f"no diagnosis {diagnosis_id} in the store; pyroshock diagnose CAMPAIGN --list shows them")
    return row
