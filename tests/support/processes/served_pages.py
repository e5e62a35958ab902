"""The pages of the web application by name, each filled by the store of
`tests/app/web/conftest.py`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from urllib.request import HTTPCookieProcessor, Request, build_opener

import pytest
from pyroshock.app.demo.demo import HIT
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from sqlalchemy import select

from support.processes.browsers import Lab, until
from support.processes.web_client import token_in

#: Name -> address; `{hit}` and `{first}` are impacts of the store.
PAGES = {
    "campaigns": "/campaigns",
    "campaigns-empty": "/campaigns?name=nothing-of-that-name",
    "campaign-planned": "/campaigns/rehearsal",
    "campaign-shots": "/campaigns/first-shots",
    "impacts": "/impacts",
    "shots": "/shots",
    "impact": "/impacts/{hit}",
    "impact-preview": "/impacts/{hit}?preview=true&threshold=0.05",
    "compare": "/compare?campaign=rehearsal",
    "spectra": "/compare/spectra?impacts={first}&sides=true",
    "explore": "/explore?colour=tip_material&select_x=0:1&select_y=0:1e6",
    "explore-control": "/explore?kind=control&y=peak_force_n",
    "models": "/models",
    "models-compare": "/models/compare?version=linear@1&version=hann@1",
    "model": "/models/linear/1",
    "models-train": "/models/train",
    "datasets": "/datasets",
    "dataset": "/datasets/guns",
    "dataset-delete": "/datasets/guns/delete",
    "model-delete": "/models/linear/1/delete",
    "twin": "/twin",
    "tune": "/tune?text=frequency_hz%2Clevel_g%0A100%2C30%0A1000%2C300",
    "validations": "/validations",
    "twin-model": "/twin?contact=linear@1&tank_pressure_pa=100000",
    "plans": "/plans",
    "plan": "/plans/rehearsal",
    "plan-new": "/plans/new",
    "sheet": "/plans/rehearsal/sheet",
    "sheet-print": "/plans/rehearsal/sheet.html",
    "diagnoses": "/diagnoses",
    "diagnosis": "/diagnoses/2",
    "diagnosis-of-earlier-version": "/diagnoses/1",
    "home": "/",
    "ingest": "/ingest",
    "extract": "/campaigns/rehearsal/extract?preview=1&threshold=0.02",
    "export": "/campaigns/rehearsal/export",
    "archive": "/campaigns/rehearsal/archive",
    "deleted": "/deleted",
    "jobs": "/jobs",
    "api": "/api",
    "api-read": "/operations/get-api-impacts",
    "api-plan": "/operations/post-api-plans",
    "facts": "/campaigns/rehearsal/facts",
    "discard": "/impacts/{first}/discard",
    "tuned": "/tune/{tuned}",
    "validation": "/validations/{validated}",
    "job": "/jobs/{validated}",
    "check": "/ingest/checks/{checked}",
    "campaign-form": "/ingest/forms/{described}",
    "notes": "/notes",
    "attachments": "/attachments",
    "search": "/search?words=rehearsal",
    "account": "/account",
    "users": "/users",
    "audit": "/audit",
    "not-there": "/campaigns/none-of-that-name",
    "report-campaign": "/reports/campaign/rehearsal.html",
    "report-diagnosis": "/reports/diagnosis/1.html",
    "report-model": "/reports/model/linear/1.html",
}

#: Key of an address -> the form whose job makes its page.
JOBS: dict[str, tuple[str, dict[str, str]]] = {
    "tuned": (
        "/tune",
        {"target": "frequency_hz,level_g\n100,30\n1000,300", "campaign": "first-shots"},
    ),
    "validated": ("/validations", {"campaign": "rehearsal", "folds": "2", "draws": "20"}),
    "checked": ("/ingest/path", {"path": "bare-shots", "dry_run": "1"}),
    "described": ("/ingest/describe", {"path": "bare-recordings"}),
}
_EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture(scope="module")
def address(lab: Lab) -> Callable[[str], str]:
    """Addresses with the impacts of this store in them."""

    def first(session: Any, campaign: str) -> int:
        query = (
            select(Impact.id)
            .join(Campaign, Impact.campaign_id == Campaign.id)
            .where(Campaign.name == campaign)
        )
        return session.scalars(query.order_by(Impact.id)).first()

    with lab.reading() as session:
        impacts = {"hit": first(session, HIT), "first": first(session, "rehearsal")}
    keys = _Keys(lab, impacts)
    return lambda name: PAGES[name].format_map(keys)


class _Keys(dict[str, Any]):
    """What stands in addresses; a job is done when the first page of it is asked for."""

    def __init__(self, lab: Lab, impacts: dict[str, int]) -> None:
        super().__init__(impacts)
        self._lab = lab

    def __missing__(self, key: str) -> str:
        form, fields = JOBS[key]
        if key == "checked":
            shutil.copytree(_EXAMPLES / "first-shots", self._lab.folder / fields["path"])
        if key == "described":
            recordings = self._lab.folder / fields["path"] / "recordings"
            recordings.mkdir(parents=True)
            shutil.copy(_EXAMPLES / "rehearsal" / "recordings" / "0001-01.h5", recordings)
        opener = build_opener(HTTPCookieProcessor())  # the token of a form belongs to a cookie

        def text_of(address: str, sent: dict[str, str] | None = None) -> tuple[str, str]:
            request = Request(self._lab.origin + address)
            request.data = None if sent is None else urlencode(sent).encode()
            with opener.open(request, timeout=60) as answer:
                return answer.geturl(), answer.read().decode()

        location, _ = text_of(form, {"csrf": token_in(text_of("/tune")[1]), **fields})
        job = location.rsplit("/", 1)[1]

        def state() -> str:
            return str(json.loads(text_of(f"/api/jobs/{job}")[1])["state"])

        until(lambda: state() not in ("waiting", "running"), 300)
        assert state() == "done", text_of(f"/api/jobs/{job}")[1]
        self[key] = job
        return job
