"""A registered model as the twin's contact stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ...dataset.predictors import PredictorSet, shipped
from ...dataset.sources import (
    FACTOR,
    STATED_PLATE_MASS,
    VELOCITY,
    ImpactSource,
    Properties,
    read_number,
    read_word,
)
from ...dataset.table import Inputs, Predictor
from ...dataset.validity_limits import OutOfRange
from ...schema.impacts import BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED
from ...schema.known_factors import NONE
from ...twin.contact.effects_on_pulses import with_effects
from ...twin.contact.impacts import ContactEffect
from ...twin.contact.target_motion import (
    PulseMoments,
    TargetMotion,
    integrated_velocity,
    velocity_before_contact,
)
from ...twin.contact_interface import Extrapolation, ForcePulses, ImpactBatch, OutOfDomain
from ...twin.effects import Effect, checked_effects
from ...twin.setting import ElasticMaterial, Setting
from ..models.prior_pulses import mean_pulses, random_pulses
from .records import RegisteredModel

#: A model's velocity is at least this share of that before contact, and is looked for between so
#: many velocities.
_LEAST_SHARE, _VELOCITIES = 0.1, 9
#: At most: an integral lacks the target's motion; with the motion added as it likely is, it may
#: have too much.
_MOST_SHARE = {INTEGRATED: 1.0, TARGET_MOTION_ADDED: 2.0}


@dataclass(frozen=True, eq=False)
class RegisteredContact:
    """A model of the registry, asked with settings. `asked` is its predictor set: a shipped one
    goes by its name.

    `velocity_kind` (`schema.velocity_kinds`) is the kind of velocity that the model learned from.
    Strikes have the velocity before contact; a model of another kind is asked with the velocity at
    which its own pulse gives that one (`twin.contact.target_motion`), whose uncertainty is part of
    every random pulse. `effects` change the model's pulses as they change Hertz' impact.

    A random pulse is the mean one with log-normal factors of the peak force and of the contact
    time, with the model's spreads and the correlation of the two; apart from each other for a model
    that does not know it. No impulse exceeds two momenta of the impactor, or the mean pulse's where
    a model has learned of more (from a hand that pushes): beyond, energy would be created. Raises
    `LookupError` for a set that is not shipped and not given, `ValueError` for one that is not the
    model's, `TypeError` for effects of another stage.
    """

    registered: RegisteredModel
    asked: PredictorSet | None = None
    velocity_kind: str = BEFORE_CONTACT
    effects: Sequence[Effect] = ()

    def __post_init__(self) -> None:
        if self.predictor_set.predictors != self.registered.predictors:
            label, name = self.registered.version.label, self.predictor_set.name
            raise ValueError(f"{label} learned from other predictors than the set {name!r} has now")
        object.__setattr__(self, "effects", checked_effects(self.effects, ContactEffect))

    @property
    def label(self) -> str:
        """As MLflow finds it, "models:/coregional-gp@champion", and the ids of the effects."""
        version = self.registered.version
        which = f"/{version.version}" if version.champion_of is None else "@champion"
        return " + ".join(
            [f"models:/{version.name}{which}", *(effect.id for effect in self.effects)]
        )

    @property
    def normals(self) -> int:
        """Force and time; and mobility and indentation left, where velocities are converted."""
        return 2 if self.velocity_kind == BEFORE_CONTACT else 4

    @property
    def shots(self) -> int:
        """How many measured pulses the model was trained on; 0 where its files do not say."""
        return self.registered.shots

    @property
    def predictor_set(self) -> PredictorSet:
        """What the model is asked with."""
        return self.asked or shipped(self.registered.version.dataset.predictor_set)

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        """Mean pulses, or a random pulse for each strike.

        Parameters:
            strikes: The n impacts.
            z: Standard normal numbers (n, `normals`) of which random pulses are a function; by
                default None, for mean pulses.

        Raises:
            ValueError: Where a setting does not tell what a predictor asks for, and for another
                shape of `z`.
        """
        if z is not None and z.shape != (len(strikes), self.normals):
            raise ValueError(f"z has shape {z.shape}: expected ({len(strikes)}, {self.normals})")
        prediction = self.registered.model.predict(
            self._inputs_at(strikes, self._model_velocity(strikes, z))
        )
        pulses = (
            mean_pulses(prediction)
            if z is None
            else random_pulses(prediction, z[:, :2], _momentum(strikes))
        )
        return with_effects(pulses, strikes, self.effects) if self.effects else pulses

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        """For each strike, what of it lies outside of the model's validity domain; velocities are
        in the model's own kind.

        Parameters:
            strikes: The n impacts.

        Raises:
            ValueError: Where a setting does not tell what a predictor asks for.
        """
        listed = self.registered.domain.outside(self.inputs(strikes))
        return [tuple(map(_out_of_domain, items)) for items in listed]

    def extrapolation(self, strikes: ImpactBatch) -> list[tuple[Extrapolation, ...]]:
        """For each strike, the numbers that lie below or above all that the model has learned from.

        Parameters:
            strikes: The n impacts.

        Raises:
            ValueError: Where a setting does not tell what a predictor asks for.
        """
        inputs, domain = self.inputs(strikes), self.registered.domain
        listed: list[list[Extrapolation]] = [[] for _ in range(len(strikes))]
        for limit, column in domain.numbers(inputs):
            for row in np.flatnonzero(limit.beyond(column)):
                value = float(column[row])
                listed[row].append(
                    Extrapolation(limit.predictor.name, value, limit.low, limit.high)
                )
        return [tuple(items) for items in listed]

    def inputs(self, strikes: ImpactBatch) -> Inputs:
        """What the model is asked with, a row for each strike.

        Parameters:
            strikes: The n impacts.

        Raises:
            ValueError: Where a setting does not tell what a predictor asks for.
        """
        return self._inputs_at(strikes, self._model_velocity(strikes, None))

    def _inputs_at(self, strikes: ImpactBatch, velocity_m_s: Floats) -> Inputs:
        settings = {
            id(setting): setting for setting in strikes.settings
        }  # random shots share one setting
        rows = {key: self._row(setting) for key, setting in settings.items()}
        x = np.array([rows[id(setting)] for setting in strikes.settings])
        x[:, [source == VELOCITY for source in self.predictor_set.sources]] = velocity_m_s[:, None]
        return Inputs(
            predictors=self.registered.predictors,
            x=x,
            impactor_mass_kg=np.array([setting.impactor_mass_kg for setting in strikes.settings]),
            plate_thickness_m=np.array([setting.plate_thickness_m for setting in strikes.settings]),
        )

    def _model_velocity(self, strikes: ImpactBatch, z: Floats | None) -> Floats:
        """The velocity (n,) of the model's kind at which its mean pulse gives that before contact.

        The model is asked at velocities from a tenth to all of it, or twice, once for each setting;
        between them what they give before contact, which is nearly proportional, is interpolated in
        logarithms.
        """
        wanted = strikes.impact_velocity_m_s
        converted = (
            self.velocity_kind == INTEGRATED or z is not None
        )  # else the target's motion is as it likely is
        if (
            self.velocity_kind == BEFORE_CONTACT
            or VELOCITY not in self.predictor_set.sources
            or not converted
        ):
            return wanted
        settings = {id(setting): setting for setting in strikes.settings}
        places = {key: place for place, key in enumerate(settings)}
        row = np.array([places[id(setting)] for setting in strikes.settings])
        fastest = np.zeros(len(settings))
        np.maximum.at(fastest, row, wanted)
        most = _MOST_SHARE[self.velocity_kind]
        trial_velocity = fastest[:, None] * np.geomspace(_LEAST_SHARE, most, _VELOCITIES)
        trials = ImpactBatch(
            [setting for setting in settings.values() for _ in range(_VELOCITIES)],
            trial_velocity.ravel(),
        )
        force = mean_pulses(
            self.registered.model.predict(self._inputs_at(trials, trial_velocity.ravel()))
        ).force_n
        moments = PulseMoments.of(force)
        moments = PulseMoments(
            *(values.reshape(trial_velocity.shape)[row] for values in vars(moments).values())
        )
        likely = TargetMotion.of_strikes(strikes)
        motion = (likely if z is None else likely.drawn(z[:, 2:])).column
        integrated = trial_velocity[row]
        if self.velocity_kind != INTEGRATED:
            integrated, _ = integrated_velocity(integrated, moments, likely.column)
        before, _ = velocity_before_contact(integrated, moments, motion)
        rising = np.log(np.maximum.accumulate(before, axis=1))
        at = zip(np.log(wanted), rising, np.log(trial_velocity[row]), strict=True)
        velocity = np.exp(np.array([np.interp(*case) for case in at]))
        return np.asarray(np.clip(velocity, _LEAST_SHARE * wanted, most * wanted))

    def _row(self, setting: Setting) -> tuple[float, ...]:
        case, materials = case_of(setting), _materials(setting)
        pairs = zip(self.predictor_set.predictors, self.predictor_set.sources, strict=True)
        return tuple(_value(predictor, source, case, materials) for predictor, source in pairs)


def case_of(setting: Setting) -> ImpactSource:
    """A setting in the words of `dataset.sources`; its velocity is not in it, strikes have their
    own.

    Parameters:
        setting: Impactor, target and factors of a strike, as the twin has them.
    """
    numbers = {name: value for name, value in setting.factors.items() if not isinstance(value, str)}
    return ImpactSource(
        words={
            "tip_material": setting.tip.name,
            "plate_material": setting.plate.name,
            "anvil_material": setting.anvil.name if setting.anvil is not None else NONE,
            "insulator": setting.insulator,
            "impact_position": setting.impact_position,
            "boundary_conditions": setting.boundary_conditions,
            **{name: value for name, value in setting.factors.items() if isinstance(value, str)},
        },
        numbers={
            "tip_radius": setting.tip_radius_m,
            "bullet_mass": setting.impactor_mass_kg,
            STATED_PLATE_MASS: setting.plate_mass_kg,
            **numbers,
        },
        velocity_m_s=1.0,
        impactor_mass_kg=setting.impactor_mass_kg,
        bench_plate_material=setting.plate.name,
        plate_thickness_m=setting.plate_thickness_m,
        plate_area_m2=None,
    )


def _materials(setting: Setting) -> Mapping[str, Properties]:
    parts: Sequence[ElasticMaterial | None] = (setting.tip, setting.plate, setting.anvil)
    return {part.name: _properties(part) for part in parts if part is not None}


def _properties(material: ElasticMaterial) -> Properties:
    known_columns = {
        "youngs_modulus_pa": material.youngs_modulus_pa,
        "poisson_ratio": material.poisson_ratio,
        "density_kg_m3": material.density_kg_m3,
    }
    strength = material.yield_strength_pa
    return known_columns if strength is None else {**known_columns, "yield_strength_pa": strength}


def _value(
    predictor: Predictor, source: str, case: ImpactSource, materials: Mapping[str, Properties]
) -> float:
    give = (
        f"; give it: --factor {source.removeprefix(FACTOR)}=VALUE"
        if source.startswith(FACTOR)
        else ""
    )
    if not predictor.levels:
        number = read_number(source, case, materials)
        if number is None:
            raise ValueError(
                f"the model asks for {predictor.name}, which this setting "
                f"does not tell ({source}){give}"
            )
        return float(number)
    word = read_word(source, case)
    if word not in predictor.levels:
        raise ValueError(
            f"{predictor.name} is {word!r}; the model knows {', '.join(predictor.levels)}{give}"
        )
    return float(predictor.levels.index(word))


def _momentum(strikes: ImpactBatch) -> Floats:
    return (
        np.array([setting.impactor_mass_kg for setting in strikes.settings])
        * strikes.impact_velocity_m_s
    )


def _out_of_domain(item: OutOfRange) -> OutOfDomain:
    ends = tuple(end for end in item.range if not isinstance(end, str))
    words = [end if isinstance(end, str) else f"{end:.6g}" for end in item.range]
    text = " to ".join(dict.fromkeys(words)) if ends else ", ".join(words)
    return OutOfDomain(item.predictor, item.value, text, item.reason, ends)
