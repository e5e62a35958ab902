"""The digital twin of a bench for notebooks and the command line: predict a shot, many shots, or find settings."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..predictions.predicting import DRAWS, NONE, Shot, predicted
from ..twins.building import BuiltTwin, TwinRequest, twin_of
from .displays import facts_table
from .errors import raises_library_errors
from .quantities import si

if TYPE_CHECKING:
    import pandas as pd

    from ...schema.session import Store
    from ...twin.effects import Effect
    from .prediction import ShotPrediction
    from .quantities import Quantity
    from .tuning import TargetLike, TunedSettings

    #: An effect of the catalogue: itself, its id, or "plate.damping:factor=2".
    EffectLike = Effect | str

#: How an argument is called where it was given: as Python spells it, or as an option of the command line.
Label = Callable[[str], str]


def python_name(argument: str) -> str:
    """Arguments are called as Python spells them."""
    return argument


class LaboratoryTwin:
    """Gun, contact, plate and sensors of one bench as one model, taught by the shots that the store holds.

    `built` is the twin behind it. `predict` and `tune` take quantities as numbers in SI, text with a unit or pint
    quantities; pressures are gauge.
    """

    def __init__(self, built: BuiltTwin, store: Store | None, url: str, request: TwinRequest) -> None:
        self.built = built
        self.request = request
        self._store, self._url = store, url

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, and what each stage rests on."""
        return tuple(note for note in self.built.notes if note)

    @property
    def models(self) -> dict[str, str]:
        """Stage -> the model or law that answers there."""
        return dict(self.built.twin.models)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors on the plate."""
        return self.built.twin.sensor_names

    @raises_library_errors
    def predict(
        self,
        *,
        tank_pressure: Quantity | None = None,
        velocity: Quantity | None = None,
        bullet_mass: Quantity | None = None,
        tip: str = "steel",
        tip_radius: Quantity = 0.045,
        anvil: str = NONE,
        insulator: str = NONE,
        impact_position: str = "#1",
        boundary_conditions: str | None = None,
        valve_profile: str | None = None,
        factors: Mapping[str, float | str] | None = None,
        draws: int = DRAWS,
        seed: int = 0,
    ) -> ShotPrediction:
        """One shot: velocity, force, accelerations and spectra with 90 % bands from `draws` random shots.

        `tank_pressure` (gauge) fires the gun; `velocity`, of impact before contact, stands in for it. Without either a
        gun is fired with 5 bar. `factors` are the laboratory's own, in SI. The same `seed` gives the same bands.
        """
        from .prediction import ShotPrediction

        shot = shot_of(
            python_name,
            tank_pressure=tank_pressure,
            velocity=velocity,
            bullet_mass=bullet_mass,
            tip=tip,
            tip_radius=tip_radius,
            anvil=anvil,
            insulator=insulator,
            impact_position=impact_position,
            boundary_conditions=boundary_conditions,
            valve_profile=valve_profile,
            factors=factors or {},
        )
        return ShotPrediction(self.built, predicted(self.built, shot, draws=draws, seed=seed))

    @raises_library_errors
    def predict_many(self, shots: pd.DataFrame, *, draws: int = DRAWS, seed: int = 0) -> pd.DataFrame:
        """A row of predicted numbers for each row of `shots`, whose columns are the arguments of `predict`.

        The columns of the result are those of `shots`, then mean, lower and upper of each number.
        """
        from .frames import with_units

        rows = []
        for arguments in shots.to_dict("records"):
            given = {str(name): value for name, value in arguments.items() if value is not None and value == value}
            numbers = self.predict(**given, draws=draws, seed=seed).to_frame()
            row: dict[str, Any] = {}
            for quantity, number in numbers.iterrows():
                name = f"{str(quantity).replace(', ', '_').replace(' ', '_')}_{_SUFFIX[str(number['unit'])]}"
                row |= {f"{name}_{end}": number[end] for end in ("mean", "lower", "upper")}
            rows.append(row)
        import pandas as pd

        return with_units(shots.reset_index(drop=True).join(pd.DataFrame(rows)))

    @raises_library_errors
    def tune(self, target: TargetLike, **options: Any) -> TunedSettings:
        """Settings of the bench that give a prescribed spectrum, the best first; see `tuning.tuned_settings`.

        `target` is the path of a CSV file, a Series over the frequency in Hz (m/s2), a DataFrame with the columns
        frequency_hz and level_m_s2 or level_g, or a pair of arrays. Options: `tolerance` ("6dB"), `measured` (campaigns
        to learn from), `sensor`, `bullet_mass`, `factors`, `share`, `at_least`, `extrapolate`, `seed`, `progress`.
        """
        from .tuning import tuned_settings

        return tuned_settings(self._store, self._url, self.request, target, **options)

    def __repr__(self) -> str:
        return f"<twin of {self._bench()}: {', '.join(f'{stage} {model}' for stage, model in self.models.items())}>"

    def _repr_html_(self) -> str:
        from html import escape

        notes = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        return facts_table(f"twin of {self._bench()}", self.models) + notes

    def _bench(self) -> str:
        campaign = self.built.bench.campaign
        return f"campaign {campaign}" if campaign else "the bench that ships with the software"


#: Unit -> end of a column's name.
_SUFFIX = {"m/s": "m_s", "N": "n", "s": "s", "N s": "n_s", "m/s2": "m_s2"}


def twin_request(
    label: Label,
    *,
    campaign: str | None = None,
    bench: str | os.PathLike[str] | None = None,
    modes: str | os.PathLike[str] | None = None,
    contact: str | None = None,
    effects: Iterable[EffectLike] = (),
    plate: str | None = None,
    impact_points: Sequence[tuple[float, float]] = (),
    sensors: Sequence[tuple[float, float]] = (),
    q: float = 10.0,
    frequencies: str | Sequence[float] | None = None,
    adopted: bool = True,
    chain_height: Quantity = 0.0,
    coupled: bool = False,
) -> TwinRequest:
    """What a twin is made of. Raises `ValueError` and `LookupError` that call an argument as `label` does."""
    from ..spectra.lines import parse_lines
    from ..twins.effect_text import parse_effect

    given = [effects] if isinstance(effects, str) else effects
    lines = parse_lines(frequencies, label("frequencies")) if isinstance(frequencies, str) else frequencies
    return TwinRequest(
        campaign=campaign,
        modes=None if modes is None else Path(modes),
        bench=None if bench is None else Path(bench),
        contact=contact,
        effects=tuple(parse_effect(effect, label("effect")) if isinstance(effect, str) else effect for effect in given),
        impact_points=tuple(impact_points),
        sensors=tuple(sensors),
        plate=plate,
        q=q,
        frequency_hz=() if lines is None else tuple(float(line) for line in lines),
        adopted=adopted,
        chain_height_m=si(chain_height, "m", label("chain_height")),
        coupled=coupled,
    )


def shot_of(
    label: Label,
    *,
    tank_pressure: Quantity | None,
    velocity: Quantity | None,
    bullet_mass: Quantity | None,
    tip: str,
    tip_radius: Quantity,
    anvil: str,
    insulator: str,
    impact_position: str,
    boundary_conditions: str | None,
    valve_profile: str | None,
    factors: Mapping[str, float | str],
) -> Shot:
    """A shot in SI. Raises `ValueError` that calls an argument as `label` does."""

    def optional(value: Quantity | None, si_unit: str, argument: str) -> float | None:
        return None if value is None else si(value, si_unit, label(argument))

    if velocity is not None and tank_pressure is not None:
        raise ValueError(f"{label('velocity')} and {label('tank_pressure')}: expected one of them")
    return Shot(
        bullet_mass_kg=optional(bullet_mass, "kg", "bullet_mass"),
        tip_material=tip,
        tip_radius_m=si(tip_radius, "m", label("tip_radius")),
        tank_pressure_pa=optional(tank_pressure, "Pa", "tank_pressure"),
        impact_velocity_m_s=optional(velocity, "m/s", "velocity"),
        anvil_material=anvil,
        insulator=insulator,
        impact_position=impact_position,
        boundary_conditions=boundary_conditions,
        factors=dict(factors),
        valve_profile=_profile(valve_profile),
    )


def _profile(text: str | None) -> str | None:
    """A profile as typed, or of the file that is named. Raises `ValueError`."""
    from ...signals.valve_profile import ValveProfile

    if text is None:
        return None
    return str(ValveProfile.parse(text) if ":" in text and not Path(text).exists() else ValveProfile.read(Path(text)))


#: Models registered beside the command line's default store answer there, too.
_NO_STORE = "sqlite:///pyroshock.db"


@raises_library_errors
def shipped_twin(**arguments: Any) -> LaboratoryTwin:
    """The twin of the bench that ships with the software, without a store. Arguments as `ExperimentStore.twin`."""
    return laboratory_twin(None, _NO_STORE, **arguments)


def laboratory_twin(store: Store | None, url: str, **arguments: Any) -> LaboratoryTwin:
    """The twin of a campaign's bench. `arguments` are those of `twin_request`. Raises as `building.twin_of`."""
    from ..models.training import models_extra

    request = twin_request(python_name, **arguments)
    with models_extra():
        return LaboratoryTwin(twin_of(store, url, request), store, url, request)
