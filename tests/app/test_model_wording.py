"""Sentences and charts of registered models: errors never negative, and the better one named with
its lead."""

from __future__ import annotations

import pytest
from pyroshock.app.figures.figure import BoxSeries, PointSeries
from pyroshock.app.operations.train.charts import (
    difference_figure,
    differences_to,
    history_figure,
    residual_figures,
    training_figures,
)
from pyroshock.app.operations.train.wording import (
    MODEL_SENTENCES,
    bounded,
    difference_sentence,
    is_warned_of,
    share,
    unseen,
    version_sentences,
)
from pyroshock.training.models.catalogue import MODEL_SPECS
from support.checks.drawn_series import series_of


def row_of(mean: float | None = 0.042, floor: float | None = None, **more: object) -> dict:
    metric = {
        "mean": mean,
        "ci90": None if mean is None else [-0.01, 0.08],
        "floor": {"configuration": floor},
    }
    return {
        "label": "gp@1",
        "version": 1,
        "split": "configurations",
        "dataset": "spring",
        "metrics": {"force_nrmse": metric, "contact_time_error": metric},
        "coverage90": None,
        **more,
    }


def pair(difference: float, p_value: float | None = 0.01, ci90: list[float] | None = None) -> dict:
    named = {
        "a": "gp@1",
        "b": "tree@1",
        "metric": "force_nrmse",
        "difference": difference,
        "p_value": p_value,
    }
    return {**named, "ci90": ci90}


def test_each_model_that_can_be_trained_has_a_sentence():
    assert list(MODEL_SENTENCES) == list(MODEL_SPECS)


def test_an_error_is_told_with_an_interval_that_is_never_negative():
    words = str(version_sentences(row_of())[0])
    assert words.startswith("gp@1 predicts the force within 4.2 % (0 % to 8 %)")
    assert words.endswith("on configurations that it has not seen.")
    assert bounded([-0.5, -0.1]) == [0, 0] and bounded(None) is None


def test_repeatability_of_the_bench_stands_beside_the_error():
    assert str(version_sentences(row_of(floor=0.041))[0]).endswith(
        "repeated impacts of the bench differ by 4.1 % in force."
    )
    assert "no force error" in str(version_sentences(row_of(None))[0])


@pytest.mark.parametrize(("more", "words"), [
    ({"mean": 2.02}, "is not usable: its force error on the split configurations is 202 %, above "
                     "100 %, the force itself."),
    ({"mean": 0.5, "floor": 0.04}, "is 50 %, above 40 %, ten times what repeated impacts differ "
                                   "by."),
    ({"coverage90": {"force_covered": 0.51}, "coverage90_ci90": {"force_covered": [0.4, 0.62]}},
     "bands are too narrow for the force points: they hold 51 % of them (40 % to 62 %)."),
])  # fmt: skip
def test_a_version_that_nobody_should_take_is_warned_of(more, words):
    row = row_of(**more)
    assert any(words in str(said) for said in version_sentences(row)) and is_warned_of(row)


def test_a_version_whose_bands_hold_is_not_warned_of():
    bands = {"force_covered": 0.88}
    row = row_of(coverage90=bands, coverage90_ci90={"force_covered": [0.82, 0.93]})
    assert "agrees with what they promise" in str(version_sentences(row)[1])
    assert not is_warned_of(row)


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.04153, "4.2 %"), (2.144, "214 %"), (0, "0 %"), (-0.0039, "−0.39 %")],
)
def test_shares_are_per_cent(value, text):
    assert share(value) == text


def test_a_split_by_value_says_what_was_held_out():
    assert unseen("material=steel") == "pulses of the material steel, none of which it has seen"
    assert "odd" in unseen("odd")


def test_the_better_version_is_named_only_beyond_chance():
    means = {"gp@1": 0.044, "tree@1": 0.05}
    said = difference_sentence(pair(-0.006, ci90=[-0.0095, -0.0025]), means, "configurations")
    assert said.text == (
        "gp@1 is better than tree@1 in the force error on configurations that they have not seen: "
        "4.4 % against 5 %; the difference of the errors is 0.6 % points (90 % interval "
        "0.25 % points to 0.95 % points); p is 0.01."
    )
    said = difference_sentence(pair(0.006, 0.3), {"gp@1": 0.05, "tree@1": 0.044})
    assert "tree@1 and gp@1 cannot be told apart" in said.text
    assert said.text.endswith("0.6 % points, which may be chance; p is 0.3.")
    assert "have the same force error" in difference_sentence(pair(0.0), means).text


def test_differences_have_the_sign_of_the_other_version_minus_the_reference():
    (row,) = differences_to("gp@1", [pair(-0.006, ci90=[-0.0095, -0.0025])], "force_nrmse")
    assert (
        row["label"] == "tree@1" and row["difference"] == 0.006 and row["ci90"] == [0.0025, 0.0095]
    )
    (same,) = differences_to("tree@1", [pair(-0.006, 0.3)], "force_nrmse")
    assert (same["label"], same["difference"], same["beyond_chance"]) == ("gp@1", -0.006, False)
    figure = difference_figure([row], "gp@1", "force_nrmse")
    (points,) = series_of(figure)
    assert points.x == pytest.approx([0.6]) and points.x_high == pytest.approx([0.95])
    assert figure.x.heading == "difference to gp@1 (% points)"
    assert figure.y.categories == ("tree@1",)


def test_a_history_needs_two_versions_and_two_steps():
    rows = [row_of(), row_of(0.03, label="gp@2", version=2)]
    assert history_figure(rows[:1]) is None
    figure = history_figure(rows)
    _, points = series_of(figure)
    assert figure.x.categories == ("gp@1", "gp@2") and points.y == pytest.approx([4.2, 3.0])
    assert points.y_low.min() >= 0
    histories = {
        "force.loss": [(0, 2.0), (1, 1.0)],
        "time.loss": [(0, 1.0)],
        "time.search_error": [(0, 1.0), (1, 2.0)],
    }
    (sentence,) = training_figures(histories)
    assert sentence == "Learning curve of the contact force: loss after each step of the training"


def test_a_level_of_few_pulses_is_shown_as_pulses_and_not_as_a_box():
    """Quartiles of one pulse are that pulse, drawn as if more were known."""
    labels = ["steel"] * 6 + ["PLA"]
    columns = {
        "peak_force_error": [0.1 * place for place in range(7)],
        "factors": {"tip_material": labels},
        "tip_material": labels,
        "impact_velocity_m_s": [1.0 + place for place in range(7)],
    }
    box, pulses = residual_figures(columns)["by the levels of the factors"].series
    assert isinstance(box, BoxSeries) and isinstance(pulses, PointSeries)
    assert box.position.tolist() == [0.0] and len(box.samples[0]) == 6
    assert pulses.x.tolist() == [1.0] and pulses.y.tolist() == pytest.approx([60.0])
