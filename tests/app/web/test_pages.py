"""Every page over HTTP: what it shows of an empty store and of a filled one, and what its forms
change."""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.statements import summary
from pyroshock.app.operations.diagnose.stored import kept_options, kept_report
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.train.compare import MOST_COMPARED
from pyroshock.app.operations.train.promote import PROMOTE
from pyroshock.doe.plans import read_plan
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.person_roles import USER, Person
from pyroshock.schema.provenance import Provenance
from pyroshock.schema.session import Store, Writer
from pyroshock.training.evaluation import gate
from pyroshock.training.registry.registry import Registry
from pyroshock.twin.tune.attainability import Attainability
from sqlalchemy import select
from support.checks.well_formed import Page
from support.processes.web_client import ended, post, post_json
from support.records import verdicts
from support.records.campaigns import gun_campaign
from support.stores.planned_runs import record_run
from support.stores.web_stores import DATASET, FACTORS, GUN, HAMMER, PLAN, Lab

AT = quote(PLAN, safe="")
#: Filling a store imports much; on a busy machine that is slow.
pytestmark = pytest.mark.timeout(600)
SPECIFICATION = "frequency_hz,level_g\n100,30\n1000,1000\n10000,1000\n"


@pytest.mark.parametrize(("address", "words"), [
    ("/", 'id="first-steps"'),
    ("/campaigns", "The store is empty"),
    ("/impacts", "The store has no impacts yet"),
    ("/shots", "The store has no shots of a gun yet"),
    ("/compare", "The store has no pulses yet"),
    ("/deleted", "Nothing was deleted"),
    ("/compare/spectra", "Enter the impacts"),
    ("/models", "No model is registered yet"),
    ("/models/compare", "No model is registered yet"),
    ("/models/train", "There is no dataset yet"),
    ("/datasets", "There is no dataset yet"),
    ("/twin", 'id="tank_pressure_pa"'),
    ("/tune", "The chart of the specification appears here"),
    ("/plans", "There is no plan yet"),
    ("/plans/new", 'id="make"'),
    ("/diagnoses", "The store has no diagnosis"),
    ("/validations", "There is no validation yet"),
    ("/ingest", 'id="upload"'),
    ("/jobs", "No jobs yet"),
])  # fmt: skip
def test_an_empty_store_says_what_to_do(empty: Lab, address: str, words: str) -> None:
    answer = empty.client.get(address)
    assert answer.status_code == 200 and words in answer.text


@pytest.mark.parametrize(("address", "words"), [
    ("/campaigns", HAMMER),
    ("/", f'href="/campaigns/{HAMMER}"'),
    ("/campaigns?kind=gun&name=first", GUN),
    (f"/campaigns/{HAMMER}/extract", 'name="preview"'),
    (f"/campaigns/{HAMMER}/extract?preview=1&threshold=0.02", "Of 4 recordings 4 were tried"),
    (f"/campaigns/{HAMMER}/export", 'id="export"'),
    (f"/campaigns/{HAMMER}/archive", f"dataset {DATASET}"),
    (f"/campaigns/{HAMMER}", "20 impacts, 0 shots, 4 recordings"),
    (f"/campaigns/{GUN}", "0 impacts, 5 shots"),
    ("/impacts", 'href="/impacts/21"'),
    (f"/impacts?campaign={HAMMER}&where=tip_material=delrin", 'href="/impacts/6"'),
    ("/shots", "measured velocity (m/s)"),
    ("/impacts/1", 'id="segmentation-data"'),
    ("/impacts/21", 'id="channels-data"'),
    ("/impacts/1?preview=true&threshold=0.02", 'id="preview"'),
    ("/compare?factor=tip_material", 'id="overlay-data"'),
    ("/compare?normalised=true&factor=tip_radius", 'id="groups"'),
    ("/compare/spectra?impacts=21", 'id="paper-data"'),
    ("/models", "tree@1"),
    ("/models/tree/1", 'id="against-1-data"'),
    ("/models/tree/1", 'id="worst"'),
    ("/models/compare?version=tree@1&version=linear@1", 'id="differences"'),
    ("/models/compare", 'value="tree@1 repetitions"'),
    ("/models/train", 'id="model-tree"'),
    ("/datasets", f'href="/datasets/{DATASET}"'),
    (f"/datasets/{DATASET}", 'id="models"'),
    ("/twin?contact=hertz", 'id="force-data"'),
    ("/plans", f'href="/plans/{AT}"'),
    (f"/plans/{AT}", 'id="runs"'),
    (f"/plans/{AT}/sheet", 'id="run-4"'),
    (f"/plans/{AT}/sheet.html", "Plan autumn/1"),
    (f"/plans/{AT}/sheet.csv", "tip_material"),
    ("/diagnoses", GUN),
    ("/diagnoses/1", 'id="plan-next"'),
    ("/ingest", HAMMER),
    (f"/reports/campaign/{HAMMER}.html", HAMMER),
    ("/reports/diagnosis/1.html", GUN),
    ("/reports/model/tree/1.html", "tree@1"),
])  # fmt: skip
def test_a_filled_store_is_shown(filled: Lab, address: str, words: str) -> None:
    answer = filled.client.get(address)
    assert answer.status_code == 200, answer.text
    assert words in answer.text


