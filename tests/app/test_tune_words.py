"""A search for settings in words and on paper: the answer first, and the specification as it was
understood."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pyroshock.app.figures.figure import PointSeries
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.operation_kind import kind_of
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.impacts.spectra import target_from_upload
from pyroshock.app.operations.train.train import TRAIN, Training
from pyroshock.app.operations.tune.figures import choices_figure, target_figure
from pyroshock.app.operations.tune.request import Tuning
from pyroshock.app.operations.tune.target_words import target_sentence
from pyroshock.app.operations.tune.verdict import (
    answer_sentences,
    best_sentences,
    choice_sentences,
)
from pyroshock.app.operations.validate.request import ValidationRequest
from support.checks.drawn_series import named_series

SPECIFICATION = "frequency_hz,level_g\n100,30\n1000,300\n10000,300\n"


def answer(probability: float, meets: bool, **more: Any) -> dict[str, Any]:
    settings = {
        "tank_pressure_pa": 4e5, "bullet_mass_kg": 0.5, "tip_material": "steel",
        "tip_radius_m": 0.045,
        "anvil_material": "none", "insulator": "none", "impact_position": "#1",
    }  # fmt: skip
    best = {
        "settings": settings, "probability_within": probability, "worst_frequency_hz": None,
        "worst_margin_db": None,
    }  # fmt: skip
    attainability = {
        "meets": meets,
        "probability": probability,
        "at_least": 0.5,
        "sentence": "s",
        "lines": "every line lies within tolerance",
        "meeting": int(meets),
    }
    return {"attainability": attainability, "proposals": [best], "draws": 400, **more}


def first_sentence(data: dict[str, Any]) -> str:
    return str(answer_sentences(data)[0])


def test_answer_is_first_with_the_interval_of_its_probability() -> None:
    """Wilson's interval of 240 of 400 at 90 %: 0.559 to 0.639 (center 0.5993, half width
    0.0402)."""
    assert first_sentence(answer(0.6, True)) == (
        "One proposal meets the target: the setting has a probability of 60 % that every line lies "
        "within tolerance (90 % interval 56 % to 64 %, from 400 draws of the twin)."
    )
    missed = first_sentence(answer(0.2, False))
    assert missed.startswith(
        "No setting meets the target: the best has a probability of 20 % that every line lies "
        "within tolerance (90 % interval 17 % to 23 %"
    )
    assert missed.endswith("and at least 50 % is required.")
    nearly = first_sentence(answer(0.4975, False))
    assert "slightly less than the 50 % that are required" in nearly


def test_draws_do_not_tell_certainty() -> None:
    assert "a probability of < 1 % that every line" in first_sentence(answer(0.0, False))
    assert "a probability of > 99 % that every line" in first_sentence(answer(1.0, True))


def test_results_without_draws_or_settings_are_told_too() -> None:
    assert first_sentence(answer(0.6, True, draws=None)) == (
        "One proposal meets the target: the setting has a probability of 60 % that every line lies "
        "within tolerance."
    )
    assert first_sentence(answer(0.0, False, proposals=[])) == "No setting meets the target."
    assert answer_sentences({"proposals": []}) == []


def test_best_setting_promises_nothing() -> None:
    for data in (answer(0.2, False), answer(0.6, True)):
        assert [str(each) for each in best_sentences(data)] == [
            "The best setting is 4 bar, 0.5 kg, steel tip of 45 mm radius, no anvil, position #1."
        ]


def test_figures_are_those_of_the_setting_that_is_called_the_best() -> None:
    """The first of the ranking, whose probability is rounded alike, and not the largest of all."""
    data = answer(0.015, False)
    first, second = data["proposals"][0], dict(data["proposals"][0])
    data["proposals"] = [first | {"probability_met": 0.01}, second | {"probability_met": 0.015}]
    assert "a probability of 1 % that" in first_sentence(data)


def test_each_further_setting_says_what_it_is_better_at() -> None:
    data = answer(0.6, True)
    first = data["proposals"][0] | {"rank": 1, "better_at": []}
    first["merits"] = {"margin_db": 0.25, "band_db": 2.4, "scatter_db": None, "shots": 0,
                       "changes": 3}  # fmt: skip
    second = first | {"rank": 2, "better_at": ["margin", "repeatability", "measured", "effort"]}
    second["merits"] = {"margin_db": 0.5, "band_db": 2.4, "scatter_db": 0.4, "shots": 12,
                        "changes": 1}  # fmt: skip
    data["proposals"] = [first, second]
    (sentence_text,) = choice_sentences(data)
    assert str(sentence_text) == (
        "Setting 2 (4 bar, 0.5 kg, steel tip of 45 mm radius, no anvil, position #1) has a larger "
        "margin at its worst line (0.5 dB against 0.25 dB), shots that were repeated and scatter "
        "by 0.4 dB (standard deviation; the best setting was not repeated), more measured shots "
        "with its parts and bullet (12 against 0) and fewer parts or bullets to change from the "
        "set-up of the last shot (1 against 3)."
    )


def test_probabilities_are_drawn_with_their_intervals_and_what_is_required() -> None:
    """Wilson's interval of 240 of 400 at 90 %: 0.559 to 0.639."""
    data = answer(0.6, True)
    data["proposals"][0] |= {"rank": 1}
    figure = choices_figure(data)
    (points,) = figure.series
    assert isinstance(points, PointSeries)
    assert points.x_low is not None and points.x_high is not None
    assert [points.x[0], points.x_low[0], points.x_high[0]] == pytest.approx(
        [60.0, 55.9, 63.9], abs=0.1
    )
    assert [line.at for line in figure.reference_lines] == [50.0]
    assert figure.y.categories == ("1: 4 bar, 0.5 kg, steel 45 mm",)


