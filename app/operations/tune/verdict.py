"""The answer to a search in sentences and tables, of what its job keeps (`TunedSettings.job_data`):
whether the target is met, the best setting, and what to do next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np

from ...common.number_format import join_words, percent
from ..operation import ResultTable
from ..sentence import (
    FALLS_SHORT,
    NOT_ENOUGH,
    REACHES,
    Number,
    Sentence,
    first_allowed,
    sentence,
)

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
    "tolerance": "Ask for a wider tolerance, or for a share of the lines below 1.",
}
#: Column of a merit in the table, whose cells the sentences say.
_MERIT_COLUMNS = {
    "margin_db": "smallest_margin_db",
    "band_db": "band_half_width_db",
    "scatter_db": "repeat_scatter_db",
    "shots": "shots with these parts",
    "changes": "changes of the set-up",
}
#: What a setting is better at -> its merit, its kind of number, the words after "has", and what
#: stands for the number of the best setting where that has none.
_REASONS: dict[str, tuple[str, Literal["quantity", "count"], str, str]] = {
    "margin": (
        "margin_db",
        "quantity",
        "a larger margin at its worst line ({value}{against})",
        "",
    ),
    "certainty": (
        "band_db",
        "quantity",
        "a narrower 90 % band (half of it is {value}{against})",
        "",
    ),
    "repeatability": (
        "scatter_db",
        "quantity",
        "shots that were repeated and scatter by {value} (standard deviation{against})",
        "; the best setting was not repeated",
    ),
    "measured": (
        "shots",
        "count",
        "more measured shots with its parts and bullet ({value}{against})",
        "",
    ),
    "effort": (
        "changes",
        "count",
        "fewer parts or bullets to change from the set-up of the last shot ({value}{against})",
        "",
    ),
}
_EVERY_LINE = "every line of the next shot lies within tolerance"


def drawn_share(probability: float) -> float:
    """A probability of draws as it is shown: none of some hundred draws is not never."""
    return min(max(probability, 0.001), 0.999)


def _probability(value: float) -> Number:
    return Number("probability", drawn_share(value), "share")


def best_proposal(data: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The setting that all sentences are about: the first that meets the target, else the first."""
    proposals: list[Mapping[str, Any]] = data["proposals"]
    meeting = (row for row in proposals if met_probability(row, data) >= required_probability(data))
    return next(meeting, proposals[0] if proposals else None)


def met_probability(row: Mapping[str, Any], data: Mapping[str, Any]) -> float:
    """The probability that a setting meets the whole rule. Results of older software have that of
    the best alone, or none."""
    if "probability_met" in row:
        return float(row["probability_met"])
    return float((data.get("attainability") or row).get("probability", row["probability_within"]))


def required_probability(data: Mapping[str, Any]) -> float:
    return float((data.get("attainability") or {}).get("at_least", 0.5))


def met_interval(probability: float, draws: int) -> tuple[float, float]:
    """Wilson's 90 % interval of a share of draws."""
    from scipy.stats import binomtest

    low, high = binomtest(round(probability * draws), draws).proportion_ci(0.9, method="wilson")
    return float(low), float(high)


def _interval(probability: float, draws: int) -> tuple[Number, Number]:
    low, high = met_interval(probability, draws)
    return _probability(low), _probability(high)


def answer_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """Whether the target is met, with the probability and its 90 % interval, and what stands in the
    way where it is not. None for a result of older software without an answer."""
    attainability = data.get("attainability")
    if not attainability:
        return []
    best = best_proposal(data)
    if best is None:
        refused: Mapping[str, Any] = {"count": 0, "needed": 1}
        answer = sentence("No setting meets the target.", NOT_ENOUGH, refused)
        return [answer, *_obstacle_sentence(attainability, answer)]
    met, required, draws = (
        met_probability(best, data),
        required_probability(data),
        data.get("draws"),
    )
    count = max(
        sum(met_probability(row, data) >= required for row in data["proposals"]),
        attainability.get("meeting", 0),
    )
    shown: dict[str, Number | str] = {
        "met": _probability(met),
        "required": Number("required", required, "share"),
        "count": Number("count", count, "count"),
        "lines": attainability.get("lines", _EVERY_LINE),
        "interval": "",
    }
    interval = ""
    if draws:
        shown["low"], shown["high"] = _interval(met, draws)
        shown["draws"] = Number("draws", draws, "count")
        interval = " (90 % interval {low} to {high}, from {draws} draws of the twin)"
    likely = f"has a probability of {{met}} that {{lines}}{interval}"
    meets = f"{{count}} proposals meet the target: the best {likely}."
    if count == 1:
        meets = f"One proposal meets the target: the setting {likely}."
    misses = (
        f"No setting meets the target: the best {likely}, and at least {{required}} is required."
    )
    if str(shown["met"]) == str(shown["required"]):
        misses = (
            "No setting meets the target: the best has a probability of slightly less than the "
            f"{{required}} that are required, that {{lines}}{interval}."
        )
    template = meets if met >= required else misses
    shown = {name: value for name, value in shown.items() if f"{{{name}}}" in template}
    evidence = {"value": met, "limit": required}
    answer = first_allowed(evidence, (REACHES, meets), (FALLS_SHORT, misses), **shown)
    return [answer, *_obstacle_sentence(attainability, answer)]