@pytest.mark.parametrize(
    "address", ["/models/tree/1", "/models/compare?version=tree@1&version=linear@1"]
)
def test_settings_of_a_training_are_shown(
    filled: Lab, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = {"force.kernel": "matern <5/2>", "force.noise": 0.0125, "force.ard": True}
    monkeypatch.setattr(
        Registry, "fit_settings", lambda _, version: settings if version.name == "tree" else {}
    )
    # Another address than that of a page that is kept.
    unkept_address = f"{address}{'&' if '?' in address else '?'}patched=true"
    table = (
        filled.client.get(unkept_address)
        .text.partition('<table id="settings">')[2]
        .partition("</table>")[0]
    )
    for words in ("force.kernel", "matern &lt;5/2&gt;", "0.0125", "True"):
        assert words in table
    assert ("<td>–</td>" in table) == ("linear" in address)


@pytest.mark.parametrize("address", [f"/campaigns/{GUN}", f"/shots?campaign={GUN}"])
def test_a_velocity_stands_with_its_uncertainty(filled: Lab, address: str) -> None:
    page = filled.client.get(address).text
    assert ">10.37 ± 0.13</td>" in page and "uncertainty of the velocity" not in page


@pytest.mark.parametrize(
    "address", [f"campaign/{HAMMER}", f"campaign/{GUN}", "diagnosis/1", "model/tree/1"]
)
def test_reports_are_saved_as_pdf(filled: Lab, address: str) -> None:
    answer = filled.client.get(f"/reports/{address}.pdf")
    assert (
        answer.content.startswith(b"%PDF-") and answer.headers["content-type"] == "application/pdf"
    )
    assert answer.headers["content-disposition"].startswith("attachment")


def test_a_sheet_is_saved_as_a_table_and_a_damaged_model_is_marked(filled: Lab) -> None:
    from openpyxl import load_workbook

    content = filled.client.get(f"/plans/{AT}/sheet.xlsx").content
    rows = list(load_workbook(io.BytesIO(content)).active.iter_rows(values_only=True))
    assert sum("delrin" in row for row in rows) == 2
    file = min(filled.folder.rglob("model.json"))
    mark, kept = '<strong class="bad">damaged</strong>', file.read_bytes()
    file.write_bytes(b"{}")
    try:
        marked = filled.client.get("/models").text.count(mark)
    finally:
        file.write_bytes(kept)
    assert (marked, filled.client.get("/models").text.count(mark)) == (1, 0)


@pytest.mark.parametrize(("address", "status", "words"), [
    ("/campaigns/winter", 404, "winter"),
    ("/campaigns?kind=cannon", 422, "cannon"),
    ("/campaigns?after=winter", 404, "begin at the first page"),
    ("/campaigns/winter/extract", 404, "winter"),
    ("/campaigns/winter/export", 404, "winter"),
    ("/campaigns/winter/archive", 404, "winter"),
    (f"/campaigns/{HAMMER}/extract?preview=1&threshold=much", 422, "much"),
    (f"/campaigns/{HAMMER}/extract?preview=1&separation_s=-1", 422, "separation_s is -1"),
    (f"/campaigns/{HAMMER}/export?what=secrets", 422, "secrets"),
    (f"/campaigns/{HAMMER}/export?what=impacts&format=doc", 422, "doc"),
    (f"/campaigns/{HAMMER}/export?what=impacts&where=hardness=3", 400, "hardness"),
    (f"/campaigns/{HAMMER}/export?what=shots", 422, "no row matches"),
    ("/deleted/99/file", 404, "99"),
    ("/ingest/checks/999", 404, "999"),
    ("/impacts/777", 404, "777"),
    ("/impacts/one", 422, "one"),
    ("/impacts?where=hardness=3", 400, "hardness"),
    ("/impacts/1?preview=true&threshold=7", 422, "threshold is 7"),
    ("/impacts/1?preview=true&segmentation=guess", 422, "guess"),
    ("/compare?where=tip_material", 400, "FIELD=VALUE"),
    ("/compare/spectra?impacts=777", 404, "777"),
    ("/compare/spectra?impacts=21&specification=x", 422, "specification"),
    ("/models/forest/1", 404, "forest"),
    ("/datasets/winter", 404, "winter"),
    ("/tune/99", 404, "99"),
    ("/validations/99", 404, "99"),
    ("/plans/winter", 404, "winter"),
    (f"/plans/{AT}/sheet.doc", 404, "doc"),
    ("/plans/new?kind=cannon", 422, "cannon"),
    ("/diagnoses/99", 404, "99"),
    ("/jobs/999", 404, "999"),
    ("/reports/campaign/winter.html", 404, "winter"),
    ("/reports/model/tree/9.pdf", 404, "tree@9"),
    ("/nowhere", 404, "Not Found"),
    ("/static/%2e%2e/settings.py", 404, "Not Found"),
])  # fmt: skip
def test_a_bad_address_is_answered_in_words(
    filled: Lab, address: str, status: int, words: str
) -> None:
    answer = filled.client.get(address)
    assert answer.status_code == status, answer.text
    assert words in answer.text and ('id="error"' in answer.text or "field-error" in answer.text)


@pytest.mark.parametrize(("query", "status", "field", "words"), [
    ("campaign=winter", 404, "campaign", "winter"),
    ("contact=gp@99", 404, "contact", "gp"),
    ("plate=butter", 404, "plate", "butter"),
    ("tank_pressure_pa=abc", 422, "tank_pressure_pa",
     "Tank pressure is &#39;abc&#39;; expected a number with a unit, such as 1bar."),
    ("tip_radius_m=0", 422, "tip_radius_m", "Tip radius is 0; expected a number from 1e-05 to 10."),
    ("tip_material=butter", 200, "tip_material", "expected one of"),
])  # fmt: skip
def test_the_twin_names_a_bad_value_at_its_control_and_lives(
    filled: Lab, query, status, field, words
) -> None:
    answer = filled.client.get(f"/twin?contact=hertz&bullet_mass_kg=0.25&{query}")
    assert answer.status_code == status
    assert f'id="{field}-error"' in answer.text and words in answer.text
    assert 'id="force-data"' in answer.text and 'value="0.25"' in answer.text


def test_a_bench_without_a_gun_is_offered_to_no_search_of_settings(filled: Lab) -> None:
    page = filled.client.get(f"/twin?campaign={HAMMER}&contact=hertz")
    assert page.status_code == 200 and 'href="/tune?contact=hertz"' in page.text
    form = filled.client.get("/tune").text
    assert f'<option value="{GUN}">' in form and f'<option value="{HAMMER}">' not in form
    assert 'id="impact_velocity_m_s"' in page.text and 'id="velocity-data"' not in page.text


def test_the_twin_names_a_setting_that_it_does_not_know(filled: Lab) -> None:
    answer = filled.client.get("/twin?contact=hertz&colour=red")
    assert answer.status_code == 422 and "colour is no setting of a shot" in answer.text


@pytest.mark.parametrize(("form", "field", "words"), [
    ({}, "target", "target is missing"),
    ({"target": "frequency_hz,level_g\n100,30\n1000,x\n"}, "target", "line 3: level_g is 'x'"),
    ({"target": SPECIFICATION, "measured": "winter"}, "measured", "winter"),
    ({"target": SPECIFICATION, "campaign": "winter"}, "campaign", "winter"),
    ({"target": SPECIFICATION, "contact": "gp@99"}, "contact", "no registered model 'gp'"),
    ({"target": SPECIFICATION, "plate": "cheese"}, "plate", "cheese"),
    (
        {"target": SPECIFICATION, "bench": '[plate]\nmodes = "/etc/passwd"\n'},
        "bench",
        "bench names another file",
    ),
])  # fmt: skip
def test_a_fault_of_a_search_stands_at_its_field(filled: Lab, form, field, words) -> None:
    token = {
        **form,
        "csrf": filled.client.get("/tune").text.split('name="csrf" value="')[1].split('"')[0],
    }
    answer = filled.client.post("/tune", data=token, headers={"X-Pyroshock-Form": "1"})
    (fault,) = answer.json()["faults"]
    assert answer.status_code in (404, 422)
    assert fault["field"] == field and words in fault["message"]


@pytest.mark.parametrize("address", ["/diagnoses", "/plans/new", "/tune"])
def test_forms_with_files_send_the_files_and_not_their_names(filled: Lab, address: str) -> None:
    text = filled.client.get(address).text
    forms = [part for part in text.split("<form ")[1:] if 'type="file"' in part.split("</form>")[0]]
    assert forms
    for form in forms:
        assert 'enctype="multipart/form-data"' in form.split(">")[0]


def test_the_campaign_of_a_diagnosis_is_chosen_from_a_list(filled: Lab) -> None:
    form = filled.client.get("/diagnoses").text.split('id="diagnose"')[1].split("</form>")[0]
    assert '<select id="campaign"' in form and '<option value="">' not in form
    named = filled.client.get(f"/diagnoses?campaign={GUN}").text.split('id="diagnose"')[1]
    assert f"<option selected>{GUN}</option>" in named.split("</select>")[0]


def test_what_two_fields_of_a_plan_contradict_stands_at_one_of_them(filled: Lab) -> None:
    page = filled.client.get("/plans/new").text
    sent = {"name": "x", "method": "lhs", "order": "random", "blocks": "2"}
    sent["csrf"] = page.split('name="csrf" value="')[1].split('"')[0]
    answer = filled.client.post("/plans", data=sent, headers={"X-Pyroshock-Form": "1"})
    (fault,) = answer.json()["faults"]
    assert answer.status_code == 422
    assert fault["field"] == "blocks" and "blocks is 2 in random order" in fault["message"]


def test_forms_are_filled_with_the_values_of_their_address(filled: Lab) -> None:
    form = filled.client.get(
        "/tune", params={"text": SPECIFICATION, "campaign": GUN, "contact": "gp@<9>"}
    ).text
    assert SPECIFICATION in form and f"<option selected>{GUN}</option>" in form
    assert "<option selected>gp@&lt;9&gt;</option>" in form
    form = filled.client.get("/models/train", params={"dataset": DATASET}).text
    assert f'<option value="{DATASET}" selected>' in form
    form = filled.client.get("/validations", params={"campaign": GUN, "contact": "gp@9"}).text
    assert f"<option selected>{GUN}</option>" in form and "<option selected>gp@9</option>" in form


def test_a_specification_is_drawn_before_the_search(filled: Lab) -> None:
    answer = post_json(filled.client, "/tune/target", {"text": SPECIFICATION, "tolerance": "3dB"})
    assert answer.status_code == 200 and "+3/−3 dB" in answer.json()["sentence"]
    assert {own["name"] for own in answer.json()["figure"]["series"]} > {
        "prescribed",
        "tolerance",
    }
    csrf = filled.client.get("/tune").text.split('name="csrf" value="')[1].split('"')[0]
    headers = {"X-Pyroshock-Form": "1", "X-CSRF-Token": csrf}
    wrong = {"text": "frequency_hz,level_g\n100,30\n1000,loud\n"}
    answer = filled.client.post("/tune/target", json=wrong, headers=headers)
    (fault,) = answer.json()["faults"]
    assert answer.status_code == 422 and "level_g is 'loud'" in fault["message"]


@pytest.mark.parametrize("contact", ["gp@99", "granite"])
def test_an_unknown_contact_of_a_validation_stands_at_its_field(filled: Lab, contact: str) -> None:
    form = {"campaign": GUN, "contact": contact}
    answer = post(filled.client, "/validations", form, headers={"X-Pyroshock-Form": "1"})
    (fault,) = answer.json()["faults"]
    assert (
        answer.status_code in (404, 422)
        and fault["field"] == "contact"
        and contact.split("@")[0] in fault["message"]
    )


@pytest.mark.parametrize(("address", "form", "status", "words"), [
    ("/ingest/path", {"path": "/etc"}, 422, "/etc"),
    ("/ingest/path", {"path": "../../.."}, 422, "campaign.toml"),
    ("/ingest/path", {"path": HAMMER, "threshold": "9"}, 422, "threshold is 9"),
    ("/ingest/path", {"path": HAMMER, "segmentation": "guess"}, 422, "guess"),
    ("/ingest/path", {}, 422, "path"),
    ("/ingest/path", {"path": HAMMER, "plan": "winter"}, 422, "no plan &#39;winter&#39;"),
    ("/ingest/path", {"path": HAMMER, "threshold": "much"}, 422, "much"),
    ("/ingest/checks/999/store", {}, 404, "999"),
    (f"/campaigns/{HAMMER}/archive", {"reason": " "}, 422, "reason is missing"),
    (f"/campaigns/{HAMMER}/delete", {"reason": " "}, 422, "reason is missing"),
    (f"/campaigns/{HAMMER}/extract", {"smoothing": "7"}, 422, "smoothing is 7"),
    ("/campaigns/winter/extract", {}, 404, "winter"),
    ("/deleted/99/restore", {}, 404, "99"),
    ("/ingest/restore", {}, 422, "No file was sent"),
    ("/impacts/1/extract", {"segmentation": "walk", "threshold": "x", "smoothing": "1"}, 422,
     "threshold"),
    ("/impacts/1/extract", {"segmentation": "walk", "threshold": "nan", "smoothing": "1"}, 422,
     "nan"),
    ("/impacts/777/extract", {"segmentation": "walk", "threshold": "0.01", "smoothing": "1"}, 404,
     "777"),
    ("/plans", {"name": " "}, 422, "name is missing"),
    ("/plans", {"name": "new"}, 422, "cannot name a plan"),
    ("/plans", {"name": "x", "runs": "0"}, 422, "runs"),
    ("/plans", {"name": "x", "runs": "5000"}, 422,
     "runs is 5000; expected a whole number from 1 to 2000"),
    ("/plans", {"name": "x", "seed": "²"}, 422, "²"),
    ("/plans", {"name": "x", "seed": "99999999999"}, 422, "99999999999"),
    ("/plans", {"name": "x", "factors": "["}, 422, "not TOML"),
    ("/plans", {"name": "x", "description": "\x07"}, 422, "description"),
    ("/plans", {"name": PLAN}, 422, "in the store already"),
    ("/plans", {"name": "x", "method": "guess"}, 422, "guess"),
    ("/plans", {"name": "x", "criterion": "guess"}, 422, "expected one of balance, random"),
    (f"/plans/{AT}/runs/1", {"status": "lost"}, 422, "lost"),
    (f"/plans/{AT}/runs/1", {"status": "discarded"}, 422, "reason"),
    (f"/plans/{AT}/runs/9", {"status": "done"}, 422, "no run 9"),
    ("/plans/winter/runs/1", {"status": "done"}, 404, "winter"),
    ("/models/tree/1/promote", {"reason": "  "}, 422, "reason is missing"),
    ("/models/tree/1/promote", {"reason": "x", "on": "winter"}, 404, "winter"),
    ("/models/forest/1/promote", {"reason": "x"}, 404, "forest"),
    ("/datasets", {"name": " ", "campaigns": HAMMER}, 422, "name is missing"),
    ("/datasets", {"name": "x"}, 422, "campaigns is missing"),
    ("/datasets", {"name": "x", "campaigns": "winter"}, 404, "winter"),
    ("/datasets", {"name": "x", "campaigns": HAMMER, "quality": "best"}, 422, "quality"),
    ("/models/train", {"dataset": DATASET}, 422, "models is missing"),
    ("/models/train", {"dataset": DATASET, "models": "forest"}, 404, "forest"),
    ("/models/train", {"dataset": "winter", "models": "tree"}, 404, "winter"),
    ("/models/train", {"dataset": DATASET, "models": "tree", "split": "halves"}, 422, "halves"),
    ("/diagnoses", {"campaign": "winter"}, 404, "winter"),
    ("/diagnoses", {"campaign": "/etc"}, 404, "/etc"),
    ("/diagnoses", {"campaign": GUN, "tolerances": "gun=-1%"}, 422, "-1"),
    ("/diagnoses", {"campaign": GUN, "uncertain": "friction=1"}, 422, "friction=1"),
    ("/diagnoses/1/adopt", {"effect": "gun.magic"}, 404, "gun.magic"),
    ("/diagnoses/1/what-if", {"with_effects": "gun.magic"}, 404, "gun.magic"),
    ("/diagnoses/99/what-if", {"with_effects": "gun.valve_flow"}, 404, "99"),
    ("/diagnoses", {"campaign": GUN, "without_effects": "gun.magic"}, 404, "gun.magic"),
    ("/diagnoses/99/plan", {"name": "x"}, 404, "99"),
    ("/validations", {"campaign": "winter"}, 404, "winter"),
    ("/tune", {}, 422, "target is missing"),
    ("/tune", {"target": "loud"}, 422, "the target: no column frequency_hz"),
    ("/tune", {"target": SPECIFICATION, "measured": ",".join("abcdefghijklmnopqrstu")}, 422,
     "expected a list of at most 20 values"),
    ("/jobs/999/stop", {}, 404, "999"),
])  # fmt: skip
def test_a_bad_form_is_answered_in_words_and_changes_nothing(
    filled: Lab, address, form, status, words
) -> None:
    before, jobs = filled.rows(), len(filled.client.get("/api/jobs").json())
    answer = post(filled.client, address, form)
    assert answer.status_code == status, answer.text
    assert (
        words in answer.text
        and filled.rows() == before
        and len(filled.client.get("/api/jobs").json()) == jobs
    )


def done(filled: Lab, answer: Any) -> dict[str, Any]:
    assert answer.status_code == 303, answer.text
    assert filled.client.get(answer.headers["location"]).status_code == 200
    job = ended(filled.client, answer)
    assert job["state"] == "done", job["error"]
    assert filled.client.get(f"/jobs/{job['id']}").status_code == 200
    return job


@pytest.fixture
def ready(filled: Lab) -> Path:
    """A folder below those that may be read, for campaigns of a test."""
    return filled.folder / "campaigns"


def test_a_folder_is_ingested_by_its_path_and_a_damaged_one_stores_nothing(
    filled: Lab, ready: Path
) -> None:
    folder, before = gun_campaign(ready / "by-path", 2, "by-path"), filled.rows()
    job = done(filled, post(filled.client, "/ingest/path", {"path": "by-path"}))
    added = filled.added(before)
    assert (added["campaigns"], added["shots"]) == (1, 2)
    assert (job["address"], job["result"]["shots"]) == ("/campaigns/by-path", 2)
    before = filled.rows()  # and again: nothing
    done(filled, post(filled.client, "/ingest/path", {"path": str(folder)}))
    assert filled.added(before) == {}
    folder, before = gun_campaign(ready / "damaged", 2, "damaged"), filled.rows()
    (folder / "runs.csv").write_text("run,repetition\n1,one\n", encoding="utf-8")
    job = ended(filled.client, post(filled.client, "/ingest/path", {"path": "damaged"}))
    assert job["state"] == "failed" and "runs.csv" in job["error"]
    assert job["error"] in filled.client.get(f"/jobs/{job['id']}").text.replace(
        "&#39;", "'"
    ).replace("&#34;", '"')
    assert filled.added(before) == {}


@pytest.mark.parametrize("packed", [True, False], ids=["zip", "files"])
def test_a_campaign_is_uploaded(filled: Lab, tmp_path: Path, packed: bool) -> None:
    name = f"sent-{packed}".lower()
    folder, before = gun_campaign(tmp_path / name, 3, name), filled.rows()
    sent = {f"{name}/{path.name}": path.read_bytes() for path in folder.iterdir()}
    if packed:
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            for path, content in sent.items():
                archive.writestr(path, content)
        sent = {"campaign.zip": out.getvalue()}
    job = done(
        filled,
        post(filled.client, "/ingest/upload", files=[("files", each) for each in sent.items()]),
    )
    added = filled.added(before)
    assert (added["campaigns"], added["shots"]) == (1, 3) and job["address"] == f"/campaigns/{name}"


def pulses(filled: Lab, impact: int) -> list[tuple[int, bool]]:
    with filled.store.reading() as session:
        query = select(Pulse.id, Pulse.current).where(Pulse.impact_id == impact).order_by(Pulse.id)
        return [tuple(row) for row in session.execute(query)]  # type: ignore[misc]


def test_an_extraction_is_previewed_and_then_stored(filled: Lab) -> None:
    before, versions = filled.rows(), pulses(filled, 2)
    page = filled.client.get(
        "/impacts/2?preview=true&segmentation=walk&threshold=0.03&smoothing=0.98"
    ).text
    assert 'name="threshold" value="0.03"' in page
    assert filled.rows() == before  # a preview is no write
    form = {"segmentation": "walk", "threshold": "0.03", "smoothing": "0.98"}
    answer = post(filled.client, "/impacts/2/extract", form)
    assert (answer.status_code, answer.headers["location"]) == (303, "/impacts/2")
    added = filled.added(before)
    assert (added["pulses"], added["extraction_settings"]) == (5, 1)  # all hits of the recording
    assert pulses(filled, 2)[:-1] == [
        (key, False) for key, _ in versions
    ]  # the old version stays, and is not in use
    assert pulses(filled, 2)[-1][1]


def test_a_plan_is_made_and_runs_are_ticked_at_the_bench(filled: Lab) -> None:
    before = filled.rows()
    form = {
        "name": "winter/2",
        "method": "factorial",
        "kind": "hammer",
        "factors": FACTORS,
        "repetitions": "3",
    }
    job = done(
        filled, post(filled.client, "/plans", {**form, "seed": "5", "description": "cold hall"})
    )
    added = filled.added(before)
    assert (added["plans"], added["planned_runs"]) == (1, 4) and job[
        "address"
    ] == "/plans/winter%2F2"
    with filled.store.reading() as session:
        plan = read_plan(session, "winter/2")
        signed = set(session.scalars(select(Provenance.command)))
    assert (plan.seed, plan.description, plan.runs[0].repetitions) == (5, "cold hall", 3)
    assert {"serve: POST /plans", f"job {job['id']}: Plan winter/2"} <= signed
    assert "cold hall" in filled.client.get(job["address"]).text
    before = filled.rows()
    answer = post(filled.client, f"/plans/{AT}/runs/2", {"status": "done", "note": "I saw it"})
    assert answer.status_code == 422 and "repetitions are recorded and accepted" in answer.text
    seen = []
    for status, note, query in [("discarded", "tip cracked", ""), ("planned", "", "?run=2")]:
        answer = post(filled.client, f"/plans/{AT}/runs/2", {"status": status, "note": note})
        assert (answer.status_code, answer.headers["location"]) == (
            303,
            f"/plans/{AT}/sheet{query}",
        )
        seen.append(run(filled, 2))
    assert seen == [("discarded", "tip cracked"), ("planned", None)] and filled.added(before) == {}
    record_run(filled.store, PLAN, 2, (1,))
    post(filled.client, f"/plans/{AT}/runs/2", {"status": "done", "note": "one is enough"})
    assert run(filled, 2) == ("done", "one is enough")


def run(filled: Lab, number: int) -> tuple[str, str | None]:
    with filled.store.reading() as session:
        planned_run = next(
            stored_run for stored_run in read_plan(session, PLAN).runs if stored_run.run == number
        )
        return planned_run.status, planned_run.reason


def test_a_model_is_promoted_and_another_not_judged_by_few_configurations(filled: Lab) -> None:
    post(filled.client, "/models/tree/1/promote", {"reason": "the first one", "force": "true"})
    answer = post(filled.client, "/models/linear/1/promote", {"reason": "for a try"})
    page = filled.client.get(answer.headers["location"]).text
    assert (
        "Not enough to judge: 4 configurations are not enough" in page and 'id="in-use"' not in page
    )


def test_a_model_is_promoted_and_a_worse_one_refused(
    filled: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gate, "LEAST_CONFIGURATIONS", 4)  # as many as the store has
    decisions = len(filled.client.get("/api/models/promotions").json())
    better, worse = "tree", "linear"
    answer = post(
        filled.client, f"/models/{better}/1/promote", {"reason": "the first one", "force": "true"}
    )
    page = filled.client.get(answer.headers["location"]).text
    assert answer.status_code == 303 and 'id="in-use"' in page and "Promoted: the first one" in page
    answer = post(filled.client, f"/models/{worse}/1/promote", {"reason": "for a try"})
    page = filled.client.get(answer.headers["location"]).text
    assert "Refused" in page, "a tree that memorised 16 pulses was to be better than a line"
    assert 'id="in-use"' not in page
    told = filled.client.get("/api/models/promotions").json()
    assert [each["promoted"] for each in told[: len(told) - decisions]] == [
        False,
        True,
    ]  # the newest first
    page = filled.client.get("/models").text
    assert 0 < page.index("for a try") < page.index("the first one")


def test_a_promotion_is_by_who_is_signed_in(filled: Lab) -> None:
    emma = Store(filled.store.engine, Writer("test", "0", Person("emma", "engineer", USER, 1)))
    question = read(
        PROMOTE.request,
        {"model": "tree", "version": 1, "force": True, "reason": "for the bench"},
        "python",
    )
    PROMOTE.answer(question, Laboratory(emma, filled.db), lambda *_: None)
    decision = filled.client.get("/api/models/promotions").json()[0]
    assert (decision["who"], decision["candidate"]) == ("emma", "tree@1")
    assert "UTC, emma: promoted" in filled.client.get("/models/tree/1").text


def test_the_model_in_use_stands_first_with_its_error_and_the_differences_to_it(
    filled: Lab,
) -> None:
    post(filled.client, "/models/tree/1/promote", {"reason": "the first one", "force": "true"})
    page = filled.client.get("/models").text
    assert (
        page.index('id="in-use"')
        < page.index("tree@1 predicts the force within")
        < page.index('id="models"')
    )
    assert 'id="differences-data"' in page and '<span class="badge">in use: hammer</span>' in page


@pytest.mark.parametrize(("query", "status", "words"), [
    ("", 200, f"Choose 2 to {MOST_COMPARED} versions"),
    ("?version=tree@1", 422, "a comparison needs two models"),
    ("?version=tree@1 repetitions&version=linear@1 configurations", 422, "one split"),
    ("?" + "&".join(f"version=tree@{n}" for n in range(1, 30)), 422, f"at most {MOST_COMPARED}"),
    ("?version=tree@1&version=forest@1", 404, "forest"),
])  # fmt: skip
def test_versions_to_compare_are_picked_where_they_cannot_be_compared(
    filled: Lab, query: str, status: int, words: str
) -> None:
    answer = filled.client.get(f"/models/compare{query}")
    assert answer.status_code == status and words in answer.text and 'id="picker"' in answer.text
    assert ('value="tree@1 repetitions" checked' in answer.text) == ("tree@1" in query)


def test_a_comparison_says_in_percent_which_version_is_better(filled: Lab) -> None:
    page = filled.client.get("/models/compare?version=tree@1&version=linear@1").text
    sentences = page.partition('id="sentences"')[2].partition("</ul>")[0]
    assert "cannot be told apart" in sentences or "is better than" in sentences
    assert "%" in sentences and "force error" in sentences


@pytest.mark.parametrize(
    "query",
    [
        "version=tree@1 repetitions&version=linear@1 repetitions",
        "version=tree@1&version=linear@1&split=repetitions",
        "version=tree@1&split=repetitions",
    ],
)
def test_the_chosen_split_stays_chosen(filled: Lab, query: str) -> None:
    page = filled.client.get(f"/models/compare?{query}").text
    ticked = re.findall(r'value="([^"]*)" checked', page)
    labels = re.findall("version=([a-z]+@1)", query)
    assert sorted(ticked) == sorted(f"{label} repetitions" for label in labels)


def test_a_dataset_is_built_once_and_shown_with_what_was_left_out(filled: Lab) -> None:
    form = {"name": "winter pulses", "campaigns": HAMMER, "quality": "none"}
    answers = [
        post(filled.client, "/datasets", {**form, "name": name})
        for name in ("winter pulses", "other name")
    ]
    addresses = [answer.headers["location"] for answer in answers]
    assert [answer.status_code for answer in answers] == [303, 303] and addresses[1].endswith(
        "?existing=true"
    )
    assert addresses[0].partition("?")[0] == addresses[1].partition("?")[0]
    page = filled.client.get(addresses[1]).text
    assert (
        'id="existing"' in page
        and 'id="left-out"' in page
        and HAMMER in page
        and 'id="files"' in page
    )


def test_the_form_of_a_training_starts_its_job(filled: Lab) -> None:
    answer = post(
        filled.client,
        "/models/train",
        {"dataset": DATASET, "models": "linear", "split": "repetitions"},
    )
    assert answer.status_code == 303 and answer.headers["location"].startswith("/jobs/")
    assert done(filled, answer)["words"] == "0 trained, 1 found as they were trained before"


def test_a_campaign_is_diagnosed_and_again_with_the_ticked_effects_and_the_same_options(
    filled: Lab,
) -> None:
    rows = filled.rows()
    job = done(
        filled,
        post(filled.client, "/diagnoses", {"campaign": GUN, "tolerances": "gun=2%", "seed": "1"}),
    )
    assert filled.added(rows) == {"diagnoses": 1}
    page = filled.client.get(job["address"])
    assert page.status_code == 200 and GUN in page.text
    with filled.store.reading() as session:
        assert session.get_one(Diagnosis, job["result"]["id"]).report["campaign"] == GUN
    first = job["result"]["id"]
    boxes = {
        "with_effects": ["gun.valve_flow", "gun.blow_by"],
        "without_effects": ["gun.blow_by"],
    }
    second = done(filled, post(filled.client, f"/diagnoses/{first}/what-if", boxes))["result"]["id"]
    with filled.store.reading() as session:
        before, after = kept_options(session, first), kept_options(session, second)
        report = kept_report(session, second)
    assert (before["tolerances"], before["seed"]) == ({"gun": 0.02}, 1)
    assert after == {**before, **boxes}
    assert "gun.barrel_loss" not in str(report["causes"])
    restricted = Page(filled.client.get(f"/diagnoses/{second}").text)
    ticked = sorted(
        (box["name"], box["value"]) for box in restricted.of("input") if "checked" in box
    )
    assert ticked == [
        ("with_effects", "gun.blow_by"),
        ("with_effects", "gun.valve_flow"),
        ("without_effects", "gun.blow_by"),
    ]
    assert (
        "The diagnosis considers only gun.valve_flow, gun.blow_by (--with), and no other effect."
        in restricted.text
    )


def test_page_of_a_diagnosis_shows_its_parts_plans_the_next_experiment_and_adopts(
    filled: Lab,
) -> None:
    key = keep(filled.store, verdicts.gun(campaign=GUN))
    page = Page(filled.client.get(f"/diagnoses/{key}").text)
    assert summary(verdicts.gun()) in page.text
    charts = {figure["id"]: figure["aria-label"] for figure in page.of("figure")}
    assert charts["waterfall"].startswith("The error in tolerances on configurations that the fit")
    assert charts["shares"].startswith("Shares of the squared error of all configurations")
    boxes = {box["value"] for box in page.of("input") if box.get("name") == "with_effects"}
    assert {"gun.valve_flow", "gun.dead_volume", "gun.barrel_loss", "sensor.velocity_gain"} <= boxes
    assert "plate.damping" not in boxes and page.of("option")[-1]["value"] == "none"
    for name in ("gun.valve_flow+gun.back_pressure+gun.blow_by", "gun.blow_by"):
        assert post(filled.client, f"/diagnoses/{key}/adopt", {"effect": name}).status_code == 303
    before = filled.rows()
    answer = post(filled.client, "/diagnoses/1/plan", {"name": "tell apart/1"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/plans/tell%20apart%2F1")
    added = filled.added(before)
    assert (added["plans"], added["planned_runs"]) == (1, 1)
    assert filled.client.get(answer.headers["location"]).status_code == 200
    again = post(filled.client, "/diagnoses/1/plan", {"name": "tell apart/1"})
    assert again.status_code == 422 and "in the store already" in again.text
    for effect in ("gun.valve_flow", "none"):
        before = filled.rows()
        answer = post(filled.client, "/diagnoses/1/adopt", {"effect": effect})
        assert (answer.status_code, answer.headers["location"]) == (
            303,
            f"/diagnoses?campaign={GUN}",
        )
        assert filled.added(before) == {"twin_configurations": 1}
        with filled.store.reading() as session:
            newest = session.scalars(
                select(TwinVersion).order_by(TwinVersion.version.desc())
            ).first()
        assert newest is not None and (effect in newest.reason or effect == "none")
    assert "adopted" in filled.client.get("/diagnoses").text


def test_settings_for_a_spectrum_are_searched(filled: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """The search itself has its own tests; here it finds two settings, and what it was asked is
    looked at."""
    from types import SimpleNamespace

    import numpy as np

    asked: list[Any] = []
    settings = {"tank_pressure_pa": 4e5, "bullet_mass_kg": 0.5, "tip_material": "steel",
    "tip_radius_m": 0.045,
                "anvil_material": "none", "insulator": "none", "impact_position": "#1"}  # fmt: skip
    row = {"settings": settings, "probability_within": 0.9, "probability_95_percent_within": 0.95,
           "worst_margin_db": -1.0, "worst_frequency_hz": 100.0, "outside_domain": [],
           "expected_m_s2": [300.0, 1e4],
           "lower_m_s2": [200.0, 8e3], "upper_m_s2": [400.0, 2e4],
           "alternatives": [settings | {"tip_material": "titanium"}]}  # fmt: skip

    def session_of(store: Any, db: str, target: Any, search: Any, twin: Any) -> Any:
        asked.append((search, twin))
        lines = np.array([100.0, 1e4])
        goal = SimpleNamespace(frequency_hz=lines, level_db=np.array([50.0, 80.0]),
        lower_db=np.array([6.0, 6.0]),
                               upper_db=np.array([6.0, 6.0]))  # fmt: skip
        likely = Attainability(0.9, 0.5, 1, 1, "every line lies within tolerance", None)
        choice = SimpleNamespace(proposal=row, as_json=dict)
        search_result = SimpleNamespace(
            proposals=[row], choices=[choice], avoid=[], attainability=likely
        )

        def run(step: Any) -> Any:
            step(1, 1, "found")
            return search_result

        return SimpleNamespace(goal=goal, notes=("a note",), run=run, answering=twin)

    monkeypatch.setattr("pyroshock.app.operations.tune.session.session_of", session_of)
    monkeypatch.setattr(
        "pyroshock.app.operations.tune.bench_adapter.proposal_json",
        lambda each, rank: {"rank": rank, **each},
    )
    before = filled.rows()
    sent = {"target.file": ("spec.csv", SPECIFICATION.encode(), "text/csv")}
    fields = {"tolerance": "3dB", "contact": "hertz", "at_least": "0.6", "share": "0.95"}
    job = done(filled, post(filled.client, "/tune", fields, files=sent))
    wanted, twin = asked[0]
    assert (twin.contact, wanted.at_least, wanted.share) == ("hertz", 0.6, 0.95)
    page = filled.client.get(job["address"])
    assert (
        page.status_code == 200
        and "/twin?contact=hertz&amp;specification=frequency_hz" in page.text
        and "&amp;tolerance=3dB&amp;tank_pressure_pa=400000.0" in page.text
    )
    likely = "has a probability of 90 % that every line lies within tolerance"
    sentence = f"One proposal meets the target: the setting {likely} (90 % interval 87 % to 92 %, "
    assert job["words"].startswith(sentence) and job["words"] in page.text
    assert (
        "The best setting is 4 bar, 0.5 kg, steel tip of 45 mm radius, no anvil, position #1."
        in page.text
    )
    assert (
        "At its worst line, 100 Hz, the expected level differs by" in page.text
        and "What to try next" in page.text
    )
    assert "4 bar, 0.5 kg, titanium tip of 45 mm radius, no anvil, position #1" in page.text
    assert filled.added(before) == {}


def test_the_twin_is_validated_by_a_job(filled: Lab) -> None:
    before = filled.rows()
    assert (
        f'href="/validations?campaign={HAMMER}"' in filled.client.get(f"/campaigns/{HAMMER}").text
    )
    job = done(
        filled, post(filled.client, "/validations", {"campaign": HAMMER, "contact": "hertz"})
    )
    assert job["address"] == f"/validations/{job['id']}"
    page = filled.client.get(job["address"])
    assert page.status_code == 200
    for words in (
        job["result"]["verdict"],
        "peak force",
        'id="coverage-data"',
        'id="ranks-data"',
        "comparison-1-data",
    ):
        assert words in page.text
    report = filled.client.get(f"{job['address']}/report.html")
    assert report.status_code == 200 and job["result"]["verdict"] in report.text
    pdf = filled.client.get(f"{job['address']}/report.pdf")
    assert pdf.content.startswith(b"%PDF-") and pdf.headers["content-type"] == "application/pdf"
    assert job["address"] in filled.client.get("/validations").text and filled.added(before) == {}
    job = ended(filled.client, post_json(filled.client, "/api/validate", {"campaign": GUN}))
    assert (job["state"], job["error"]) == ("done", None)
    assert [row["name"] for row in job["result"]["quantities"]] == ["velocity"]


def test_jobs_cut_pulses_anew_and_train_models_once(filled: Lab) -> None:
    address, before = f"/api/campaigns/{HAMMER}/extract", filled.rows()
    job = ended(filled.client, post_json(filled.client, address, {"threshold": 0.02}))
    assert (job["state"], job["address"], job["result"]["added"]) == (
        "done",
        f"/campaigns/{HAMMER}",
        20,
    )
    assert filled.added(before)["pulses"] == 20
    job = ended(filled.client, post_json(filled.client, address, {}))
    assert (job["result"]["added"], job["result"]["reused"]) == (0, 20)
    asked = {"dataset": DATASET, "models": "linear,hann", "split": "repetitions"}
    for trained in (1, 0):  # the store's linear one is found
        job = ended(filled.client, post_json(filled.client, "/api/train", asked))
        assert (job["state"], job["error"], job["address"]) == ("done", None, "/models")
        assert job["words"] == f"{trained} trained, {2 - trained} found as they were trained before"
        assert [(row["model"], row["version"]) for row in job["result"]] == [
            ("linear", 1),
            ("hann", 1),
        ]
