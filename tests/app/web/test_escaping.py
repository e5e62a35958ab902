"""Names and notes are words: whatever stands in them is shown, and is never HTML, a template or an
address."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.doe.designs.methods import METHODS
from pyroshock.doe.plans import read_plan
from pyroshock.doe.space import shipped_factors
from pyroshock.doe.toml_space import with_ranges
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.campaigns import Campaign, Factor, FactorLevel, Plan
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording
from sqlalchemy import select, update
from support.checks.well_formed import Page
from support.processes.web_client import ended, post, post_json, sqlite, window
from support.records import verdicts
from support.records.campaigns import hammer_campaign, replace_in
from support.stores.web_stores import FACTORS, GUN, PLAN, Lab

#: Filling a store imports much; on a busy machine that is slow.
pytestmark = pytest.mark.timeout(600)
#: What ends a text, an attribute, a script or a template, and what an address must not take apart.
EVIL = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><svg onload=alert(1)>",
    "' onmouseover='alert(1)",
    "</textarea></title><iframe src=javascript:alert(1)>",
    "<b>bold</b> & &lt;i&gt;",
    "{{7*7}} {% raw %} ${7*7}",
    "a/b%2Fc?d=e#f",
    "../..//%2e%2e",
    "Stoß 衝撃 \u202e ☃",
)
STATIC = Path(__file__).resolve().parents[3] / "app" / "web" / "static"
NAME = " ".join(EVIL)
#: As long as a form takes a name.
SHORT = " ".join(EVIL[:4])
#: Elements that our pages are made of no instance of.
_ACTIONS = (
    "/impacts/reject",
    "/impacts/dataset",
)  # the only buttons that send their form elsewhere
_STRANGE = {"iframe", "object", "embed", "base", "img"}


class ShownPage(Page):
    """What a browser would make of a page: its text, its scripts, and what has no place in it."""

    def __init__(self, text: str) -> None:
        self.scripts: list[str] = []
        super().__init__(text)
        self.links = [
            str(given[name])
            for _, given in self.elements
            for name in ("href", "action", "src")
            if name in given
        ]
        self.wrong = [(tag, given) for tag, given in self.elements if not _is_ours(tag, given)]

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["script"]:
            self.words.append(data)
        elif self.elements[-1][1].get("type") == "application/json":
            self.scripts.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.words))


def _is_ours(tag: str, given: dict[str, str | None]) -> bool:
    if tag in _STRANGE or any(name.startswith("on") or name == "srcdoc" for name in given):
        return False
    if given.get("formaction", _ACTIONS[0]) not in _ACTIONS:
        return False
    return (
        tag != "script"
        or str(given.get("src", "")).startswith("/static/")
        or given.get("type") == "application/json"
    )


def checked(client: Any, address: str, status: int = 200) -> ShownPage:
    """A page that is nothing but ours."""
    answer = client.get(address)
    assert answer.status_code == status, (address, answer.text[:2000])
    page = ShownPage(answer.text)
    assert page.wrong == [], address
    assert not [
        each for each in page.links if re.match(r"\s*(javascript|data|vbscript):", each, re.I)
    ], address
    for script in page.scripts:
        json.loads(script)
    return page


def shown(page: ShownPage) -> bool:
    return all(re.sub(r"\s+", " ", each) in page.text for each in EVIL)


@pytest.fixture(scope="module")
def evil(tmp_path_factory: pytest.TempPathFactory, quick_plates: None) -> Iterator[tuple[Any, Any]]:
    """A campaign, its recordings, a plan and a diagnosis whose every word is evil."""
    folder = tmp_path_factory.mktemp("evil")
    with window(sqlite(folder), folders=(folder,)) as (client, store):
        campaign = hammer_campaign(folder / "spring", 2, 2, "spring")
        replace_in(
            campaign / "campaign.toml", 'date = "2026-03-02"', 'date = "2026-03-02"\noperator = "o"'
        )
        ingest_folder(store, campaign, jobs=1)
        ingest_folder(store, hammer_campaign(folder / "damaged", 1, 1, "damaged", seed=2), jobs=1)
        make_plan(
            store, "factorial", NAME, kind="hammer", factors=FACTORS, seed=1, description=NAME
        )
        keep(store, verdicts.verdict(campaign="spring", assumptions=(NAME,), simulator=NAME))
        _spoil(store)
        yield client, store


def _spoil(store: Any) -> None:
    with store.writing() as session:
        spring = session.scalars(select(Campaign.id).where(Campaign.name == "spring")).one()
        session.execute(
            update(Campaign)
            .where(Campaign.id == spring)
            .values(name=NAME, description=NAME, operator=NAME)
        )
        session.execute(update(RecordedChannel).values(name=NAME, position=NAME))
        session.execute(
            update(Recording)
            .where(Recording.campaign_id == spring)
            .values(path=NAME + Recording.path)
        )
        aside = {"status": "set aside", "reason": NAME}
        session.execute(
            update(Recording).where(Recording.campaign_id != spring).values(path=NAME, **aside)
        )
        session.execute(update(Factor).where(Factor.name == "hammer_speed").values(name=NAME))
        session.execute(update(FactorLevel).where(FactorLevel.label == "low").values(label=NAME))
        recording = session.scalars(
            select(Recording.id).where(Recording.campaign_id == spring)
        ).first()
        session.add(
            QualityFinding(
                recording_id=recording,
                impact_id=1,
                check=NAME,
                severity="warning",
                message=NAME,
                evidence={},
            )
        )
        row = session.get_one(Diagnosis, 1)
        row.report = json.loads(json.dumps(row.report).replace('"spring"', json.dumps(NAME)))


CAMPAIGN, PLANNED = f"/campaigns/{quote(NAME, safe='')}", f"/plans/{quote(NAME, safe='')}"


@pytest.mark.parametrize("address", [
    "/campaigns",
    CAMPAIGN,
    "/campaigns/damaged",
    "/impacts",
    "/impacts/1",
    "/compare",
    f"/compare?factor={quote(NAME)}",
    "/plans",
    PLANNED,
    f"{PLANNED}/sheet",
    f"{PLANNED}/sheet.html",
    "/diagnoses",
    "/diagnoses/1",
    f"/reports{CAMPAIGN.replace('campaigns', 'campaign')}.html",
    "/reports/diagnosis/1.html",
])  # fmt: skip
def test_evil_words_are_shown_and_are_no_html(evil: tuple[Any, Any], address: str) -> None:
    page = checked(evil[0], address)
    assert shown(page), page.text


@pytest.mark.parametrize("address", [
    f"/impacts?campaign={quote(NAME)}",
    f"/impacts?where={quote('tip_material=' + EVIL[0])}",
    f"/shots?campaign={quote(NAME)}",
    f"/compare?campaign={quote(NAME)}",
    f"/compare?where={quote('tip_material=' + EVIL[1])}",
    f"/campaigns?name={quote(EVIL[1])}",
    f"/compare/spectra?impacts=1&channel={quote(EVIL[1])}",
    f"/compare/spectra?impacts={quote(EVIL[5])}&specification={quote(EVIL[4])}"
    f"&tolerance={quote(EVIL[1])}",
    f"/diagnoses?campaign={quote(NAME)}",
    f"/models?dataset={quote(EVIL[1])}",
    f"/models/compare?version={quote(EVIL[1])}",
    f"/models/train?dataset={quote(EVIL[1])}",
    f"/twin?tip_material={quote(EVIL[1])}",
    f"/tune?text={quote(EVIL[0])}&contact={quote(EVIL[1])}&tolerance={quote(EVIL[2])}"
    f"&share={quote(EVIL[4])}",
    f"/validations?campaign={quote(EVIL[0])}&contact={quote(EVIL[1])}",
])  # fmt: skip
def test_what_an_address_says_is_no_html(evil: tuple[Any, Any], address: str) -> None:
    checked(evil[0], address)


def test_what_a_refused_address_says_is_no_html(evil: tuple[Any, Any]) -> None:
    address = f"/twin?insulator={quote(EVIL[0])}&impact_position={quote(EVIL[2])}"
    checked(evil[0], address, status=422)


@pytest.mark.parametrize(
    "address",
    ["/campaigns/{}", "/plans/{}", "/impacts?campaign={}", "/impacts?where={}", "/twin?contact={}",
     "/twin?campaign={}", "/models/{}/1", "/jobs/{}", "/reports/campaign/{}.html", "/{}"],
)  # fmt: skip
@pytest.mark.parametrize("words", EVIL[:4])
def test_errors_are_words_too(evil: tuple[Any, Any], address: str, words: str) -> None:
    answer = evil[0].get(address.format(quote(words, safe="")))
    statuses = (400,) if "where=" in address else (404, 422)
    assert answer.status_code in statuses and ShownPage(answer.text).wrong == []


def test_names_stand_in_charts_as_text(evil: tuple[Any, Any]) -> None:
    """The script of the charts writes text nodes and attributes, and never markup."""
    names = []
    for address in (CAMPAIGN, "/impacts/1", f"/compare?factor={quote(NAME)}"):
        for script in checked(evil[0], address).scripts:
            data = json.loads(script)
            for figure in data.get("rows", [data] if "series" in data else []):
                names += [own["detail"] + own["name"] for own in figure["series"]]
                names += figure["x"]["categories"] + [figure["x"]["heading"]]
    assert any("alert" in name for name in names)
    for file in STATIC.glob("*.js"):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write", text)
    text = evil[0].get(f"/compare?factor={quote(NAME)}").text
    for script in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, re.S):
        json.loads(script)
        assert not set("<>&") & set(script)


def test_names_with_slashes_reach_their_routes_and_notes_come_back(evil: tuple[Any, Any]) -> None:
    client, store = evil
    links = checked(client, "/campaigns").links
    assert CAMPAIGN in links and all(link.startswith(("/", "#")) for link in links)
    assert client.get(f"/api{CAMPAIGN}").json()["campaign"]["name"] == NAME
    assert client.get(f"/api{PLANNED}").json()["name"] == NAME
    assert client.get(f"/api{PLANNED}/quality").status_code == 200
    assert client.get("/api/impacts", params={"campaign": NAME}).json()[0]["campaign"] == NAME
    for ending in ("csv", "xlsx", "html"):
        answer = client.get(f"{PLANNED}/sheet.{ending}")
        assert answer.status_code == 200 and "\n" not in answer.headers["content-disposition"]
    assert client.get(
        f"/reports{CAMPAIGN.replace('campaigns', 'campaign')}.pdf"
    ).content.startswith(b"%PDF")
    with store.reading() as session:
        assert read_plan(session, NAME).name == NAME
    client, store = evil
    answer = post(client, f"{PLANNED}/runs/1", {"status": "discarded", "note": NAME})
    assert answer.status_code == 303 and answer.headers["location"] == f"{PLANNED}/sheet"
    with store.reading() as session:
        assert read_plan(session, NAME).runs[0].reason == NAME or NAME in [
            run.reason for run in read_plan(session, NAME).runs
        ]
    assert (
        post_json(client, f"/api{PLANNED}/runs/2", {"status": "discarded", "note": NAME}).json()[
            "reason"
        ]
        == NAME
    )
    assert checked(client, f"{PLANNED}/sheet").text.count("Note: <script>") == 2
    assert f"{PLANNED}/sheet" in checked(client, "/plans").links


#: Three levels of the bullet's mass, and a range of pressures.
FACED = with_ranges(
    shipped_factors("gun"), {"tank_pressure_bar": (1, 6), "tip_radius_mm": (30, 60)}
)


def test_a_plan_made_here_may_have_any_name_and_the_options_of_its_method(
    evil: tuple[Any, Any],
) -> None:
    client, store = evil
    form = {
        "name": SHORT,
        "method": "factorial",
        "kind": "hammer",
        "factors": FACTORS,
        "description": NAME,
    }
    answer = post(client, "/plans", form)
    job = ended(client, answer)
    assert (job["state"], job["address"]) == ("done", f"/plans/{quote(SHORT, safe='')}")
    assert SHORT in checked(client, answer.headers["location"]).text
    assert checked(client, job["address"]) and checked(client, "/jobs")
    with store.reading() as session:
        assert session.scalar(select(Plan.description).where(Plan.name == SHORT)) == NAME
    # Fields of other methods, which the form sends too, are left alone.
    client, store = evil
    form = {
        "name": "faced",
        "method": "central-composite",
        "categorical": "cross",
        "kind": "gun",
    }
    form |= {
        "centre": "1",
        "criterion": "maximin",
        "factors": FACED,
        "repetitions": "1",
    }
    job = ended(client, post(client, "/plans", form))
    assert (job["state"], job["error"]) == ("done", None)
    with store.reading() as session:
        assert session.scalar(select(Plan.method).where(Plan.name == "faced")) == (
            "central-composite centre=1 categorical=cross"
        )
    for method in METHODS.values():
        page = client.get("/plans/new").text
        assert all(f'name="{option.name}"' in page for option in method.options)


def test_file_names_of_an_upload_are_words(evil: tuple[Any, Any], tmp_path: Path) -> None:
    answer = post(
        evil[0], "/ingest/upload", files=[("files", ('"><img src=x onerror=alert(1)>', b"x"))]
    )
    assert answer.status_code == 422 and ShownPage(answer.text).wrong == []


def test_reasons_of_promotions_and_names_of_effects_are_words(filled: Lab) -> None:
    post(filled.client, "/models/linear/1/promote", {"reason": NAME, "force": "true"})
    assert shown(checked(filled.client, "/models")) and shown(
        checked(filled.client, "/models/linear/1")
    )
    checked(filled.client, "/reports/model/linear/1.html")
    checked(filled.client, f"/plans/{quote(PLAN, safe='')}")
    answer = post(filled.client, "/diagnoses/1/adopt", {"effect": EVIL[0]})
    assert answer.status_code == 404 and ShownPage(answer.text).wrong == []
    answer = post(filled.client, "/diagnoses", {"campaign": GUN, "simulator": EVIL[1]})
    assert answer.status_code in (404, 422) and ShownPage(answer.text).wrong == []
