"""The pages of the web application by name, each filled by the store of
`tests/app/web/conftest.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pyroshock.app.demo.demo import HIT
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from sqlalchemy import select

from support.processes.browsers import Lab

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
    "not-there": "/campaigns/none-of-that-name",
    "report-campaign": "/reports/campaign/rehearsal.html",
    "report-diagnosis": "/reports/diagnosis/1.html",
    "report-model": "/reports/model/linear/1.html",
}


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
        keys = {"hit": first(session, HIT), "first": first(session, "rehearsal")}
    return lambda name: PAGES[name].format(**keys)
