"""One shot asked of a twin, in SI, and what a reader must know beside its numbers: what `predict`,
the web page and the JSON API share. A factor that no stage of the twin uses is an error."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ....dataset.sources import STATED_PLATE_MASS
from ....dataset.validity_limits import BETWEEN_LEVELS
from ....files.delimited_text import parse_number
from ....files.number_notation import AmbiguousNumberError
from ....schema.known_factors import BY_NAME
from ....signals.valve_profile import ValveProfile
from ....twin.contact_interface import Extrapolation, OutOfDomain
from ....twin.prediction import Prediction
from ...common.number_format import finite, format_number
from ...common.quantities import units

if TYPE_CHECKING:
    from ....schema.session import Store
    from ....twin.setting import Setting
    from ...twins.building import BuiltTwin


#: A factor as it is given: a number in SI, or a word.
Value = str | float
#: Sources of predictors that a factor of another name gives.
_SOURCES = {"plate_mass_kg": "plate.mass"}
#: Factors of the thesis that are given by options and columns of their own, or whose part the
#: velocity takes.
_OWN_OPTION = frozenset(BY_NAME) - {"hammer_speed"}


def parse_factor(text: str) -> tuple[str, Value]:
    """`NAME=VALUE` of `--factor`, a number where it reads as one. Raises `ValueError`."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise ValueError(f"--factor {text!r}; expected NAME=VALUE, such as plate_mass_kg=9.3")
    if name in _OWN_OPTION:
        raise ValueError(
            f"--factor {text!r}: {name} has an option of its own, --{name.replace('_', '-')}"
        )
    return name, factor_value(value)


def factor_value(text: str) -> Value:
    """A cell as a number where it reads as one. Raises `AmbiguousNumberError` for a number with two
    readings."""
    try:
        return parse_number(text)
    except AmbiguousNumberError:
        raise
    except ValueError:
        return text


def is_used(built: BuiltTwin, factor: str) -> bool:
    """Whether a predictor of the twin's contact model is read from this factor."""
    return _SOURCES.get(factor, f"factor.{factor}") in _sources(built)


def check_used(
    built: BuiltTwin, factors: Mapping[str, Value], boundary_conditions: str | None
) -> None:
    """Raises `ValueError` that names a factor that no stage uses, and the predictors of the contact
    model.

    A plate that hangs free is what all plates of the twin are, so that `free` is no contradiction.
    """
    given: dict[str, Value] = dict(factors)
    if boundary_conditions not in (None, "free"):
        given["boundary_conditions"] = str(boundary_conditions)
    ignored = {name: value for name, value in given.items() if not is_used(built, name)}
    if ignored:
        words = ", ".join(f"{name} = {value}" for name, value in ignored.items())
        raise ValueError(
            f"{words}: no stage of this twin uses it{_why(ignored)}; {_contact_inputs(built)}"
        )


def store_factors(store: Store | None) -> frozenset[str]:
    """Names of all factors that campaigns of a store have."""
    from sqlalchemy import select

    from ....schema.campaigns import Factor

    if store is None:
        return frozenset()
    with store.reading() as session:
        return frozenset(session.scalars(select(Factor.name)))


def looks_like_factor(column: str, of_store: Collection[str]) -> bool:
    """Whether a column of a table is a factor: one of the store, or one of the thesis's that is
    misspelt, or a travel.

    Other columns are labels of their rows.
    """
    from ....ingest.folder.column_names import TRAVEL, resembled

    return column in of_store or column in TRAVEL or resembled(column) is not None


def _sources(built: BuiltTwin) -> tuple[str, ...]:
    from ....training.registry.contact_stage import RegisteredContact

    contact = built.twin.contact
    return contact.predictor_set.sources if isinstance(contact, RegisteredContact) else ()


def _why(ignored: Collection[str]) -> str:
    from ....ingest.folder.column_names import resembled

    if "boundary_conditions" in ignored:
        return " (its plate hangs free)"
    resembled_column = next(
        (column for name in ignored if (column := resembled(name)) is not None), None
    )
    return "" if resembled_column is None else f" (it resembles the column {resembled_column})"


def _contact_inputs(built: BuiltTwin) -> str:
    from ....training.registry.contact_stage import RegisteredContact

    contact = built.twin.contact
    if not isinstance(contact, RegisteredContact):
        return (
            f"the contact is the law {contact.label!r}; --contact NAME@VERSION "
            f"chooses a model that learned from it"
        )
    names = ", ".join(predictor.name for predictor in contact.predictor_set.predictors)
    return f"the predictors of {contact.label} are {names}"


NONE = "none"
#: Gauge, where neither pressure nor velocity is said.
TANK_PRESSURE_PA = 5e5
#: Random shots for the bands.
DRAWS = 64


