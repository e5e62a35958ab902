"""Facts of a stored campaign: what is stated and what is missing, and the form that adds or
corrects them with a reason."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...ingest.errors import IngestError
from ...schema.corrected_facts import list_corrections
from ..doors.form_route import SentTexts
from ..operations.faults import Fault, FieldError, RequestError, read
from ..operations.ingest.campaign_overview import missing_facts_of
from ..operations.ingest.correct import CAMPAIGN_CORRECT, FactsCorrection
from ..operations.ingest.correctable import facts_of_campaign, facts_of_runs, runs_of_text
from ..web.dependencies import InLaboratory, Name, OpenStore
from ..web.page_sources import THE_STORE
from ..web.rendering import page
from ..web.role_needs import role_of

router = APIRouter()
#: What a control of the form is called before the name of its fact.
_CONTROL = "fact:"


@router.get("/campaigns/{name}/facts", dependencies=[Depends(THE_STORE)])
def show(request: Request, name: Name, store: OpenStore) -> Response:
    """The facts of a campaign, and the form for them."""
    with store.reading() as session:
        return page(
            request,
            "facts.html",
            campaign=name,
            of_campaign=facts_of_campaign(session, name),
            of_runs=facts_of_runs(session, name),
            missing=missing_facts_of(session, name),
            corrections=list_corrections(session, [name]),
        )


@router.post("/campaigns/{name}/facts", dependencies=[Depends(role_of(CAMPAIGN_CORRECT))])
def correct(name: Name, laboratory: InLaboratory, texts: SentTexts) -> Response:
    """Write what was changed in the form, with its reason."""
    with laboratory.store.reading() as session:
        stated = {fact.name: fact.stated for fact in facts_of_campaign(session, name)}
    sent = {
        control.removeprefix(_CONTROL): own[0].strip()
        for control, own in texts.items()
        if control.startswith(_CONTROL) and own
    }
    facts = {fact: text for fact, text in sent.items() if text and text != stated.get(fact, "")}
    emptied = [fact for fact, text in sent.items() if not text and stated.get(fact)]
    if emptied:
        raise FieldError(
            f"{_CONTROL}{emptied[0]}",
            "A stated fact cannot be removed; give the right value, or leave it as it is.",
        )
    if not facts:
        raise FieldError(
            "reason", "Nothing was changed. Give at least one fact a value, then say why."
        )
    if not _text(texts, "reason"):
        raise FieldError("reason", "Say why; the store keeps the reason beside the earlier value.")
    try:
        runs = runs_of_text(_text(texts, "runs"))
    except ValueError as error:
        raise FieldError("runs", str(error)) from error
    values: dict[str, Any] = {
        "campaign": name,
        "facts": facts,
        "run": runs,
        "only_missing": bool(_text(texts, "only_missing")),
        "reason": _text(texts, "reason"),
    }
    request = read(FactsCorrection, values, "network")
    try:
        answer = CAMPAIGN_CORRECT.answer(request, laboratory, lambda _done, _total, _what: None)
    except IngestError as error:
        raise RequestError([_fault(fault, facts) for fault in error.faults]) from error
    except LookupError as error:
        if "run" in str(error):
            raise FieldError("runs", str(error)) from error
        raise
    return RedirectResponse(answer.address(), 303)


def _text(texts: SentTexts, name: str) -> str:
    return next(iter(texts.get(name, ())), "").strip()


def _fault(fault: str, facts: dict[str, str]) -> Fault:
    """A fault of the ingest beside the control of the fact that it names."""
    words = fault.removeprefix("campaign.toml: ")
    named = [fact for fact in facts if words.startswith(fact)]
    control = f"{_CONTROL}{named[0]}" if named else ""
    return Fault(control, words.removeprefix(named[0]).strip() if named else words)
