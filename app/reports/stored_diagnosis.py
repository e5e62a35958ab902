"""A kept diagnosis as a report: with all that its page draws, or of an older store the numbers alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy.orm import Session

from ...diagnosis.verdict import Verdict
from ...diagnosis.verdict_json import FORMAT, verdict_from_json
from ...schema.diagnoses import Diagnosis
from ..diagnoses.kept import kept_report, kept_verdict
from .diagnosis import document_of
from .document import Document

#: Of a report, where null says that there is none; elsewhere it is a number that JSON has not.
_MAY_BE_NONE = ("fraction", "ci90", "credible_set", "unexplained")


def diagnosis_document(session: Session, diagnosis_id: int) -> Document:
    """The report on a kept diagnosis. Raises `LookupError` for an unknown one."""
    report = kept_report(session, diagnosis_id)
    row = session.get_one(Diagnosis, diagnosis_id)
    verdict = kept_verdict(session, diagnosis_id) if row.details is not None else verdict_of(report)
    return document_of(verdict, f"{diagnosis_id}, of {row.diagnosed_at:%Y-%m-%d %H:%M} UTC", row.diagnosed_at.date())


def verdict_of(report: Mapping[str, Any]) -> Verdict:
    """The verdict of a report alone, without pictures and fits. Raises `ValueError` where a part is missing."""
    try:
        causes = [{"split": cause.get("split", []), "fitted": []} for cause in report["causes"]]
        pictures: dict[str, list[Any]] = {"configurations": [], "residuals": [], "curves": []}
        lost = [{"at": at, "value": "nan"} for at in _nulls(report, [])]
        effects = [{"named": effect["effect"] in _named(report)} for effect in report.get("effects", ())]
        details = {
            "format": FORMAT,
            "lost": lost,
            "causes": causes,
            "effects": effects,
            "fits": {},
            "pictures": pictures,
        }
        return verdict_from_json(report, details)
    except (KeyError, TypeError) as error:
        raise ValueError(f"the kept diagnosis lacks {error}: diagnose again (pyroshock diagnose CAMPAIGN)") from error


def _named(report: Mapping[str, Any]) -> set[str]:
    """The effects of the first entry: a report alone does not say what else was named."""
    return set("+".join(report["causes"][0]["effects"]).split("+"))


def _nulls(value: Any, at: Sequence[str | int]) -> Iterator[list[str | int]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            if each is not None or key not in _MAY_BE_NONE or at[:1] == ["path"]:
                yield from _nulls(each, [*at, key])
    elif isinstance(value, list):
        for i, each in enumerate(value):
            yield from _nulls(each, [*at, i])
    elif value is None:
        yield list(at)