def _obstacle_sentence(attainability: Mapping[str, Any], answer: Sentence) -> Iterator[Sentence]:
    """What stands in the way, in the words of the search, where the answer is that none meets."""
    obstacle = attainability.get("obstacle")
    if obstacle and answer.rule is not REACHES:
        yield Sentence(obstacle["sentence"], (), answer.rule, answer.evidence)


def best_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """The best setting, how likely all its lines are within, and its worst line."""
    best = best_proposal(data)
    if best is None:
        return []
    words, numbers = setting_words(best["settings"])
    sentences = [Sentence(f"The best setting is {words}.", numbers)]
    within = _probability(best["probability_within"])
    if str(within) != str(_probability(met_probability(best, data))):
        sentences.append(
            sentence(
                "Every line lies within tolerance with a probability of {within}.", within=within
            )
        )
    if (error := _worst_error_db(best, data)) is None:
        return sentences
    margin = float(best["worst_margin_db"])
    line = (
        "At its worst line, {line}, the expected level differs by {error} from the prescribed one; "
        "the margin to the edge is {margin}: "
    )
    return [
        *sentences,
        first_allowed(
            {"value": margin, "limit": 0.0},
            (REACHES, f"{line}within the tolerance."),
            (FALLS_SHORT, f"{line}outside of the tolerance."),
            line=Number("at_hz", best["worst_frequency_hz"]),
            error=Number("level_error_db", error),
            margin=Number("smallest_margin_db", margin),
        ),
    ]


def tuning_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """The answer in words."""
    return [*answer_sentences(data), *best_sentences(data), *choice_sentences(data)]


def choice_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """What each further setting is better at than the best one."""
    first, *others = data["proposals"] or [{}]
    return [
        _choice_sentence(row, first["merits"])
        for row in others
        if row.get("better_at") and first.get("merits")
    ]


def _choice_sentence(row: Mapping[str, Any], first: Mapping[str, Any]) -> Sentence:
    merits, reasons, numbers = row["merits"], list[str](), list[Number]()
    for merit in row["better_at"]:
        words, *own = _reason(merit, merits, first)
        reasons.append(words)
        numbers += own
    setting, own_numbers = setting_words(row["settings"])
    rank = Number("rank", row["rank"], "count")
    return Sentence(
        f"Setting {rank} ({setting}) has {join_words(reasons)}.", [rank, *own_numbers, *numbers]
    )


def _reason(
    merit: str, own: Mapping[str, Any], first: Mapping[str, Any]
) -> tuple[str, *tuple[Number, ...]]:
    """What a setting has more of, after "has", with its number and that of the best setting."""
    key, kind, words, unknown = _REASONS[merit]
    value, best = own[key], first[key]
    shown = [
        Number(_MERIT_COLUMNS[key], number, kind) for number in (value, best) if number is not None
    ]
    against = f" against {shown[-1]}" if best is not None else unknown
    more = f"{shown[0]}" if value is not None else "no near edge"
    return words.format(value=more, against=against), *shown


def _worst_error_db(row: Mapping[str, Any], data: Mapping[str, Any]) -> float | None:
    """Expected less prescribed level at the worst line; None where no edge is near to any line."""
    worst = row["worst_frequency_hz"]
    if worst is None or row["worst_margin_db"] is None:
        return None
    place = int(np.argmin(np.abs(np.asarray(data["frequency_hz"]) - worst)))
    return 20 * float(np.log10(row["expected_m_s2"][place] / data["prescribed_m_s2"][place]))


def setting_words(settings: Mapping[str, Any]) -> tuple[str, tuple[Number, ...]]:
    """`1.3 bar, 0.4 kg, steel tip of 45 mm radius, no anvil, position #1`, and its numbers."""
    numbers = tuple(
        Number(key, settings[key])
        for key in ("tank_pressure_pa", "bullet_mass_kg", "tip_radius_m")
        if settings.get(key) is not None
    )
    *amounts, radius = map(str, numbers)
    tip = f"{settings['tip_material']} tip of {radius} radius"
    anvil = (
        "no anvil"
        if settings["anvil_material"] == "none"
        else f"{settings['anvil_material']} anvil"
    )
    if settings["insulator"] != "none":
        anvil = f"{anvil}, {settings['insulator']} insulator"
    return ", ".join((*amounts, tip, anvil, f"position {settings['impact_position']}")), numbers


def short_words(settings: Mapping[str, Any]) -> str:
    """`1.3 bar, 0.4 kg, steel 45 mm`: enough to know a setting in a picture."""
    pressure, mass, radius = (
        str(Number(key, settings[key]))
        for key in ("tank_pressure_pa", "bullet_mass_kg", "tip_radius_m")
    )
    return f"{pressure}, {mass}, {settings['tip_material']} {radius}"