@dataclass(frozen=True)
class ShotRequest:
    """What an operator sets, by name and in SI; at most one of `tank_pressure_pa` (gauge) and
    `impact_velocity_m_s`.

    Without either a gun fires it with `TANK_PRESSURE_PA`; other benches need the velocity, before
    contact. The mass is the bench's where none is given. `factors` are a lab's own, and
    `plate_mass_kg`, by name: for models that learned from them.
    """

    bullet_mass_kg: float | None = None
    tip_material: str = "steel"
    tip_radius_m: float = 0.045
    tank_pressure_pa: float | None = None
    impact_velocity_m_s: float | None = None
    anvil_material: str = NONE
    insulator: str = NONE
    impact_position: str = "#1"
    boundary_conditions: str | None = None
    valve_profile: str | None = None  # as `ValveProfile.parse` takes it
    factors: Mapping[str, Value] = field(default_factory=dict, hash=False)

    def setting(self, built: BuiltTwin) -> Setting:
        """On the twin's plate. Raises `LookupError` for an unknown material, `ValueError` as
        `Setting`, for a bench without a gun where no velocity is given, and for a factor that no
        stage of the twin uses."""
        check_used(built, self.factors, self.boundary_conditions)
        fired = self.tank_pressure_pa is None and self.impact_velocity_m_s is None
        if not built.bench.has_gun and self.impact_velocity_m_s is None:
            bench = f"campaign {built.bench.campaign!r} is of kind {built.bench.kind!r}"
            raise ValueError(
                f"{bench} and has no gun: give the impact velocity, such as --velocity 1.5m/s"
            )
        mass = built.bench.impactor_mass_kg if self.bullet_mass_kg is None else self.bullet_mass_kg
        lab_factors = {
            name: value for name, value in self.factors.items() if name != STATED_PLATE_MASS
        }
        plate = (
            {STATED_PLATE_MASS: self.factors[STATED_PLATE_MASS]}
            if STATED_PLATE_MASS in self.factors
            else {}
        )
        return built.setting(
            impactor_mass_kg=mass,
            tip=built.material(self.tip_material),
            tip_radius_m=self.tip_radius_m,
            tank_pressure_pa=TANK_PRESSURE_PA if fired else self.tank_pressure_pa,
            impact_velocity_m_s=self.impact_velocity_m_s,
            anvil=None
            if self.anvil_material.lower() == NONE
            else built.material(self.anvil_material),
            insulator=self.insulator,
            impact_position=self.impact_position,
            boundary_conditions=self.boundary_conditions or "free",
            factors=lab_factors,
            valve_profile=None
            if self.valve_profile is None
            else ValveProfile.parse(self.valve_profile),
            **plate,
        )


def predict_shot(
    built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0
) -> Prediction:
    """The shot with its bands; the same seed, the same answer.

    Raises `LookupError` for a material or an impact position there is none of, `ValueError` as
    `Setting` and for a bullet that stays in the barrel.
    """
    return built.twin.predict(shot.setting(built), draws=draws, rng=np.random.default_rng(seed))


def predicted_json(
    built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0
) -> dict[str, Any]:
    """The JSON of `pyroshock predict`. Raises as `predict_shot`."""
    return prediction_json(built, predict_shot(built, shot, draws=draws, seed=seed))


def prediction_json(built: BuiltTwin, prediction: Prediction) -> dict[str, Any]:
    """The same of a prediction that is there, with the twin's notes and the warnings in sentences.

    The command, the page and the API show what stands here; a value that is not known is null.
    """

    plain = finite(prediction.as_json())
    assert isinstance(plain, dict)
    return {**plain, "notes": list(built.notes), "warnings": list(warnings(prediction))}


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
#: Fields that the gun turns into a velocity: beyond what was recorded, the velocity is the first to
#: be unsure.
_OF_THE_GUN = ("tank_pressure_pa", "bullet_mass_kg")


def warnings(prediction: Prediction) -> tuple[str, ...]:
    """A sentence for each quantity beyond what was learned, then for what lies outside of the
    contact's domain."""
    return (*map(extrapolation_text, extrapolations(prediction)), *domain_warnings(prediction))


def extrapolations(prediction: Prediction) -> tuple[Extrapolation, ...]:
    """Each quantity with its range once: gun and contact may both have learned from the same
    masses."""
    items: dict[tuple[object, ...], Extrapolation] = {}
    for item in prediction.extrapolation:
        base = _base(item.quantity)
        items.setdefault((_FIELDS.get(base, base), item.asked, item.low, item.high), item)
    return tuple(items.values())


