"""The answer to a search in sentences: the best setting first, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import binomtest

from ...common.number_format import format_number, percent
from ...common.quantities import cell, display_of

#: What can be done about an obstacle, by its kind (`twin.tune.attainability.Kind`).
_REMEDIES = {
    "bench limit": "Check whether the limit of the bench can be changed, or whether the "
    "specification allows a wider tolerance at this line.",
    "model domain": "Measure shots outside of the range of the contact model and train the model "
    "again, so that the search may propose such settings.",
    "measured shots": "Fire the best setting, ingest the shot, and search again with its campaign "
    "in the field “Learn from the shots of”.",
    "level": "Add bullets, tips or anvils that change the level to the factors of the "
    "laboratory, and search again.",
    "shape": "Try another plate or another sensor position, or ask whether the specification "
    "allows a wider tolerance at the worst line.",
    "tolerance": "The scatter from shot to shot is larger than the tolerance. Ask for a wider "
    "tolerance, or for a share of the lines below 1.",
}


def setting_words(settings: Mapping[str, Any]) -> str:
    """`1.3 bar, 0.4 kg, steel tip of 45 mm radius, no anvil, position #1`."""
    numbers = [
        f"{cell(key, settings[key])} {display_of(key).unit}"
        for key in ("tank_pressure_pa", "bullet_mass_kg")
        if settings.get(key) is not None
    ]
    radius = f"{cell('tip_radius_m', settings['tip_radius_m'])} {display_of('tip_radius_m').unit}"
    tip = f"{settings['tip_material']} tip of {radius} radius"
    anvil = (
        "no anvil"
        if settings["anvil_material"] == "none"
        else f"{settings['anvil_material']} anvil"
    )
    if settings["insulator"] != "none":
        anvil = f"{anvil}, {settings['insulator']} insulator"
    return ", ".join((*numbers, tip, anvil, f"position {settings['impact_position']}"))


def answer_sentence(data: Mapping[str, Any]) -> str:
    """Whether the target is met, with the probability and its 90 % interval (`tune_job`'s result).

    The interval is Wilson's of the draws of the twin; results of older software do not say how many
    there were. Empty for a result without an answer.
    """
    attainability = data.get("attainability")
    if not attainability:
        return ""
    if not data["proposals"]:
        return "The target is not met: this bench can fire no setting for it."
    probability, draws = attainability["probability"], data.get("draws")
    interval = ""
    if draws:
        low, high = binomtest(round(probability * draws), draws).proportion_ci(0.9, method="wilson")
        interval = (
            f" (90 % interval {100 * low:.0f} to {100 * high:.0f} %, from {draws} "
            f"draws of the twin)"
        )
    stated = f"a probability of {_likely(probability)}{interval}"
    if attainability["meets"]:
        return f"The target is met with {stated}."
    required = f"{percent(attainability['at_least'])} is required"
    return f"The target is not met: the best setting has {stated}, and {required}."


def _likely(probability: float) -> str:
    """Draws do not tell certainty: none of some hundred is not never."""
    if probability < 0.005:
        return "less than 1 %"
    return "more than 99 %" if probability > 0.995 else percent(probability)


def verdict_text(data: Mapping[str, Any]) -> str:
    """The best setting with its probability and its worst line (`tune_job`'s result); empty without
    a proposal."""
    if not data["proposals"]:
        return ""
    best = data["proposals"][0]
    attainability = data.get("attainability")
    if attainability and not attainability["meets"]:
        text = f"The best setting is {setting_words(best['settings'])}."
    else:
        text = (
            f"With {setting_words(best['settings'])}, every line of the spectrum lies within "
            f"tolerance with a probability of {_likely(best['probability_within'])}."
        )
    met = best.get("probability_met", best["probability_within"])
    if round(met, 2) != round(best["probability_within"], 2):
        text = f"{text} The whole rule of the target is met with a probability of {_likely(met)}."
    worst = best["worst_frequency_hz"]
    if worst is None or best["worst_margin_db"] is None:
        return text
    place = int(np.argmin(np.abs(np.asarray(data["frequency_hz"]) - worst)))
    error_db = 20 * float(np.log10(best["expected_m_s2"][place] / data["prescribed_m_s2"][place]))
    side = "low" if error_db < 0 else "high"
    margin = best["worst_margin_db"]
    where = "within" if margin >= 0 else "outside of"
    return (
        f"{text} The worst line is {format_number(worst)} Hz: the expected "
        f"level is {format_number(abs(error_db), 2)} "
        f"dB too {side}, {format_number(abs(margin), 2)} dB {where} the tolerance."
    )


def next_steps(data: Mapping[str, Any]) -> list[str]:
    """What a laboratory does after the search."""
    attainability = data.get("attainability") or {}
    obstacle = attainability.get("obstacle") or {}
    steps = [_REMEDIES[obstacle["kind"]]] if obstacle.get("kind") in _REMEDIES else []
    if data["proposals"]:
        steps.append(
            "Open the best setting in the twin, and compare it with the "
            "nearest measured shots before it is fired."
        )
        if not steps[0].startswith("Fire"):
            steps.append(
                "After the shot, ingest its recording and search again with "
                "its campaign in the field “Learn from the "
                "shots of”: the next proposal is then corrected by what was measured."
            )
    return steps
