"""Rows of a blind check made by hand."""

from __future__ import annotations

from typing import Any

from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth

LEAK, DRAG, LAYER = "gun.blow_by", "gun.sliding_friction", "contact.layer_compliance"


def label(*effects: str, **other: Any) -> WithheldTruth:
    """A truth of 4 floors and 4 tolerances."""
    given: dict[str, Any] = {"case": "c", "tier": "strong", "kind": "gun", "gap_in_floors": 4.0}
    return WithheldTruth(**{**given, "gap_in_tolerances": 4.0, "effects": effects, **other})


def stranger(**other: Any) -> WithheldTruth:
    return label(family="tank temperature", **other)


def says(truth: WithheldTruth, said: dict[str, float]) -> CaseResult:
    return CaseResult(truth, CaseAnswer.from_probabilities(truth.case, said))


def verdict(*causes: tuple[list[str], float, list[float] | None], **other: Any) -> dict[str, Any]:
    entries = [
        {"effects": e, "probability": p, **({"split": s} if s else {})} for e, p, s in causes
    ]
    return {"causes": entries, "where": {"stage": []}, "shrinkage": [], "seconds": 1.0, **other}
