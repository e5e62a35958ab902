"""Trials of a search on parallel axes, and which setting mattered: of scores whose law is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.app.figures.figure import BarSeries, LineSeries
from pyroshock.app.operations.train.charts import importance_figure, search_figure, searches_figure
from pyroshock.app.operations.train.searches import (
    importance_sentence,
    parallel_axes,
    quarters_of,
    search_sentence,
    trial_rows,
)
from pyroshock.training.tuning.importance import (
    importance_of,
    registered_searches,
    with_importance,
)
from pyroshock.training.tuning.trials import SettingsSearch, Trial, search_from

GAMMAS, KERNELS = (0.001, 0.01, 0.1, 1.0), ("rbf", "matern52", "<b>")


def law(gamma: float, kernel: str, ard: bool) -> float:
    """Gamma matters much, the kernel little, ard not at all."""
    return math.exp(1.5 * abs(math.log10(gamma) + 2) + 0.1 * KERNELS.index(kernel) + 0.0 * ard)


def grid() -> SettingsSearch:
    trials = tuple(
        Trial({"gamma": gamma, "kernel": kernel, "ard": ard}, law(gamma, kernel, ard), 0.5)
        for gamma in GAMMAS
        for kernel in KERNELS
        for ard in (True, False)
    )
    return SettingsSearch("grid search", "error", trials, ("gamma",))


def test_axes_are_logarithmic_where_the_search_is_and_words_where_settings_are() -> None:
    gamma, kernel, ard, score = parallel_axes(grid())
    assert gamma.title == "gamma of the kernel, log scale"
    assert [place for place, _ in gamma.ticks] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert [word for _, word in gamma.ticks] == ["0.001", "0.01", "0.1", "1"]
    assert [word for _, word in kernel.ticks] == ["<b>", "matern52", "rbf"]
    assert [word for _, word in ard.ticks] == ["no", "yes"]
    assert score.title == "score (low is good), log scale"
    assert min(score.places) == 0 and max(score.places) == 1
    assert len(score.places) == len(grid().trials)


def test_setting_that_not_every_trial_has_leaves_a_gap() -> None:
    search = SettingsSearch(
        "search", "error", (Trial({"a": 1, "b": 5.0}, 1.0), Trial({"a": 2}, 2.0))
    )
    first, second, _ = parallel_axes(search)
    assert first.places == (0.0, 1.0) and second.places == (0.5, None)


def test_quarters_follow_the_score() -> None:
    quarters, scores = quarters_of(grid()), [trial.score for trial in grid().trials]
    assert sorted(quarters) == sorted([0, 1, 2, 3] * 6)
    worst_of = [
        max(score for score, quarter in zip(scores, quarters, strict=True) if quarter == q)
        for q in range(4)
    ]
    assert worst_of == sorted(worst_of)


def test_importance_finds_the_setting_that_matters() -> None:
    importance = importance_of(grid())
    assert importance is not None
    assert next(iter(importance.shares)) == "gamma" and importance.shares["gamma"] > 0.8
    assert importance.shares["ard"] < 0.05
    assert sum(importance.shares.values()) == pytest.approx(1)
    assert 0.5 < importance.explained <= 1
    sentence = importance_sentence(with_importance(grid()))
    assert (
        "gamma of the kernel" in sentence
        and "random forest" in sentence
        and "24 trials" in sentence
    )


def test_importance_of_few_trials_or_of_noise_cannot_be_judged() -> None:
    few = SettingsSearch("grid search", "error", grid().trials[::3], ("gamma",))
    assert importance_of(few) is None
    assert "cannot be judged: there are 8 trials of 3 settings" in importance_sentence(few)
    rng = np.random.default_rng(4)
    noise = SettingsSearch(
        "search",
        "error",
        tuple(
            Trial({"a": float(a), "b": float(b)}, float(s)) for a, b, s in 1 + rng.random((40, 3))
        ),
    )
    assert importance_of(noise) is None
    assert "does not predict" in importance_sentence(noise)
    single = SettingsSearch(
        "grid search", "error", tuple(Trial({"components": n}, 1.0 + n) for n in range(1, 20))
    )
    assert importance_of(single) is None
    assert "Only one setting was searched (components)" in importance_sentence(single)


def test_importance_reads_back_and_is_computed_where_older_software_registered_none(
    monkeypatch,
) -> None:
    judged = with_importance(grid())
    assert judged.importance == importance_of(grid()) is not None
    document = {"force": judged.as_json()}
    older = {name: value for name, value in document["force"].items() if name != "importance"}
    assert registered_searches({"force": older})["force"].importance == judged.importance
    monkeypatch.setattr("pyroshock.training.tuning.importance.importance_of", None)
    assert registered_searches(document)["force"].importance == judged.importance


def test_search_is_told_with_its_best_settings() -> None:
    sentence = search_sentence("force", grid())
    assert "For the contact force, the grid search tried 24 combinations" in sentence
    assert "gamma of the kernel: 0.01; kernel: rbf" in sentence
    first = trial_rows(grid())[0]
    assert (
        first["score"] == min(trial.score for trial in grid().trials) and first["duration_s"] == 0.5
    )
    assert search_from(grid().as_json()) == grid()


def test_charts_have_a_line_for_each_trial_and_a_bar_for_each_setting() -> None:
    chart = search_figure(grid())
    lines = [own for own in chart.series if isinstance(own, LineSeries)]
    assert sum(int(np.isnan(own.x).sum()) for own in lines) == len(grid().trials)
    assert chart.series[-1].name == "best trial"
    assert "<b>" in {label.text for label in chart.labels}
    importance = importance_of(grid())
    assert importance is not None
    (bars,) = importance_figure(importance).series
    assert isinstance(bars, BarSeries) and bars.end.sum() == pytest.approx(100)


def test_searches_stand_below_each_other_with_the_importance_where_it_is_known() -> None:
    few = SettingsSearch("grid search", "error", grid().trials[:4])
    figure = searches_figure({"force": with_importance(grid()), "time": few})
    assert [[plot is not None for plot in row] for row in figure.rows] == [
        [True, True],
        [True, False],
    ]
    assert any("tried 24 combinations" in note for note in figure.notes)
