"""Pages as they are rendered: each number of a sentence stands in a table or a chart of the same
page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import given, settings
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.validate.verdict import needed_values
from support.records import verdicts
from support.records.random_answers import searches, validations
from support.stores.web_stores import GUN, Lab

pytestmark = pytest.mark.timeout(600)
#: A number as people read it: with thousands and decimals, and without its sign.
_NUMBER = re.compile(r"(?<![\w.#@-])\d[\d,]*(?:\.\d+)?")
_TABLE_ELEMENTS = ("table", "figure", "svg", "ol", "dl", "dt", "dd")


class SentencePage(HTMLParser):
    """The words of the elements of some ids, and of everything that is laid out as data."""

    def __init__(self, text: str, ids: tuple[str, ...]) -> None:
        super().__init__()
        self._ids = ids
        self._open: list[tuple[str, bool, bool]] = []
        self.sentences: list[str] = []
        self.data: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        if tag in ("meta", "link", "input", "br", "img", "meter", "hr"):
            return
        says, is_data = self._open[-1][1:] if self._open else (False, False)
        if attributes.get("id") in self._ids:
            says = True
            self.sentences.append("")
        is_figure = tag == "script" and attributes.get("type") == "application/json"
        self._open.append((tag, says, is_data or tag in _TABLE_ELEMENTS or is_figure))
        if is_data or tag == "svg":
            self.data.append(attributes.get("aria-label") or "")

    def handle_endtag(self, tag: str) -> None:
        tags = [name for name, _, _ in self._open]
        if tag in tags:  # what was left open within it ends with it
            del self._open[len(tags) - 1 - tags[::-1].index(tag) :]

    def handle_data(self, data: str) -> None:
        if not self._open:
            return
        _, says, is_data = self._open[-1]
        if says:
            self.sentences[-1] += data
        elif is_data:
            self.data.append(unescape(data))


def unsupported(text: str, ids: tuple[str, ...], constants: tuple[str, ...]) -> dict[str, str]:
    """Number -> the sentence that says it, of numbers that stand nowhere else on the page."""
    page = SentencePage(text, ids)
    assert page.sentences, f"no element has an id of {ids}"
    shown = set(_numbers(" ".join(page.data))) | set(constants)
    return {
        number: " ".join(sentence.split())
        for sentence in page.sentences
        for number in _numbers(sentence)
        if number not in shown
    }


def _numbers(text: str) -> Iterator[str]:
    return (match.replace(",", "") for match in _NUMBER.findall(text))


def page_of_answer(lab: Lab, module: str, address: str, data: dict[str, Any]) -> str:
    """The page of a job that has this answer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"pyroshock.app.pages.{module}.finished_result", lambda *_: data)
        patch.setattr("pyroshock.app.web.jobs.Jobs.form_of", lambda *_: (None, False))
        page = lab.client.get(f"/{address}/1")
    assert page.status_code == 200, page.text
    return page.text


@settings(max_examples=40, deadline=None)
@given(searches())
def test_a_search_of_settings(filled: Lab, data: dict[str, Any]) -> None:
    level = data["prescribed_m_s2"]
    kept = {"twin": {}, "notes": [], "lower_m_s2": level, "upper_m_s2": level, **data}
    kept["proposals"] = [
        {"outside_domain": []}
        | dict.fromkeys(("lower_m_s2", "upper_m_s2"), row["expected_m_s2"])
        | row
        for row in data["proposals"]
    ]
    text = page_of_answer(filled, "tune", "tune", kept)
    ids = ("attainability", "verdict", "next") if data["proposals"] else ("attainability",)
    assert unsupported(text, ids, ("90",)) == {}


@settings(max_examples=40, deadline=None)
@given(validations())
def test_a_validation(filled: Lab, data: dict[str, Any]) -> None:
    nothing: dict[str, Any] = {
        "notes": [],
        "left_out": [],
        "failures": [],
        "shots": [],
        "lines": {},
    }
    rows = [
        {**row, "coverage50_ci95": [0.0, 1.0], "pit_histogram": [0.1] * 10, "quantity_unit": ""}
        for row in data["quantities"]
    ]
    kept = {"campaign": GUN, "seen": "nothing", **nothing, **data, "quantities": rows}
    text = page_of_answer(filled, "validate", "validations", kept)
    needed = str(needed_values(len(data["quantities"])))  # of the rule, not of the answer
    assert unsupported(text, ("verdict",), (needed,)) == {}


@pytest.mark.parametrize("name", ["verdict", "gun", "unknown", "none"])
def test_a_diagnosis(filled: Lab, name: str) -> None:
    key = keep(filled.store, getattr(verdicts, name)())
    text = filled.client.get(f"/diagnoses/{key}").text
    assert unsupported(text, ("sentence",), ()) == {}


@pytest.mark.parametrize("query", ["version=tree@1&version=linear@1"])
def test_a_comparison_of_models(filled: Lab, query: str) -> None:
    text = filled.client.get(f"/models/compare?{query}").text
    assert unsupported(text, ("sentences",), ()) == {}


@pytest.mark.parametrize("label", ["tree", "linear"])
def test_a_model(filled: Lab, label: str) -> None:
    text = filled.client.get(f"/models/{label}/1").text
    assert unsupported(text, ("sentence",), ()) == {}


def test_a_number_that_stands_nowhere_is_noticed() -> None:
    table = "<table><tr><td>1,200 N</td></tr></table>"
    page = f'<p id="says">The peak is 1,200 N, 7 % of it noise.</p>{table}'
    assert unsupported(page, ("says",), ()) == {"7": "The peak is 1,200 N, 7 % of it noise."}
