"""In a browser: a diagnosis is run and read, its experiment planned, its effect adopted; reports
are one file each."""

from __future__ import annotations

import re

import pytest
from pyroshock.app.operations.diagnose.stored import kept_report
from pyroshock.doe.plans import read_plan
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from sqlalchemy import func, select
from support.processes.browsers import Lab, asked, at, ended, page_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

#: The one that the store begins with: with every part filled (tests/verdicts.py).
KEPT = 1


def count(lab: Lab, table: type) -> int:
    with lab.reading() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


def test_diagnosis_is_run_and_kept(browser, lab):
    before = count(lab, Diagnosis)
    with page_of(browser, lab) as page:
        at(page, "/diagnoses")
        page.select_option("#campaign", "first-shots")
        page.click("#diagnose button")
        job = ended(page, 300)
        assert (job["state"], job["error"]) == ("done", None) and count(
            lab, Diagnosis
        ) == before + 1
        page.click("#job-result")
        key = int(page.url.rsplit("/", 1)[1])
        with lab.reading() as session:
            report = kept_report(session, key)
        assert report["campaign"] == "first-shots" and report["causes"]
        assert asked(page, f"/api/diagnoses/{key}")["causes"] == report["causes"]
        assert report["causes"][0]["effects"][0].split("+")[0] in page.inner_text("main")
        at(page, "/diagnoses?campaign=first-shots")
        assert page.locator("#diagnoses tbody tr").count() == before + 1


def test_page_shows_stages_causes_residuals_and_shrinkage(browser, lab):
    with page_of(browser, lab) as page:
        at(page, f"/diagnoses/{KEPT}")
        page.evaluate("document.querySelectorAll('details').forEach(own => own.open = true)")
        text = page.inner_text("main").lower()
        for word in (
            "what to do next",
            "stage",
            "contact.layer_compliance",
            "93 %",
            "peak force",
            "configuration",
        ):
            assert word in text, word
        assert page.locator("#records .plot svg.drawing").count() == 3


def test_ticked_effects_are_diagnosed_alone(browser, lab):
    with page_of(browser, lab) as page:
        at(page, f"/diagnoses/{KEPT}")
        page.click("#other-effects summary")
        page.check('#what-if input[name="with_effects"][value="gun.valve_flow"]')
        page.focus("#what-if button:not([type=button])")
        page.keyboard.press("Enter")
        job = ended(page, 300)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        assert "considers only gun.valve_flow (--with)" in page.inner_text("#restriction")
        assert page.is_checked('#what-if input[name="with_effects"][value="gun.valve_flow"]')
        assert page.locator("#what-if input:checked").count() == 1


def test_button_plans_the_next_experiment(browser, lab):
    with lab.reading() as session:
        wanted = kept_report(session, KEPT)["next_runs"]
    with page_of(browser, lab) as page:
        at(page, f"/diagnoses/{KEPT}")
        page.fill("#plan-name", "apart")
        page.press("#plan-name", "Enter")
        page.wait_for_url("**/plans/apart")
        assert page.locator("#runs tbody tr").count() == len(wanted)
    with lab.reading() as session:
        made = read_plan(session, "apart")
    assert [run.repetitions for run in made.runs] == [each["runs_needed"] for each in wanted]


def test_adopted_effect_is_a_version_of_the_twin(browser, lab):
    before = count(lab, TwinVersion)
    with page_of(browser, lab) as page:
        at(page, f"/diagnoses/{KEPT}")
        effect = page.input_value("#effect")
        page.click("#adopt button")
        page.wait_for_url("**/diagnoses?campaign=*")
        assert effect in page.locator("#diagnoses tbody tr").last.inner_text()
    assert count(lab, TwinVersion) == before + 1
    with lab.reading() as session:
        newest = session.scalars(select(TwinVersion).order_by(TwinVersion.version.desc())).first()
        assert [adopted["id"] for adopted in newest.configuration["effects"]] == [
            effect
        ] and newest.diagnosis_id == KEPT


@pytest.mark.parametrize(
    "of", ["campaign/rehearsal", "campaign/first-shots", f"diagnosis/{KEPT}", "model/linear/1"]
)
def test_reports_are_one_file_each(browser, lab, of):
    with page_of(browser, lab) as page:
        assert at(page, f"/reports/{of}.html").status == 200
        html = page.request.get(f"/reports/{of}.html").text()
        assert (
            re.findall(
                r"""(?:src|href)\s*=\s*["'](?!#|data:)[^"']*|@import|url\((?!["']?(?:data:|#))[^)]*""",
                html,
            )
            == []
        )
        assert page.evaluate(
            "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        )
        page.set_viewport_size({"width": 390, "height": 844})
        wide = (
            "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth "
            "> e.clientWidth).length"
        )
        assert page.evaluate(wide) == 0, "the main columns of a table are wider than a telephone"
        for table in page.locator(".fold").all():
            assert not table.locator("th.extra").first.is_visible()
            table.get_by_label("Show all columns of this table").check()
            assert table.locator("th.extra").first.is_visible()
        pdf = page.request.get(f"/reports/{of}.pdf")
        assert pdf.headers["content-type"] == "application/pdf"
        assert pdf.body().startswith(b"%PDF") and pdf.body().rstrip().endswith(b"%%EOF")