def test_specification_lies_on_four_coordinate_paper() -> None:
    """300 g at 1 kHz is a pseudo-velocity of 300 * 9.80665 / (2 pi 1000) = 0.468 m/s; 6 dB are a
    factor of 2."""
    target = target_from_upload(SPECIFICATION, "s", "6dB")
    chart = target_figure(target)
    curves = named_series(chart)
    prescribed = curves["prescribed"]
    place = int(np.argmin(np.abs(prescribed.x - 1000)))
    assert prescribed.x[place] == pytest.approx(1000)
    assert prescribed.y[place] == pytest.approx(0.4682, rel=1e-3)
    assert curves["tolerance"].high[place] == pytest.approx(0.4682 * 10 ** (6 / 20), rel=1e-3)
    assert prescribed.labels[place] == "300 g"
    assert {"100 g", "1000 g", "100 µm"} <= {label.text for label in chart.labels}
    assert (chart.x.scale, chart.y.scale) == ("log", "log")
    assert target_sentence(target) == (
        "The specification reaches from 100 to 10000 Hz and from 30 to 300 "
        "g, with a tolerance of +6/−6 dB."
    )


def test_side_without_limit_is_said_and_reaches_the_edge() -> None:
    target = target_from_upload(
        "frequency_hz,level_g,upper_db,lower_db\n100,30,inf,6\n1000,300,inf,6\n", "s"
    )
    assert "no limit/−6 dB" in target_sentence(target)
    figure = target_figure(target)
    edge = named_series(figure)["tolerance"]
    assert edge.high.min() > figure.limits("y")[1]


def test_forms_of_failed_jobs_are_filled_with_their_values() -> None:
    asked = {
        "target": SPECIFICATION,
        "tolerance": "3dB",
        "measured": ("spring", "autumn"),
        "campaign": "first-shots",
        "share": 0.95,
    }
    form = KINDS["tune"].form(read(Tuning, asked, "network"))
    assert form is not None and (form.address, form.form) == ("/tune", "tune")
    assert form.fields["target"] == SPECIFICATION
    assert form.fields["measured"] == ["spring", "autumn"]
    assert (form.fields["campaign"], form.fields["tolerance"], form.fields["share"]) == (
        "first-shots",
        "3dB",
        "0.95",
    )
    form = kind_of(TRAIN).form(
        Training(dataset="a b", models="linear,gp", split="materials", seed=7, budget="full")
    )
    assert form is not None and (form.address, form.form) == ("/models/train", "train")
    assert form.fields == {
        "dataset": "a b", "models": ["linear", "gp"], "split": ["materials"], "seed": "7",
        "budget": "full",
    }  # fmt: skip
    asked = {"campaign": "first-shots", "contact": "gp@9"}
    form = KINDS["validate"].form(read(ValidationRequest, asked, "network"))
    assert form is not None and form.address == "/validations"
    assert form.fields == {"campaign": "first-shots", "contact": "gp@9"}