def next_steps(data: Mapping[str, Any]) -> list[Sentence]:
    """What a laboratory does after the search."""
    attainability = data.get("attainability") or {}
    obstacle = attainability.get("obstacle") or {}
    steps = (
        _remedy(obstacle, required_probability(data)) if obstacle.get("kind") in _REMEDIES else []
    )
    if data["proposals"]:
        steps.append(
            Sentence(
                "Open the best setting in the twin, and compare it with the nearest measured shots "
                "before it is fired."
            )
        )
        if obstacle.get("kind") != "measured shots":
            steps.append(
                Sentence(
                    "After the shot, ingest its recording and search again with its campaign in "
                    "the field “Learn from the shots of”: the next proposal is then corrected by "
                    "what was measured."
                )
            )
    return steps


def _remedy(obstacle: Mapping[str, Any], required: float) -> list[Sentence]:
    remedy = Sentence(_REMEDIES[obstacle["kind"]])
    scatter, without = obstacle.get("shot_scatter_db"), obstacle.get("probability_without")
    if obstacle["kind"] != "tolerance" or not scatter or without is None or without >= required:
        return [remedy]
    cause = sentence(
        "Shots at the same setting scatter by {scatter} at a line, and with that scatter alone the "
        "probability is {without}, less than is required.",
        FALLS_SHORT,
        {"value": without, "limit": required},
        scatter=Number("shot_scatter_db", scatter),
        without=_probability(without),
    )
    return [cause, remedy]


# --- tables


def tuning_tables(data: Mapping[str, Any]) -> list[ResultTable]:
    """The answer, the best settings, what stands in the way, and the settings to avoid."""
    tables = (
        ResultTable("The best setting and what is required of it", list(_answer_rows(data))),
        ResultTable(
            "Probabilities that the lines of the next shot lie within tolerance, the best setting "
            "first",
            [proposal_row(row, data) for row in data["proposals"]],
        ),
        ResultTable("What stands in the way", list(_obstacle_rows(data))),
        ResultTable(
            "Settings to avoid",
            [{**setting_cells(row["settings"]), "why": row["avoid"]} for row in data["avoid"]],
        ),
    )
    return [table for table in tables if table.rows]


def _answer_rows(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    best = best_proposal(data)
    if best is None:
        return
    met, required = met_probability(best, data), required_probability(data)
    count = sum(met_probability(row, data) >= required for row in data["proposals"])
    row: dict[str, Any] = {
        "target met": _probability(met).cell,
        "required": percent(required),
        "proposals that meet it": max(count, (data.get("attainability") or {}).get("meeting", 0)),
    }
    if data.get("draws"):
        low, high = _interval(met, data["draws"])
        row |= {"90 % interval from": low.cell, "to": high.cell, "draws": data["draws"]}
    yield row


def proposal_row(row: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    """A proposal as a row of a table."""
    return {
        "rank": row["rank"],
        **setting_cells(row["settings"]),
        "target met": _probability(met_probability(row, data)).cell,
        "every line fits": _probability(row["probability_within"]).cell,
        "95 % of lines fit": _probability(row["probability_95_percent_within"]).cell,
        "lines that fit": percent(row.get("share_within", float("nan"))),
        "smallest_margin_db": row["worst_margin_db"],
        "at_hz": row["worst_frequency_hz"],
        "level_error_db": _worst_error_db(row, data),
        **_merit_cells(row),
        "alternatives": len(row["alternatives"]),
    }


def _merit_cells(row: Mapping[str, Any]) -> dict[str, Any]:
    """Results of older software have none."""
    merits = row.get("merits") or {}
    return {
        column: merits[key]
        for key, column in _MERIT_COLUMNS.items()
        if key in merits and key != "margin_db"
    }


def _obstacle_rows(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    obstacle = (data.get("attainability") or {}).get("obstacle")
    if obstacle and not any(
        met_probability(row, data) >= required_probability(data) for row in data["proposals"]
    ):
        yield {
            "obstacle": obstacle["kind"],
            "target met without it": _probability(obstacle["probability_without"]).cell,
            "at_hz": obstacle["frequency_hz"],
            "margin_db": obstacle["margin_db"],
            "shot_scatter_db": obstacle.get("shot_scatter_db"),
            "limits": "; ".join(obstacle["limits"]),
            "figures": "; ".join(obstacle.get("figures", ())),
        }


def setting_cells(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by the words of a table's columns; quantities keep their keys and are SI."""
    return {
        **{key: settings[key] for key in ("tank_pressure_pa", "bullet_mass_kg")},
        "tip": settings["tip_material"],
        "tip_radius_m": settings["tip_radius_m"],
        "anvil": settings["anvil_material"],
        "insulator": settings["insulator"],
        "position": settings["impact_position"],
    }
