"""In a browser: the page of a diagnosis is seen on few screens; ticked effects show the error that
the library computed with them, a point names its run, and every number that is said is shown."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.stored import kept_verdict
from pyroshock.diagnosis.diagnose import Options, diagnose
from pyroshock.diagnosis.verdict import Verdict
from pyroshock.schema.impacts import Impact
from pyroshock.twin.effects import Effect, effect
from sqlalchemy import select
from support.processes.browsers import Lab, at, drawn, page_of, screenshot, served, until
from support.records import verdicts
from support.records.campaigns import gun_campaign, hammer_campaign
from support.records.gun_campaigns import gun_record
from support.stores.stores import ingested, opened

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

SCREEN = {"width": 1400, "height": 900}
#: Diagnoses of the store: those that the library makes of a gun whose valve throttles and of one
#: that is as the model has it; made-up ones with runs that have impacts, without any cause, with an
#: unknown one, with effects that cannot be told apart, and of an earlier version.
MADE, WITH_IMPACTS, NONE, UNKNOWN, GROUP, EARLIER, AGREES = range(1, 8)
ALL = (MADE, WITH_IMPACTS, NONE, UNKNOWN, GROUP, EARLIER, AGREES)
_EFFECTS = "gun.valve_flow", "gun.back_pressure", "sensor.velocity_gain"


def made_diagnosis(*effects: Effect) -> Verdict:
    record = gun_record(effects)
    options = Options(catalogue=_EFFECTS, explore=True)
    return diagnose(replace(record, name="spring"), options=options)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("diagnoses")
    db = f"sqlite:///{folder}/lab.db"
    ingested(db, gun_campaign(folder / "spring", 2, "spring"))
    ingested(db, hammer_campaign(folder / "blows", 6, 2, "blows"))
    with opened(db) as store:
        for verdict in (
            made_diagnosis(effect("gun.valve_flow", loss_coefficient=8.0)),
            verdicts.explored(campaign="blows"),
            verdicts.none(),
            verdicts.unknown(),
            verdicts.verdict(),
            verdicts.gun(),
            made_diagnosis(),
        ):
            keep(store, verdict)
    with served(db, folder) as window:
        yield window


_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
#: Words of the bars that their drawing cuts off.
_OUTSIDE = """[...document.querySelectorAll(':is(#waterfall, #shares) svg.drawing text')]
  .filter(t => { const b = t.getBoundingClientRect(), s = t.closest('svg').getBoundingClientRect();
    return b.left < s.left - 1 || b.right > s.right + 1 || b.top < s.top - 1; })
  .map(t => t.textContent)"""


def bar_ends(page: Any) -> dict[str, float]:
    """The level that each bar of the waterfall leads to, as it is drawn."""
    return {
        own["detail"]: own["base"][0] if own["detail"].startswith("+") else own["end"][0]
        for own in drawn(page, "waterfall")
        if own["kind"] == "bars"
    }


@pytest.mark.parametrize("key", ALL)
def test_page_has_at_most_three_screens_and_its_pictures_on_the_first_two(browser, lab, key):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{key}")
        assert page.evaluate("document.documentElement.scrollHeight") <= 3 * SCREEN["height"]
        first = page.locator("#screen-gap")
        if first.count():
            box = first.bounding_box()
            assert box["y"] + box["height"] <= SCREEN["height"]
        if key in (MADE, WITH_IMPACTS):
            box = page.locator("#screen-look").bounding_box()
            assert box["y"] + box["height"] <= 2.5 * SCREEN["height"]


@pytest.mark.parametrize("key", ALL)
@pytest.mark.parametrize("width", [390, 1400])
def test_page_does_not_scroll_sideways_and_its_words_stay_in_their_figures(
    browser, lab, key, width
):
    with page_of(browser, lab, width=width) as page:
        at(page, f"/diagnoses/{key}")
        for opened_ in (False, True):
            if opened_:
                page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
            until(lambda: not page.evaluate(_SCROLLS), 10)
            assert not page.evaluate(_SCROLLS)
        assert page.evaluate(_OUTSIDE) == []


def test_ticked_effects_show_the_error_that_the_library_computed(browser, lab):
    with lab.reading() as session:
        verdict = kept_verdict(session, MADE)
    tolerance, computed = verdict.gap.tolerance, verdict.what_if
    assert computed is not None
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{MADE}")
        for names in (
            {"gun.back_pressure"},
            {"gun.back_pressure", "sensor.velocity_gain"},
            set(_EFFECTS),
            set(),
            {"gun.valve_flow"},
        ):
            for name in page.locator("#what-if input[name=with_effects]").all():
                name.set_checked(name.input_value() in names)
            own = computed.find(frozenset(names))
            error_after = own.after / tolerance if own is not None else None
            wait_for_level(page, error_after)
            ends = bar_ends(page)
            assert ends["nominal model"] == pytest.approx(verdict.gap.before / tolerance, rel=1e-5)
            assert ends.get("what remains") == (
                error_after and pytest.approx(error_after, rel=1e-5)
            )
            points = next(
                own for own in drawn(page, "residuals") if own["name"] == "with the effects"
            )
            if own is None:
                assert set(points["y"]) == {None} and not names
            else:
                assert [value is None for value in points["y"]] == [
                    value != value for value in own.residuals[0]
                ]
                shown = [value for value in points["y"] if value is not None]
                low, high = drawn_limits(page)
                assert low <= min(shown) <= max(shown) <= high
        assert "effect=gun.valve_flow" in page.url
        page.reload()
        assert page.is_checked("#what-if input[value='gun.valve_flow']")
        assert page.locator("#what-if input[name=with_effects]:checked").count() == 1


def wait_for_level(page: Any, level: float | None) -> None:
    """Until the last bar of the waterfall is at this level, as the server's answer has it."""
    until(lambda: bar_ends(page).get("what remains") == pytest.approx(level), 10)