def bench_limit_warnings(prediction: Prediction) -> tuple[str, ...]:
    """Limits of the shipped bench that the shot is beyond, but for a pressure that was shot on this
    bench.

    A campaign states no other limits of its bench in the store: a shot beyond them is answered,
    with this sentence.
    """
    from ....doe.limits.bench import BenchLimits

    pressure, limits = prediction.setting.tank_pressure_pa, BenchLimits()
    highest = min(
        limits.max_tank_pressure_pa, limits.max_regulated_pressure_pa, limits.max_valve_pressure_pa
    )
    beyond_shots = any(_base(item.quantity) == "tank_pressure" for item in prediction.extrapolation)
    if pressure is None or pressure <= highest or (prediction.rests_on.shots and not beyond_shots):
        return ()
    name, unit, scale = _in_lab_units("tank_pressure_pa")
    return (
        f"{name[0].upper()}{name[1:]} {format_number(scale * pressure)}{unit} "
        f"is beyond the bench, whose regulator "
        f"gives {format_number(scale * highest)}{unit} at most: such a shot cannot be fired.",
    )


def domain_warnings(prediction: Prediction) -> tuple[str, ...]:
    """What lies outside of the bench's limits and of the contact's domain, but for quantities that
    an extrapolation names already."""
    beyond = {_base(item.quantity) for item in prediction.extrapolation}
    contact = prediction.models["contact"]
    outside = (
        outside_text(item, contact)
        for item in prediction.outside
        if _base(item.predictor) not in beyond
    )
    return (*bench_limit_warnings(prediction), *outside)


def extrapolation_text(item: Extrapolation) -> str:
    """As a sentence in the units of the lab."""
    name, unit, scale = _in_lab_units(item.quantity)
    value_text, low, high = (
        format_number(scale * value) for value in (item.asked, item.low, item.high)
    )
    learned = low if low == high else f"{low} to {high}"
    text = (
        f"{name} {value_text}{unit} is beyond the {learned}{unit} of the shots "
        f"that were learned from."
    )
    return text[0].upper() + text[1:]


def field_warnings(prediction: Prediction) -> dict[str, str]:
    """Sentences by the field of `ShotRequest` that sets the quantity, for those that a field
    sets."""
    texts: dict[str, list[str]] = {}
    for item in extrapolations(prediction):
        if field := _FIELDS.get(_base(item.quantity)):
            texts.setdefault(field, []).append(extrapolation_text(item))
    return {field: " ".join(sentences) for field, sentences in texts.items()}


def warnings_of_number(prediction: Prediction, number: str) -> str:
    """Beside a number of the prediction (its field): the velocity has those of the gun, the peak
    force all others."""
    return " ".join(_of_number(prediction, number))


def _of_number(prediction: Prediction, number: str) -> Iterator[str]:
    for item in extrapolations(prediction):
        of_gun = (
            _FIELDS.get(_base(item.quantity)) in _OF_THE_GUN
            and prediction.setting.tank_pressure_pa is not None
        )
        if number == ("velocity_m_s" if of_gun else "peak_force_n"):
            yield extrapolation_text(item)


def outside_text(item: OutOfDomain, contact: str) -> str:
    """What a registered model never met, in the units of the lab; the range of a law is its own
    text in SI."""
    name, unit, scale = _in_lab_units(item.predictor)
    model = contact.removeprefix("models:/")
    value = (
        item.value if isinstance(item.value, str) else f"{format_number(scale * item.value)}{unit}"
    )
    if not item.reason:
        if not isinstance(item.value, str):
            value = f"{format_number(item.value)}{_si_unit(item.predictor)}"
        text = (
            f"{name} {value} lies outside of the domain of the contact ({contact}): {item.range}."
        )
    elif item.ends and item.ends[0] < item.ends[-1] and item.reason == BETWEEN_LEVELS:
        low, high = (format_number(scale * end) for end in item.ends)
        text = (
            f"{name} {value} lies between the measured {low} and {high}{unit}; "
            f"{model} was not trained there."
        )
    else:
        ends = " to ".join(dict.fromkeys(format_number(scale * end) for end in item.ends))
        learned = f"{ends}{unit}" if ends else item.range
        text = f"{name} {value} {item.reason}; {model} was trained on {learned}."
    return f"{text[0].upper()}{text[1:]}"


def _si_unit(quantity: str) -> str:
    name = _base(quantity)
    return next((f" {si}" for ending, (si, _, _) in _UNITS.items() if name.endswith(ending)), "")


def _in_lab_units(quantity: str) -> tuple[str, str, float]:
    name = _base(quantity)
    words = name.replace("_", " ")
    for ending, (si_unit, unit, scale) in _UNITS.items():
        if name.endswith(ending):
            return (words, f" {si_unit}", 1.0) if units() == "si" else (words, f" {unit}", scale)
    return words, "", 1.0


def _base(quantity: str) -> str:
    """The name without its unit: stages name quantities with it, predictors of models have none."""
    return next(
        (quantity.removesuffix(suffix) for suffix in _SUFFIXES if quantity.endswith(suffix)),
        quantity,
    )
