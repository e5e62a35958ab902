"""A kept diagnosis as a report: with all that its page draws, or of an older store the numbers alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy.orm import Session

from ...diagnosis.verdict import Verdict
from ...schema.diagnoses import Diagnosis
from ..diagnoses.kept import kept_report, kept_verdict
from ..diagnoses.labels import single_effects
from ..diagnoses.verdict_json import FORMAT, verdict_from_json
from .diagnosis import document_of
from .document import Document


def diagnosis_document(session: Session, diagnosis_id: int) -> Document:
    """The report on a kept diagnosis. Raises `LookupError` for an unknown one."""
    report = kept_report(session, diagnosis_id)
    row = session.get_one(Diagnosis, diagnosis_id)
    verdict = kept_verdict(session, diagnosis_id) if row.details is not None else verdict_of(report)
    return document_of(verdict, f"{diagnosis_id}, of {row.diagnosed_at:%Y-%m-%d %H:%M} UTC", row.diagnosed_at.date())


def verdict_of(report: Mapping[str, Any]) -> Verdict:
    """The verdict of a report alone, without pictures and fits. Raises `ValueError` where a part is missing.

    A report alone does not say which effects are causes: those of the first entry are.
    """
    try:
        causes = [name for cause in report["causes"][:1] for name in single_effects(cause["effects"])]
        details = {
            "format": FORMAT,
            "causes": [{} for _ in report["causes"]],
            "effects": [{"named": effect["effect"] in causes} for effect in report.get("effects", ())],
        }
        return verdict_from_json(report, details)
    except (KeyError, TypeError) as error:
        raise ValueError(f"the kept diagnosis lacks {error}: diagnose again (pyroshock diagnose CAMPAIGN)") from error
