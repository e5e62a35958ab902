"""A registered model as the twin's contact stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..dataset.predictors import PredictorSet, shipped
from ..dataset.sources import VELOCITY, Case, Properties, read_number, read_word
from ..dataset.table import Floats, Inputs, Predictor
from ..schema.columns import NONE
from ..twin.materials import Material
from ..twin.setting import Setting
from ..twin.strikes import Outside, Pulses, Strikes
from .models.base import ContactPrediction
from .records import RegisteredModel

#: A random contact time is at least this share of the mean.
_SHORTEST = 0.05


@dataclass(frozen=True, eq=False)
class RegisteredContact:
    """A model of the registry, asked with settings. `asked` is its predictor set: a shipped one goes by its name.

    A random pulse is the mean plus one normal number times the spread of the force, all along the pulse and never
    below 0, and one times that of the contact time: points of a pulse deviate together much more than apart. Raises
    `LookupError` for a set that is not shipped and not given, `ValueError` for one that is not the model's.
    """

    registered: RegisteredModel
    asked: PredictorSet | None = None

    def __post_init__(self) -> None:
        if self._set.predictors != self.registered.predictors:
            raise ValueError(
                f"{self.registered.version.label} learned from other predictors than the set {self._set.name!r} has now"
            )

    @property
    def label(self) -> str:
        """As MLflow finds it: "models:/coregional-gp@champion"."""
        version = self.registered.version
        if version.champion_of is None:
            return f"models:/{version.name}/{version.version}"
        return f"models:/{version.name}@champion"

    @property
    def normals(self) -> int:
        return 2

    def pulses(self, strikes: Strikes, z: Floats | None = None) -> Pulses:
        """Raises `ValueError` where a setting does not tell what a predictor asks for."""
        prediction = self.registered.model.predict(self.inputs(strikes))
        return _pulses(prediction) if z is None else random_pulses(prediction, z)

    def outside(self, strikes: Strikes) -> list[tuple[Outside, ...]]:
        found = self.registered.domain.outside(self.inputs(strikes))
        return [tuple(Outside(o.predictor, o.value, _range(o.range)) for o in told) for told in found]

    def inputs(self, strikes: Strikes) -> Inputs:
        """What the model is asked with, a row for each strike. Raises as `pulses`."""
        each = {id(setting): setting for setting in strikes.settings}  # random shots share one setting
        rows = {key: self._row(setting) for key, setting in each.items()}
        x = np.array([rows[id(setting)] for setting in strikes.settings])
        x[:, [source == VELOCITY for source in self._set.sources]] = strikes.impact_velocity_m_s[:, None]
        return Inputs(
            predictors=self.registered.predictors,
            x=x,
            impactor_mass_kg=np.array([setting.impactor_mass_kg for setting in strikes.settings]),
            plate_thickness_m=np.array([setting.plate_thickness_m for setting in strikes.settings]),
        )

    @property
    def _set(self) -> PredictorSet:
        return self.asked or shipped(self.registered.version.dataset.predictor_set)

    def _row(self, setting: Setting) -> tuple[float, ...]:
        case, materials = case_of(setting), _materials(setting)
        pairs = zip(self._set.predictors, self._set.sources, strict=True)
        return tuple(_value(predictor, source, case, materials) for predictor, source in pairs)


def case_of(setting: Setting) -> Case:
    """A setting in the words of `dataset.sources`; its velocity is not told, strikes have their own."""
    return Case(
        words={
            "tip_material": setting.tip.name,
            "plate_material": setting.plate.name,
            "anvil_material": setting.anvil.name if setting.anvil is not None else NONE,
            "insulator": setting.insulator,
            "impact_position": setting.impact_position,
            "boundary_conditions": "free",  # the gun's plates hang free
        },
        numbers={
            "tip_radius": setting.tip_radius_m,
            "bullet_mass": setting.impactor_mass_kg,
            "plate_mass_kg": setting.plate_mass_kg,
        },
        velocity_m_s=1.0,
        impactor_mass_kg=setting.impactor_mass_kg,
        bench_plate_material=setting.plate.name,
        plate_thickness_m=setting.plate_thickness_m,
        plate_area_m2=None,
    )


def _materials(setting: Setting) -> Mapping[str, Properties]:
    parts: Sequence[Material | None] = (setting.tip, setting.plate, setting.anvil)
    return {part.name: _properties(part) for part in parts if part is not None}


def _properties(material: Material) -> Properties:
    known = {
        "youngs_modulus_pa": material.youngs_modulus_pa,
        "poisson_ratio": material.poisson_ratio,
        "density_kg_m3": material.density_kg_m3,
    }
    strength = material.yield_strength_pa
    return known if strength is None else {**known, "yield_strength_pa": strength}


def _value(predictor: Predictor, source: str, case: Case, materials: Mapping[str, Properties]) -> float:
    if not predictor.levels:
        number = read_number(source, case, materials)
        if number is None:
            raise ValueError(f"the model asks for {predictor.name}, which this setting does not tell ({source})")
        return float(number)
    word = read_word(source, case)
    if word not in predictor.levels:
        raise ValueError(f"{predictor.name} is {word!r}; the model knows {', '.join(predictor.levels)}")
    return float(predictor.levels.index(word))


def random_pulses(prediction: ContactPrediction, z: Floats) -> Pulses:
    """A random pulse for each prediction, a function of normal numbers z (n, 2): force and contact time."""
    force, time = prediction.force_n, prediction.contact_time_s
    if prediction.force_spread_n is not None:
        force = np.maximum(force + z[:, :1] * prediction.force_spread_n, 0.0)
    if prediction.contact_time_spread_s is not None:
        time = np.maximum(time + z[:, 1] * prediction.contact_time_spread_s, _SHORTEST * time)
    return _pulses(ContactPrediction(force, time, None, None))


def _pulses(prediction: ContactPrediction) -> Pulses:
    """Models force nothing at the ends of contact, where the force is 0 by what contact means."""
    force = np.maximum(prediction.force_n, 0.0)
    force[:, [0, -1]] = 0.0
    share = np.argmax(force, axis=1) / (force.shape[1] - 1)
    return Pulses(prediction.contact_time_s, force, share * prediction.contact_time_s)


def _range(ends: Sequence[float] | Sequence[str]) -> str:
    words = [one if isinstance(one, str) else f"{one:.6g}" for one in ends]
    return ", ".join(words) if isinstance(ends[0], str) else " to ".join(dict.fromkeys(words))
