"""Sentences about models, of random figures: each claim is allowed by its rule, claims do not
contradict each other, and each number stands in a table of the same answer."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.common.quantities import cell
from pyroshock.app.operations.operation import ResultTable
from pyroshock.app.operations.sentence import (
    BETTER,
    HOLDS,
    NOT_TOLD_APART,
    REACHES,
    TOO_NARROW,
    TOO_WIDE,
    WITHIN,
    Sentence,
)
from pyroshock.app.operations.train.wording import (
    comparison_sentences,
    comparison_tables,
    exceeded_limit,
    is_warned_of,
    promotable,
    version_sentences,
    version_tables,
)
from pyroshock.training.evaluation.metrics import METRICS

#: Levels of methods, which sentences name without resting on them.
LEVELS = ("90 %",)
LABELS = ("gp@1", "tree@12", "hann@3")
SPLITS = ("repetitions", "configurations", "treatments", "material=steel")

errors = st.floats(1e-6, 50.0)
shares = st.floats(0.0, 1.0)
chances = st.floats(0.0, 1.0)


def intervals(ends: st.SearchStrategy[float]) -> st.SearchStrategy[list[float] | None]:
    return st.none() | st.tuples(ends, ends).map(sorted)


@st.composite
def versions(draw: st.DrawFn) -> dict[str, Any]:
    """A row of `figures.version_row`."""
    metrics = {
        name: {
            "mean": draw(st.none() | errors) if name == "contact_time_error" else draw(errors),
            "ci90": draw(intervals(st.floats(-1.0, 50.0))),
            "floor": {scope: draw(st.none() | errors) for scope in ("configuration", "treatment")},
        }
        for name in METRICS
    }
    covered = draw(st.sets(st.sampled_from(["force_covered", "time_covered"])))
    return {
        "label": draw(st.sampled_from(LABELS)),
        "split": draw(st.sampled_from(SPLITS)),
        "metrics": metrics,
        "coverage90": {name: draw(shares) for name in sorted(covered)} or None,
        "coverage90_ci90": {name: draw(intervals(shares)) for name in sorted(covered)},
        "force_nrmse_of_mean": draw(st.none() | errors),
    }


@st.composite
def comparisons(draw: st.DrawFn) -> dict[str, Any]:
    """What `figures.side_by_side` gives."""
    labels = LABELS[: draw(st.integers(2, 3))]
    split = draw(st.sampled_from(SPLITS))
    champion = draw(st.none() | st.sampled_from(labels))
    models: list[dict[str, Any]] = []
    for label in labels:
        exceeded = draw(st.none() | st.tuples(errors, errors).map(sorted))
        limit = exceeded and {
            "limit": exceeded[0],
            "error": exceeded[1],
            "rule": draw(st.sampled_from(["worse than the mean", "far above repeatability"])),
        }
        means = {metric: draw(errors) for metric in METRICS}
        model = {"label": label, "split": split, "metrics": means, "exceeded_limit": limit}
        models.append(model | ({"champion_of": "gun"} if label == champion else {}))
    models.sort(key=lambda model: model["metrics"]["force_nrmse"])
    comparison: dict[str, Any] = {"pulses": draw(st.integers(1, 9000)), "models": models}
    comparison["differences"] = [
        draw(differences(first, second, metric))
        for metric in METRICS
        for place, first in enumerate(models)
        for second in models[place + 1 :]
    ]
    comparison["promotable"] = promotable(comparison, "force_nrmse")
    return comparison


@st.composite
def differences(
    draw: st.DrawFn, first: dict[str, Any], second: dict[str, Any], metric: str
) -> dict[str, Any]:
    difference = first["metrics"][metric] - second["metrics"][metric]
    pair = {"a": first["label"], "b": second["label"], "metric": metric}
    groups = [
        {
            **pair,
            "difference": draw(errors) * draw(st.sampled_from([-1, 1])),
            "ci90": None,
            "p_value": draw(st.floats(0.0, 0.049)),
            "group": {"tip_material": level},
        }
        for level in sorted(draw(st.sets(st.sampled_from(["steel", "delrin"]))))
    ]
    ends = draw(intervals(st.floats(0.0, 5.0)))
    return {
        **pair,
        "difference": difference,
        "ci90": ends and [difference - ends[0], difference + ends[1]],
        "p_value": draw(st.none() | chances),
        "least_p_value": draw(chances),
        "configurations": draw(st.integers(1, 400)),
        "where": groups,
    }


def cells_of(tables: Sequence[ResultTable]) -> set[str]:
    """All cells, as a door writes them."""
    return {
        cell(key, value) for table in tables for row in table.rows for key, value in row.items()
    }


def assert_numbers_stand_in(tables: Sequence[ResultTable], sentences: Sequence[Sentence]) -> None:
    cells = cells_of(tables)
    for said in sentences:
        shown = [str(number) for number in said.numbers if str(number) in said.text]
        for text in shown:
            assert text in cells, (said.text, text, cells)
        left = said.text
        for word in sorted((*LEVELS, *LABELS, *shown), key=len, reverse=True):
            left = left.replace(word, "")
        assert not re.search(r"\d", left), (said.text, left)


@settings(max_examples=60, deadline=None)
@given(versions())
def test_what_is_said_of_a_version_follows_from_its_figures(row: dict[str, Any]) -> None:
    sentences = version_sentences(row)
    assert_numbers_stand_in(version_tables(row), sentences)
    rules = [said.rule for said in sentences]
    assert (REACHES in rules) == (exceeded_limit(row) is not None) != (WITHIN in rules)
    error, texts = row["metrics"]["force_nrmse"]["mean"], " ".join(map(str, sentences))
    assert "not usable" in texts or error <= 1, "an error above the force is no prediction"
    assert is_warned_of(row) == (REACHES in rules or TOO_NARROW in rules)
    for said in sentences[1:]:
        if said.rule is not None:
            low, high = said.evidence["interval"]
            kinds = {TOO_NARROW: high < 0.9, TOO_WIDE: low > 0.9, HOLDS: low <= 0.9 <= high}
            assert kinds[said.rule] and sum(kinds.values()) == 1


@settings(max_examples=60, deadline=None)
@given(comparisons())
def test_what_is_said_of_a_comparison_follows_from_its_figures(comparison: dict[str, Any]) -> None:
    sentences = list(comparison_sentences(comparison, METRICS))
    assert_numbers_stand_in(comparison_tables(comparison, METRICS), sentences)
    unequal = [row for row in comparison["differences"] if row["difference"] != 0]
    beyond_chance = [row for row in unequal if row["p_value"] is not None and row["p_value"] < 0.05]
    said_better = [said for said in sentences if said.rule is BETTER and "(by " not in said.text]
    assert len(said_better) == len(beyond_chance)
    told_apart = len(unequal) - len(beyond_chance)
    assert sum(said.rule is NOT_TOLD_APART for said in sentences) == told_apart
    for row, said in zip(beyond_chance, said_better, strict=True):
        better = row["a"] if row["difference"] < 0 else row["b"]
        assert said.text.startswith(f"{better} is better than ")
    texts, label = [said.text for said in sentences], comparison["promotable"]
    assert (f"{label} can be put in use." in texts) == (label is not None)
    if label is not None:
        assert not any(text.startswith(f"{label} is not usable") for text in texts)
        assert not any("None of them is shown to be better" in text for text in texts)
