"""In a browser: each number of a sentence stands in a table or a picture of the same page.

A number is found where a table, a fact or the legend of a picture has the same text, or where a
table or a picture has a number that is rounded to it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from support.processes.browsers import at, ended, page_of, wait_drawn
from support.stores.stores import run_pyroshock

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

SPECIFICATION = "frequency_hz,level_g\n100,30\n1000,1000\n10000,1000\n"
#: A number as people read it; not within a word or a name such as gp@1 or #1.
NUMBER = re.compile(r"(?<![\w.#@])\d[\d,]*(?:\.\d+)?(?![\w]*@)(?!\w)")
#: Elements whose text is laid out as data, each by itself: also within what is folded away.
DATA = "td, th, caption, dd, figure .legend .entry, figcaption"
#: The first twin of a bench solves its plate.
PATIENCE_MS = 300_000


def numbers_of(text: str) -> list[str]:
    return [number_text.replace(",", "") for number_text in NUMBER.findall(text)]


def numbers_in(data: Any) -> Iterator[float]:
    """All numbers of the data of a figure, those in its texts, too."""
    if isinstance(data, bool) or data is None:
        return
    if isinstance(data, int | float):
        yield float(data)
    elif isinstance(data, str):
        yield from map(float, numbers_of(data))
    elif isinstance(data, dict):
        for part in data.values():
            yield from numbers_in(part)
    else:
        for part in data:
            yield from numbers_in(part)


def rounds_to(shown: str, value: float) -> bool:
    """Whether a number is shown as this text: with as many decimals, or as many digits."""
    decimals = len(shown.partition(".")[2])
    if f"{abs(value):.{decimals}f}" == shown:
        return True
    digits = len(shown.replace(".", "").lstrip("0")) or 1
    return float(f"{abs(value):.{digits}g}") == float(shown)


def unfounded(page: Any, sentences: str) -> dict[str, str]:
    """Number -> the sentence that says it, of the numbers that stand nowhere else on the page."""
    sentence_texts = [text for text in page.locator(sentences).all_text_contents() if text.strip()]
    assert sentence_texts, f"no sentence at {sentences}"
    tables = " ".join(page.locator(DATA).all_text_contents())
    pictures = page.locator("script[type='application/json']").all_text_contents()
    values = {float(number) for number in numbers_of(tables)}
    for picture in pictures:
        if picture.strip():
            values |= set(numbers_in(json.loads(picture)))
    texts = set(numbers_of(tables))
    return {
        number: " ".join(sentence.split())
        for sentence in sentence_texts
        for number in numbers_of(sentence)
        if number not in texts and not any(rounds_to(number, value) for value in values)
    }


def test_a_number_that_stands_nowhere_is_noticed(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models/linear/1")
        page.evaluate("document.getElementById('sentence').append('Its error is 12345.678 %.')")
        assert list(unfounded(page, "#sentence")) == ["12345.678"]


def test_numbers_of_a_model_stand_in_its_tables(browser, lab):
    run_pyroshock(
        "models", "learning-curve", "linear@1", "--split", "configurations", "--db", lab.db
    )
    with page_of(browser, lab) as page:
        at(page, "/models/linear/1")
        assert page.locator("#curve-sentence").count() == 1
        assert unfounded(page, "#sentence, #strength-sentence, #curve-sentence") == {}


def test_numbers_of_a_comparison_stand_in_its_tables(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/models/compare?version=linear@1&version=hann@1")
        assert unfounded(page, "#sentences li") == {}


#: Beside a twin: what it rests on, what was measured at its setting, and where it is beyond that.
TWIN = "#warnings li, #measured-here, #velocity-basis, #rests-on, #specification-sentence"


@pytest.mark.parametrize("query", [
    "campaign=rehearsal",
    "campaign=rehearsal&tank_pressure_pa=700000&bullet_mass_kg=1.2",
    "campaign=first-shots",
])  # fmt: skip
def test_numbers_of_the_twin_stand_in_its_tables(browser, lab, query):
    with page_of(browser, lab) as page:
        page.set_default_timeout(PATIENCE_MS)
        at(page, f"/twin?{query}")
        assert unfounded(page, TWIN) == {}


def test_numbers_of_a_validation_stand_on_its_page_and_beside_the_twin(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/validations?campaign=rehearsal")
        page.fill("#validate [name=draws]", "20")
        page.fill("#validate [name=folds]", "2")
        page.click("#validate button")
        job = ended(page, 900)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        wait_drawn(page)
        assert unfounded(page, "#verdict, #failures li, p#failures, #adopted li") == {}
        page.set_default_timeout(PATIENCE_MS)
        at(page, "/twin?campaign=rehearsal")
        page.evaluate("document.getElementById('validated-numbers').open = true")
        words = page.locator("#validated").evaluate(
            "(note) => [...note.childNodes].filter((node) => node.nodeName !== 'DETAILS')"
            ".map((node) => node.textContent).join(' ')"
        )
        page.evaluate(
            "(words) => { const line = document.createElement('p'); line.id = 'validated-words';"
            " line.textContent = words; document.querySelector('main').append(line); }",
            words,
        )
        assert unfounded(page, "#validated-words") == {}


def test_numbers_of_a_search_stand_in_its_tables(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/tune?campaign=rehearsal&measured=rehearsal")
        page.fill("#target", SPECIFICATION)
        page.click("#begin-search")
        job = ended(page, 900)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        wait_drawn(page)
        assert unfounded(page, "#attainability, #verdict, #reasons li, #next li") == {}


@pytest.mark.parametrize(("address", "sentences"), [
    ("/", "#attention li"),
    ("/campaigns/rehearsal", "#counts, #quality-words"),
    ("/campaigns/first-shots", "#counts"),
    ("/plans/rehearsal", "#verdict strong, #counts"),
    ("/datasets/guns", "#sentence"),
    ("/explore?colour=tip_material", "#sentences li"),
    ("/explore?kind=control&y=peak_force_n", "#sentences li"),
    ("/explore?kind=levels&x=tip_radius_m&y=peak_force_n", "#sentences li"),
    ("/explore?kind=distribution&x=peak_force_n", "#sentences li"),
])  # fmt: skip
def test_numbers_of_a_page_of_the_store_stand_in_its_tables(browser, lab, address, sentences):
    with page_of(browser, lab) as page:
        at(page, address)
        assert unfounded(page, sentences) == {}
