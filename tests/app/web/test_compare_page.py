"""The page that compares versions of models: rows of several splits, and two versions pulse by
pulse."""

from __future__ import annotations

import json
import re
from html import unescape

import pytest
from pyroshock.app.common.model_registry import context_of, registry_of
from pyroshock.training.fitting.session import train
from support.stores.registries import without_figures
from support.stores.web_stores import DATASET, Lab

pytestmark = pytest.mark.timeout(300)
REPETITIONS = ("linear@1 repetitions", "tree@1 repetitions")
CONFIGURATIONS = ("linear@1 configurations", "tree@1 configurations")


@pytest.fixture(scope="module")
def two_splits(filled: Lab) -> Lab:
    """The same two models, judged on configurations, too; and the mean of the pulses' worst enemy,
    a law that learns nothing."""
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        registry = registry_of(filled.db)
        context = context_of(filled.store, DATASET, registry, 0, "reduced")
        train(registry, context, ["linear", "tree"], ["configurations"])
    return filled


def compared(lab: Lab, *rows: str) -> str:
    answer = lab.client.get("/models/compare", params={"version": list(rows)})
    assert answer.status_code == 200, answer.text
    return answer.text


def ticked(page: str) -> set[str]:
    return set(re.findall(r'value="([^"]*)" checked', page))


def test_rows_of_several_splits_are_compared_by_split(two_splits: Lab) -> None:
    """Every row of the list that is ticked gave an error page."""
    page = compared(two_splits, *REPETITIONS, *CONFIGURATIONS)
    assert "held-out pulses of the split configurations" in page
    assert ticked(page) == {*REPETITIONS, *CONFIGURATIONS}
    other_split = re.search(r'id="other-split-1">.*?href="([^"]*)"', page, re.DOTALL)
    assert other_split is not None
    page = two_splits.client.get(unescape(other_split[1])).text
    assert "held-out pulses of the split repetitions" in page and ticked(page) == {*REPETITIONS}


def test_a_single_row_of_another_split_is_said_to_stay_out(two_splits: Lab) -> None:
    page = compared(two_splits, *REPETITIONS, CONFIGURATIONS[0])
    assert "held-out pulses of the split repetitions" in page
    note = page.partition('id="other-split-1">')[2].partition("</p>")[0]
    assert "linear@1 (split configurations of pulses)" in note and "href" not in note


def test_two_versions_stand_pulse_by_pulse_with_their_configurations(two_splits: Lab) -> None:
    page = compared(two_splits, *CONFIGURATIONS)
    data = re.search(r'id="paired-data">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    pulses, *verdicts = json.loads(data[1])["series"]
    rows = page.partition('id="configurations"')[2].partition("</table>")[0].count("<tr>") - 1
    assert sum(len(own["x"]) for own in verdicts) == rows > 0
    counts = re.search(r"on (\d+) of (\d+) pulses", page)
    assert counts is not None and int(counts[2]) == len(pulses["x"])
    assert int(counts[1]) == sum(value < 0 for value in pulses["y"])
    assert page.index('id="paired"') < page.index('id="sentences"')  # see first, read second


def test_a_difference_is_in_percentage_points(two_splits: Lab) -> None:
    """ "Better by 96 % (54 to 141 %)" would be more than the whole error."""
    page = compared(two_splits, *CONFIGURATIONS)
    assert re.search(r"the difference of the errors is [\d.]+ % points", page)
    assert not re.search(r"the difference of the errors is [\d.]+ %[^ ]", page)


def test_the_cost_says_what_it_counts(two_splits: Lab) -> None:
    page = compared(two_splits, *CONFIGURATIONS)
    assert "cost, elements per thousand that miss the pulse" in page
    listed = two_splits.client.get("/models").text
    assert not re.search(r">cost\b", listed) and not re.search(r">cost</", page)
