"""What a reader must know beside a prediction's numbers: in the command, the page and the JSON the same sentences."""

from __future__ import annotations

from collections.abc import Iterator

from ...twin.contact_interface import Extrapolation, OutOfDomain
from ...twin.prediction import Prediction

#: Ending of a quantity's name: its unit in SI, the lab's unit, and how many of them one SI unit is.
_UNITS = {
    "pressure": ("Pa", "bar", 1e-5),
    "velocity": ("m/s", "m/s", 1.0),
    "mass": ("kg", "kg", 1.0),
    "radius": ("m", "mm", 1e3),
    "thickness": ("m", "mm", 1e3),
    "youngs_modulus": ("Pa", "GPa", 1e-9),
    "yield_strength": ("Pa", "MPa", 1e-6),
    "density": ("kg/m3", "kg/m3", 1.0),
}
#: Units that end a name, the longer ones first.
_SUFFIXES = ("_m_s", "_kg_m3", "_pa", "_kg", "_m")
#: Quantity to the field of `ShotRequest` that sets it.
_FIELDS = {
    "tank_pressure": "tank_pressure_pa",
    "bullet_mass": "bullet_mass_kg",
    "impactor_mass": "bullet_mass_kg",
    "impact_velocity": "impact_velocity_m_s",
    "tip_radius": "tip_radius_m",
}
#: Fields that the gun turns into a velocity: beyond what was recorded, the velocity is the first to be unsure.
_OF_THE_GUN = ("tank_pressure_pa", "bullet_mass_kg")


def warnings(prediction: Prediction) -> tuple[str, ...]:
    """A sentence for each quantity beyond what was learned, then for what lies outside of the contact's domain."""
    return (*map(extrapolation_text, extrapolations(prediction)), *domain_warnings(prediction))


def extrapolations(prediction: Prediction) -> tuple[Extrapolation, ...]:
    """Each quantity with its range once: gun and contact may both have learned from the same masses."""
    items: dict[tuple[object, ...], Extrapolation] = {}
    for item in prediction.extrapolation:
        base = _base(item.quantity)
        items.setdefault((_FIELDS.get(base, base), item.asked, item.low, item.high), item)
    return tuple(items.values())


def domain_warnings(prediction: Prediction) -> tuple[str, ...]:
    """What lies outside of the contact's domain, but for quantities that an extrapolation names already."""
    beyond = {_base(item.quantity) for item in prediction.extrapolation}
    contact = prediction.models["contact"]
    return tuple(_outside_text(item, contact) for item in prediction.outside if _base(item.predictor) not in beyond)


def extrapolation_text(item: Extrapolation) -> str:
    """As a sentence in the units of the lab."""
    name, unit, scale = _in_lab_units(item.quantity)
    value_text, low, high = (f"{scale * value:.4g}" for value in (item.asked, item.low, item.high))
    learned = low if low == high else f"{low} to {high}"
    text = f"{name} {value_text}{unit} is beyond the {learned}{unit} of the shots that were learned from."
    return text[0].upper() + text[1:]


def field_warnings(prediction: Prediction) -> dict[str, str]:
    """Sentences by the field of `ShotRequest` that sets the quantity, for those that a field sets."""
    texts: dict[str, list[str]] = {}
    for item in extrapolations(prediction):
        if field := _FIELDS.get(_base(item.quantity)):
            texts.setdefault(field, []).append(extrapolation_text(item))
    return {field: " ".join(sentences) for field, sentences in texts.items()}


def warnings_of_number(prediction: Prediction, number: str) -> str:
    """Beside a number of the prediction (its field): the velocity has those of the gun, the peak force all others."""
    return " ".join(_of_number(prediction, number))


def _of_number(prediction: Prediction, number: str) -> Iterator[str]:
    for item in extrapolations(prediction):
        of_gun = _FIELDS.get(_base(item.quantity)) in _OF_THE_GUN and prediction.setting.tank_pressure_pa is not None
        if number == ("velocity_m_s" if of_gun else "peak_force_n"):
            yield extrapolation_text(item)


def _outside_text(item: OutOfDomain, contact: str) -> str:
    """The range is the contact's own text in SI, so that the value is in SI as well."""
    name = _base(item.predictor)
    unit = next((f" {si}" for ending, (si, _, _) in _UNITS.items() if name.endswith(ending)), "")
    value = item.value if isinstance(item.value, str) else f"{item.value:.4g}{unit}"
    text = f"{name.replace('_', ' ')} {value} lies outside of the domain of the contact"
    return f"{text[0].upper()}{text[1:]} ({contact}): {item.range}."


def _in_lab_units(quantity: str) -> tuple[str, str, float]:
    name = _base(quantity)
    for ending, (_, unit, scale) in _UNITS.items():
        if name.endswith(ending):
            return name.replace("_", " "), f" {unit}", scale
    return name.replace("_", " "), "", 1.0


def _base(quantity: str) -> str:
    """The name without its unit: stages name quantities with it, predictors of models have none."""
    return next((quantity.removesuffix(suffix) for suffix in _SUFFIXES if quantity.endswith(suffix)), quantity)