def drawn_limits(page: Any) -> list[float]:
    return list(page.evaluate("document.querySelector('#residuals .plot').chart.figure.y.limits"))


def test_combination_that_was_not_computed_is_said_and_leaves_the_pictures(browser, lab):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{WITH_IMPACTS}")
        ends = bar_ends(page)
        page.uncheck("#what-if input[value='gun.back_pressure']")
        assert "was not computed" in page.inner_text("#combination")
        assert bar_ends(page) == ends
        page.click("#back-to-path")
        until(lambda: page.inner_text("#combination") == "", 10)
        assert page.inner_text("#combination") == "" and bar_ends(page) == ends


def test_pointer_names_the_run_and_a_click_leads_to_its_impact(browser, lab):
    with lab.reading() as session:
        query = select(Impact.id).where(Impact.run == 3, Impact.repetition == 2)
        impact = session.scalars(query).one()
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{WITH_IMPACTS}")
        page.select_option("#family", label="muzzle velocity (gun)")
        page.locator("#residuals").scroll_into_view_if_needed()
        place = page.evaluate(
            """() => { const { chart } = document.querySelector('#residuals .plot'),
              own = chart.shown().find(s => s.name === 'nominal model'), i = 5,
              box = chart.canvas.getBoundingClientRect();
              return [box.left + chart.sx.at(own.x[i]), box.top + chart.sy.at(own.y[i])]; }"""
        )
        page.mouse.move(*place)
        tip = page.inner_text("#residuals .chart-tip")
        assert "run 3.2, configuration 3" in tip and f"impact {impact}" in tip
        assert "aluminum, 0.3 bar" in tip
        page.mouse.click(*place)
        assert "run 3.2" in page.inner_text("#point")
        page.focus("#residuals .canvas")
        for key in ("ArrowRight", "ArrowRight", "Enter"):
            page.keyboard.press(key)
        assert "run 1.2" in page.inner_text("#point")
        page.mouse.click(*place)
        page.click("#point-impact")
        page.wait_for_url(f"**/impacts/{impact}")


def test_another_family_is_shown_when_it_is_chosen(browser, lab):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{WITH_IMPACTS}")
        page.select_option("#family", label="pressure trace (gun, rms of 4)")
        series = drawn(page, "residuals")
        assert series[1]["y"][0] == pytest.approx(10.0)


#: A number with its sign of per cent.
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:\s?%)?")
#: Numbers that are part of a name or of the method.
_STATED = re.compile(r"90 % interval\w*|ISO 7626-5|pulse width at \d+ % of the peak")


def numbers_in(text: str) -> set[str]:
    plain = _STATED.sub("", text.replace("\u00a0", " "))
    plain = re.sub(r"--\w+ \S+", "", plain)  # of a command
    return {match.replace(" ", "") for match in _NUMBER.findall(plain)}


@pytest.mark.parametrize("key", ALL)
def test_each_number_of_the_sentences_stands_in_a_table_or_in_a_figure(browser, lab, key):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{key}")
        page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
        numbers: set[str] = set()
        for text in page.locator("#sentence, #sentences li, #next-steps li, #next-runs li").all():
            numbers |= numbers_in(text.inner_text())
        shown: set[str] = set()
        for cell in page.locator("table td, table th").all_inner_texts():
            shown |= numbers_in(cell)
        for data in page.locator("script[type='application/json']").all_text_contents():
            shown |= figure_numbers(json.loads(data)) if data.strip() else set()
        assert numbers and numbers <= shown, numbers - shown
        assert "123.45" not in shown


def figure_numbers(value: Any) -> set[str]:
    """Numbers of a figure's bars and points, with the digits of a sentence; of shares per cent."""
    if isinstance(value, dict):
        own = {text for part in value.values() for text in figure_numbers(part)}
        return own | numbers_in(value["text"]) if "text" in value else own
    if isinstance(value, list):
        return {text for part in value for text in figure_numbers(part)}
    return {f"{value:.3g}"} if isinstance(value, float) else set()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("key", ALL)
def test_everybody_can_read_the_page(browser, lab, key, scheme):
    from axe_playwright_python.sync_playwright import Axe

    rules = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa"]}}
    with page_of(browser, lab, **SCREEN, color_scheme=scheme) as page:
        at(page, f"/diagnoses/{key}")
        violations = Axe().run(page, options=rules)
        assert violations.violations_count == 0, violations.generate_report()


def test_the_list_draws_the_errors_of_each_bench_over_time(browser, lab):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, "/diagnoses")
        names = {own["name"] for own in drawn(page, "over-time")}
        assert any(name.startswith("gun, bore 49 mm") for name in names)
        assert any(name.startswith("hammer, 0.32 kg") for name in names)


def test_paper_has_the_figures_and_no_form(browser, lab):
    with page_of(browser, lab, **SCREEN) as page:
        at(page, f"/diagnoses/{MADE}")
        screenshot(page, "diagnosis", 1650)
        page.emulate_media(media="print")
        assert page.locator("#waterfall .drawing").is_visible()
        assert not page.locator("#what-if").is_visible()
