"""Where a prediction is beyond what its stages know, in sentences: beyond the shots that were
learned from, outside of the domain of the contact, beyond the limits of the bench."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

from ....dataset.validity_limits import BETWEEN_LEVELS
from ....twin.contact_interface import Extrapolation, OutOfDomain
from ....twin.prediction import Prediction
from ...common.quantities import display_of, shown_in
from ...common.unit_endings import key_of_quantity, unit_ending
from ..sentence import BETWEEN, BEYOND, EXCEEDS, Number, Sentence, sentence

#: Quantity to the field of `ShotRequest` that sets it.
_FIELDS = {
    "tank_pressure": "tank_pressure_pa",
    "bullet_mass": "bullet_mass_kg",
    "impactor_mass": "bullet_mass_kg",
    "impact_velocity": "impact_velocity_m_s",
    "tip_radius": "tip_radius_m",
}
#: Fields that the gun turns into a velocity: beyond what was recorded, the velocity is the first to
#: be unsure.
_OF_THE_GUN = ("tank_pressure_pa", "bullet_mass_kg")


def _base(quantity: str) -> str:
    """The name without its unit: stages name quantities with it, predictors of models have none."""
    entry = unit_ending(quantity)
    return quantity if entry is None else quantity.removesuffix(entry.ending)


def _field(item: Extrapolation) -> str:
    """The field that sets the quantity; the quantity itself where none does."""
    base = _base(item.quantity)
    return _FIELDS.get(base, base)


def _label(quantity: str) -> str:
    """To begin a sentence."""
    label = display_of(key_of_quantity(quantity)).label
    return f"{label[:1].upper()}{label[1:]}"


def _number(quantity: str, value: float) -> Number:
    key = key_of_quantity(quantity)
    return Number(key, value, "quantity" if display_of(key).unit else "size")


# --- beyond the shots that were learned from


def extrapolations(prediction: Prediction) -> tuple[Extrapolation, ...]:
    """Each quantity with its range once: gun and contact may both have learned from the same
    masses."""
    items: dict[tuple[object, ...], Extrapolation] = {}
    for item in prediction.extrapolation:
        items.setdefault((_field(item), item.asked, item.low, item.high), item)
    return tuple(items.values())


def extrapolation_sentence(item: Extrapolation) -> Sentence:
    """In the units of the lab."""
    value, low, high = (_number(item.quantity, n) for n in (item.asked, item.low, item.high))
    learned = "{high}" if low.cell == high.cell else "{low.cell} to {high}"
    side = "below" if item.asked < item.low else "above"
    return sentence(
        f"{{label}} {{value}} is {side} the {learned} of the shots that were learned from.",
        BEYOND,
        {"value": item.asked, "low": item.low, "high": item.high},
        label=_label(item.quantity),
        value=value,
        low=low,
        high=high,
    )


def field_warnings(prediction: Prediction) -> dict[str, str]:
    """Sentences by the field of `ShotRequest` that sets the quantity, for those that a field
    sets."""
    texts: dict[str, list[str]] = {}
    for item in extrapolations(prediction):
        if _field(item) in _FIELDS.values():
            texts.setdefault(_field(item), []).append(str(extrapolation_sentence(item)))
    return {field: " ".join(sentences) for field, sentences in texts.items()}


def warnings_of_number(prediction: Prediction, number: str) -> str:
    """Beside a number of the prediction (its field): the velocity has those of the gun, the peak
    force all others."""
    fired = prediction.setting.tank_pressure_pa is not None
    return " ".join(
        str(extrapolation_sentence(item))
        for item in extrapolations(prediction)
        if number == ("velocity_m_s" if fired and _field(item) in _OF_THE_GUN else "peak_force_n")
    )


# --- outside of the domain of the contact, and beyond the bench


def outside_sentence(item: OutOfDomain, contact: str) -> Sentence:
    """What a registered model never met, in the units of the lab; the range of a law is its own
    text in SI."""
    shown: dict[str, Any] = {"label": _label(item.predictor), "range": item.range}
    shown |= {"model": contact.removeprefix("models:/"), "contact": contact, "reason": item.reason}
    shown["value"] = item.value
    if not isinstance(item.value, str):
        shown["value"] = _number(item.predictor, item.value)
    if not item.reason:
        with shown_in("si"):
            return sentence(
                "{label} {value} lies outside of the domain of the contact ({contact}): {range}.",
                **shown,
            )
    if item.ends:
        low, high = item.ends[0], item.ends[-1]
        shown |= {"low": _number(item.predictor, low), "high": _number(item.predictor, high)}
        evidence: Mapping[str, Any] = {"value": item.value, "low": low, "high": high}
        if item.reason == BETWEEN_LEVELS and BETWEEN.allows(**evidence):
            return sentence(
                "{label} {value} lies between the measured {low.cell} and {high}; {model} was not "
                "trained there.",
                BETWEEN,
                evidence,
                **shown,
            )
        learned = "{high}" if shown["low"].cell == shown["high"].cell else "{low.cell} to {high}"
        return sentence(
            f"{{label}} {{value}} {{reason}}; {{model}} was trained on {learned}.", **shown
        )
    return sentence("{label} {value} {reason}; {model} was trained on {range}.", **shown)


def _exceeded_pressure(prediction: Prediction) -> tuple[float, float] | None:
    """The pressure of a shot and the highest one of the shipped bench, where it is beyond that and
    was not shot on this bench."""
    from ....doe.limits.bench import BenchLimits

    pressure, limits = prediction.setting.tank_pressure_pa, BenchLimits()
    highest = min(
        limits.max_tank_pressure_pa, limits.max_regulated_pressure_pa, limits.max_valve_pressure_pa
    )
    beyond_shots = any(_base(item.quantity) == "tank_pressure" for item in prediction.extrapolation)
    if pressure is None or pressure <= highest or (prediction.rests_on.shots and not beyond_shots):
        return None
    return pressure, highest


def bench_limit_sentences(prediction: Prediction) -> tuple[Sentence, ...]:
    """Limits of the shipped bench that the shot is beyond, but for a pressure that was shot on this
    bench.

    A campaign states no other limits of its bench in the store: a shot beyond them is answered,
    with this sentence.
    """
    if (exceeded := _exceeded_pressure(prediction)) is None:
        return ()
    pressure, highest = exceeded
    claim = sentence(
        "{label} {pressure} is beyond the bench, whose regulator gives {highest} at most: such a "
        "shot cannot be fired.",
        EXCEEDS,
        {"value": pressure, "limit": highest},
        label=_label("tank_pressure_pa"),
        pressure=Number("tank_pressure_pa", pressure),
        highest=Number("max_tank_pressure_pa", highest),
    )
    return (claim,)


def domain_sentences(prediction: Prediction) -> tuple[Sentence, ...]:
    """What lies outside of the bench's limits and of the contact's domain, but for quantities that
    an extrapolation names already."""
    contact = prediction.models["contact"]
    outside = (outside_sentence(item, contact) for item in _outside(prediction))
    return (*bench_limit_sentences(prediction), *outside)


def _outside(prediction: Prediction) -> list[OutOfDomain]:
    beyond = {_base(item.quantity) for item in prediction.extrapolation}
    return [item for item in prediction.outside if _base(item.predictor) not in beyond]


def warning_sentences(prediction: Prediction) -> tuple[Sentence, ...]:
    """A sentence for each quantity beyond what was learned, then for what lies outside of the
    contact's domain."""
    return (
        *map(extrapolation_sentence, extrapolations(prediction)),
        *domain_sentences(prediction),
    )


def beyond_rows(prediction: Prediction) -> list[dict[str, Any]]:
    """A row for each quantity that a warning is about: what is asked for, and what is known."""
    rows = [
        _beyond_row(item.quantity, item.asked, item.low, item.high)
        for item in extrapolations(prediction)
    ]
    if (exceeded := _exceeded_pressure(prediction)) is not None:
        rows.append(_beyond_row("tank_pressure_pa", exceeded[0], "", exceeded[1]))
    for item in _outside(prediction):
        ends = (item.ends[0], item.ends[-1]) if item.ends else (item.range, "")
        with nullcontext() if item.reason else shown_in("si"):
            rows.append(_beyond_row(item.predictor, item.value, *ends))
    return rows


def _beyond_row(name: str, *cells: float | str) -> dict[str, Any]:
    shown = display_of(key_of_quantity(name))
    value, low, high = (
        part if isinstance(part, str) else _number(name, part).cell for part in cells
    )
    limits = {"known from": low, "known to": high}
    return {"asked for": value, "unit": shown.unit, "quantity": shown.label, **limits}
