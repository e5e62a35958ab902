"""In a browser: models side by side, and one promoted or refused with its reason."""

from __future__ import annotations

import pytest
from pyroshock.app.common.model_registry import registry_of
from support.processes.browsers import Lab, asked, at, drawn, page_of, screenshot
from support.stores.stores import run_pyroshock

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def in_use(lab: Lab) -> list[str]:
    return [each.label for each in registry_of(lab.db).versions() if each.champion_of]


def test_two_models_are_compared_on_pulses_in_common(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models")
        for label in ("linear@1", "hann@1"):
            page.check(f"[aria-label^='Compare {label}, split ']")
        screenshot(page, "models", 900)
        page.click("#compare-chosen")
        page.wait_for_selector("#side-by-side")
        heads = page.locator("#side-by-side thead a").all_inner_texts()
        assert sorted(heads) == ["hann@1", "linear@1"]
        found = {each["label"]: each for each in asked(page, "/api/models")}
        assert page.locator("#side-by-side tbody tr").count() == len(found["linear@1"]["metrics"])
        assert page.locator("#differences tbody tr").count() == len(found["linear@1"]["metrics"])
        best = min(heads, key=lambda label: found[label]["metrics"]["force_nrmse"]["mean"])
        assert page.locator("#sentences li").first.inner_text().endswith("was trained.")
        on_force = page.locator("#sentences li:has-text('in the force error on')").first
        assert on_force.inner_text().startswith(f"{best} ")
        (trace,) = drawn(page, "differences-1")
        (place,) = trace["y"]
        categories = "document.querySelector('#differences-1 .plot').chart.figure.y.categories"
        other = page.evaluate(categories)[place]
        means = {label: found[label]["metrics"]["force_nrmse"]["mean"] for label in heads}
        (difference,) = trace["x"]
        assert difference == pytest.approx(100 * (means[other] - means[best]), rel=1e-4)


def test_versions_are_picked_where_none_or_an_unknown_one_is_named(browser, lab):
    with page_of(browser, lab) as page:
        assert at(page, "/models/compare?version=linear@1").status == 422
        assert "choose two or more" in page.inner_text("#picker-error")
        assert page.is_checked("#picker input[value^='linear@1 ']")
        page.check("#picker input[value^='hann@1 ']")
        page.click("#compare-chosen")
        page.wait_for_selector("#sentences")
        page.locator("#promote-1 input[name=reason]").fill(" ")
        page.click("#promote-1 button")
        page.wait_for_selector("#promote-1 .field-error")
        assert (
            "reason is missing" in page.inner_text("#promote-1 .field-error")
            and "/models/compare" in page.url
        )


def test_a_dataset_is_built_and_a_training_started_after_wrong_inputs(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/datasets")
        page.fill("#name", "from the page")
        page.click("#build button")
        page.wait_for_selector("#build .field-error")
        assert page.inner_text("#build .field-error").startswith(
            "campaigns is missing; expected at least one value"
        )
        assert page.input_value("#name") == "from the page"
        page.check("#build input[value=rehearsal]")
        page.click("#build button")
        page.wait_for_selector("#existing")  # the same pulses are frozen as guns
        page.click("#to-train")
        page.wait_for_selector("#train")
        assert page.input_value("#dataset") == "guns"
        page.click("#train button:has-text('Start')")
        page.wait_for_selector("#train .field-error")
        assert page.inner_text("#train .field-error").startswith(
            "models is missing; expected at least one value"
        )
        page.check("#model-linear")
        page.select_option("#split", "configurations")
        page.click("#train button:has-text('Start')")
        page.wait_for_url("**/jobs/*")


def test_wrong_inputs_of_a_training_stand_at_their_fields(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models/train?dataset=guns")
        page.check("#model-hann")
        page.select_option("#split", "campaigns")
        page.click("#train button:has-text('Start')")
        page.wait_for_selector("#split-error")
        assert page.is_checked("#model-hann") and page.input_value("#split") == "campaigns"
        page.fill("#seed", "7")
        page.select_option("#split", "configurations")
        page.uncheck("#model-hann")
        page.click("#train button:has-text('Start')")
        page.wait_for_selector("#train .field-error:has-text('models is missing')")
        assert page.input_value("#seed") == "7" and page.input_value("#split") == "configurations"


def test_a_dataset_without_name_is_refused_and_the_ticks_stay(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/datasets")
        page.check("#build input[value=rehearsal]")
        page.click("#build button")
        page.wait_for_selector("#name-error")
        assert "name is missing" in page.inner_text("#name-error")
        assert page.is_checked("#build input[value=rehearsal]")


def test_a_promotion_without_reason_stays_on_the_form(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models/hann/1")
        page.check("#promote input[name=force]")
        page.click("#promote button")
        page.wait_for_selector("#reason-error")
        assert "reason is missing" in page.inner_text("#reason-error") and page.is_checked(
            "#promote input[name=force]"
        )


def test_a_dataset_in_use_is_refused_and_a_spare_one_deleted(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/datasets/guns")
        page.click("#delete")
        page.wait_for_selector("#refusal")
        assert page.locator("#refusal a").all_inner_texts() and page.locator("#delete").count() == 0
        at(page, "/datasets")
        page.fill("#name", "spare")
        page.check("#build input[value=rehearsal]")
        page.click("summary:has-text('More options')")
        page.select_option("#velocity", "integrated")
        page.click("#build button")
        page.wait_for_selector("#to-train")
        page.click("#delete")
        page.wait_for_selector("#kept")
        assert "The pulses, with their impacts" in page.inner_text("#kept")
        page.click("#delete button")
        page.wait_for_url("**/datasets")
        assert "spare" not in page.locator("#datasets").inner_text()


def test_trials_of_a_search_are_drawn_beside_the_importance_of_their_settings(browser, lab):
    """The search of kernel ridge regression has 30 trials of two settings."""
    run_pyroshock(
        "train", "guns", "--models", "kernel-ridge", "--split", "configurations", "--db", lab.db
    )
    with page_of(browser, lab) as page:
        at(page, "/models/kernel-ridge/1")
        page.click("#training-details > summary")
        lines = drawn(page, "search-1")
        assert lines[-1]["name"] == "best trial"
        assert sum(trace["x"].count(None) for trace in lines) == 30
        assert (
            "the grid search tried 30 combinations"
            in page.locator(".search-sentence").first.inner_text()
        )
        page.locator("summary:has-text('All 30 trials')").first.click()
        assert page.locator("#trials-1 tbody tr").count() == 30
        at(page, "/models/kernel-ridge/1/delete")
        page.click("#delete button")
        page.wait_for_url("**/models")
        assert "kernel-ridge@1" not in page.locator("#models").inner_text()


@pytest.mark.parametrize("address", [
    "/models", "/models/linear/1", "/models/compare?version=linear@1&version=hann@1",
    "/models/train", "/datasets", "/datasets/guns", "/datasets/guns/delete",
    "/models/hann/1/delete", "/tune",
])  # fmt: skip
def test_pages_of_models_fit_a_telephone(browser, lab, address):
    with page_of(browser, lab, width=390, height=844) as page:
        at(page, address)
        assert page.evaluate(
            "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        )


def test_promotions_are_refused_or_forced_with_their_reasons(browser, lab):
    """Models of one campaign's few shots are worse than the contact law that they update, and so
    refused."""
    costs = {each.label: each.metrics["cost"].mean for each in registry_of(lab.db).versions()}
    better, worse = sorted(costs, key=costs.__getitem__)
    assert in_use(lab) == []
    with page_of(browser, lab) as page:
        at(page, f"/models/{better.replace('@', '/')}")
        page.fill("#reason", "the best of the <b>rehearsal</b>")
        page.press("#reason", "Enter")
        page.wait_for_selector("#decision")
        refused = page.inner_text("#decision")
        law = "without a model the contact law updated by the measured shots"
        assert refused.startswith(
            f"Refused: {law} predicts unseen configurations better than {better}"
        )
        assert in_use(lab) == []
        at(page, f"/models/{better.replace('@', '/')}")
        page.fill("#reason", "the best of the <b>rehearsal</b>")
        page.check("#promote input[name=force]")
        page.click("#promote button")
        page.wait_for_selector("#decision")
        assert (
            page.inner_text("#decision").startswith("Promoted")
            and page.locator("#in-use").count() == 1
        )
        assert in_use(lab) == [better]
        at(page, f"/models/{worse.replace('@', '/')}")
        page.fill("#reason", "for a try")
        page.click("#promote button")
        page.wait_for_selector("#decision")
        assert page.inner_text("#decision").startswith("Refused") and in_use(lab) == [better]
        at(page, "/models")
        kept = page.locator("#promotions tbody tr").all_inner_texts()
    told = [
        (each.candidate, each.promoted, each.reason) for each in registry_of(lab.db).decisions()
    ]
    assert [each[:2] for each in told] == [
        (worse, False),
        (better, True),
        (better, False),
    ]  # the newest first
    assert (
        "the best of the <b>rehearsal</b>" in told[1][2]
        and "the best of the <b>rehearsal</b>" in kept[-1]
    )
    assert "refused" in kept[0] and "for a try" in kept[0]


def test_predicted_lies_over_measured_with_the_coverage(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models/linear/1")
        page.click("#against > summary")
        shown = [trace for trace in drawn(page, "against-1") if trace["kind"] == "points"]
        pulses = int(page.inner_text("#against-1 figcaption").split(" held-out")[0].split()[-1])
        assert sum(len(trace["x"]) for trace in shown) == pulses > 0
        assert {"force", "contact time"} <= {trace["name"] for trace in drawn(page, "coverage")}
