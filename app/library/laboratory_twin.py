"""The digital twin of a bench for notebooks: predict a shot, many shots, or find settings."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any

from ..common.errors import argument_names, raises_library_errors
from ..common.frames import facts_table, step_bar, with_units
from ..common.model_registry import models_extra
from ..operations.predict.arguments import effects_of, python_name, shot_of, twin_request
from ..operations.predict.predicting import DRAWS, NONE, predict_shot
from ..twins.building import BuiltTwin, TwinRequest, twin_of

if TYPE_CHECKING:
    import pandas as pd

    from ...schema.session import Store
    from ..common.frames import Quantity
    from ..operations.predict.arguments import EffectsLike
    from ..operations.predict.service import ShotPrediction
    from ..operations.tune.service import TargetLike, TunedSettings


class LaboratoryTwin:
    """Gun, contact, plate and sensors of one bench as one model, taught by the shots that the store
    holds.

    `built` is the twin behind it. `predict` and `tune` take quantities as numbers in SI, text with
    a unit or pint quantities; pressures are gauge.
    """

    def __init__(
        self, built: BuiltTwin, store: Store | None, url: str, request: TwinRequest
    ) -> None:
        self.built = built
        self.request = request
        self._store, self._url = store, url

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, and what each stage rests on."""
        return tuple(argument_names(note) for note in self.built.notes if note)

    @property
    def rests_on(self) -> str:
        """What the bands of its predictions rest on, in one sentence."""
        rests_on = self.built.twin.rests_on
        return "" if rests_on is None else rests_on.sentence

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
        """One shot: velocity, force, accelerations and spectra with 90 % bands.

        Quantities are numbers in SI, text with a unit ("5 bar"), or quantities of pint.

        Parameters:
            tank_pressure: Gauge pressure of the tank, Pa. Without it and `velocity`, a gun is fired
                with 5 bar.
            velocity: Velocity of the impactor before contact, m/s, in the place of `tank_pressure`;
                a bench without a gun needs it.
            bullet_mass: Mass of the impactor, kg; by default that of the bench.
            tip: Material of the tip.
            tip_radius: Radius of the tip, m.
            anvil: Material of the anvil, or "none".
            insulator: "polymeric", or "none".
            impact_position: Name of the struck point of the plate.
            boundary_conditions: How the plate is held, as the contact model has learned it; by
                default not said.
            valve_profile: Opening of the valve over time, as text or as the path of its file; by
                default that of the bench.
            factors: The laboratory's own factors, in SI; each must be a predictor of the contact
                model.
            draws: Number of random shots behind the bands; 0 for the nominal shot alone.
            seed: Seed of the random shots: the same seed gives the same bands.

        Raises:
            NotFoundError: For an unknown material or impact position.
            InvalidValueError: For both `tank_pressure` and `velocity`, a quantity in a wrong unit,
                and a factor that no stage of the twin uses.
        """
        from ..operations.predict.service import ShotPrediction

        if draws < 0:
            raise ValueError(f"draws is {draws!r}; expected 0 (the nominal shot alone) or more")
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
            factors=factors,
        )
        return ShotPrediction(self.built, predict_shot(self.built, shot, draws=draws, seed=seed))

    @raises_library_errors
    def predict_many(
        self,
        shots: pd.DataFrame,
        *,
        draws: int = DRAWS,
        seed: int = 0,
        jobs: int = 1,
        progress: bool = True,
    ) -> pd.DataFrame:
        """`shots` with the predicted numbers of each row beside it.

        Each row is predicted as `predict` predicts it alone.

        Parameters:
            shots: A shot in each row. Columns are arguments of `predict` ("tank_pressure": "5
                bar"), or those of a table of runs ("tank_pressure_bar") or of the store's frames
                ("tank_pressure_pa"), as `runs.csv` and plans have them; an empty cell leaves the
                argument out.
            draws: Number of random shots behind the bands of each row; 0 for the nominal shots
                alone.
            seed: Seed of the random shots.
            jobs: The number of processes that predict at once.
            progress: Whether a bar shows the progress.

        Returns:
            The columns of `shots`, then mean, lower and upper end of the 90 % band of each number,
            SI. `.attrs["notes"]` says what was assumed.

        Raises:
            InvalidValueError: For a row that `predict` refuses, with its number, and for a column
                that is no argument.
        """
        import pandas as pd

        from ...parallel.executor import ExecutorConfig
        from ..operations.predict.batch import bench_of_rows, predict_batch
        from ..operations.predict.service import shot_rows

        rows = shot_rows(shots)
        bench, rows, notes = bench_of_rows(
            self._store, self._url, self.request, rows, draws, seed, self.built
        )
        with step_bar("predicting", "shots", progress) as step:
            predicted_shots = predict_batch(bench, rows, ExecutorConfig(jobs=jobs), step)
        numbers = [
            {name: value for name, value in shot.figures.items() if name not in row.labels}
            for shot, row in zip(predicted_shots, rows, strict=True)
        ]
        table = with_units(shots.reset_index(drop=True).join(pd.DataFrame(numbers)))
        table.attrs["notes"] = [argument_names(note) for note in notes]
        return table

    @raises_library_errors
    def tune(
        self,
        target: TargetLike,
        *,
        tolerance: str | float | None = None,
        progress: bool = True,
        **search: Any,
    ) -> TunedSettings:
        """Settings of the bench that give a prescribed spectrum, the best first.

        Parameters:
            target: The path of a CSV file, a Series over the frequency in Hz (m/s2), a DataFrame
                with the columns frequency_hz and level_m_s2 or level_g, or a pair of arrays (n,) in
                Hz and m/s2.
            tolerance: "6dB", "+9/-6dB" or a number in dB; by default that of the target, else
                NASA-STD-7003's.
            progress: Whether a bar shows the progress.
            search: The fields of `SpectrumSearch`: `measured` (campaigns whose shots are learned
                from), `sensor` (by default the first), `bullet_mass` ("0.2kg,0.5kg" or
                "0.2kg:1kg"), `factors` (the path of a TOML file of what the laboratory owns),
                `share` of the lines within the tolerance (by default 1), `at_least` (the
                probability from which a setting meets the target, by default 0.5), `extrapolate`
                (settings outside of the model's domain, too, by default False) and `seed`.

        Raises:
            InvalidValueError: For a target or tolerance that has another form, and a field out of
                its bounds.
            StorageError: For a file that cannot be read.
            NotFoundError: For an unknown campaign or sensor.
        """
        from ..operations.faults import read
        from ..operations.tune.request import SpectrumSearch
        from ..operations.tune.service import search_settings, target_of

        prescribed, request = target_of(target, tolerance), read(SpectrumSearch, search, "python")
        with step_bar("tune", "settings", progress) as step:
            return search_settings(self._store, self._url, prescribed, request, self.request, step)

    @raises_library_errors
    def with_effects(self, effects: EffectsLike) -> LaboratoryTwin:
        """The same twin with further effects, which take the place of those with the same id.

        Parameters:
            effects: Ids with parameters in SI ("plate.damping:factor=2"), effects of the catalogue,
                or a diagnosis, whose likeliest cause acts then; its attribute `fitted` has other
                fits.

        Raises:
            NotFoundError: For an effect that the catalogue does not have.
            InvalidValueError: For a diagnosis whose likeliest cause is none or unknown.
        """
        added = effects_of(effects, "effects")
        own = {effect.id for effect in added}
        others = tuple(effect for effect in self.request.effects if effect.id not in own)
        request = replace(self.request, effects=(*others, *added))
        return _built_twin(self._store, self._url, request)

    def __repr__(self) -> str:
        return (
            f"<twin of {self._bench()}: "
            f"{', '.join(f'{stage} {model}' for stage, model in self.models.items())}>"
        )

    def _repr_html_(self) -> str:
        notes = "".join(f"<p>{escape(note)}</p>" for note in (self.rests_on, *self.notes) if note)
        return facts_table(f"twin of {self._bench()}", self.models) + notes

    def _bench(self) -> str:
        campaign = self.built.bench.campaign
        return f"campaign {campaign}" if campaign else "the bench that ships with the software"


@raises_library_errors
def shipped_twin(
    *,
    bench: str | os.PathLike[str] | None = None,
    modes: str | os.PathLike[str] | None = None,
    contact: str | None = None,
    effects: EffectsLike = (),
    plate: str | None = None,
    impact_points: Sequence[tuple[float, float]] = (),
    sensors: Sequence[tuple[float, float]] = (),
    q: float = 10.0,
    frequencies: str | Sequence[float] | None = None,
    chain_height: Quantity = 0.0,
    coupled: bool = False,
) -> LaboratoryTwin:
    """The twin of the bench that ships with the software, without a store.

    Solved plates are kept below the current folder, as `pyroshock predict` keeps them.

    Parameters:
        bench: A TOML file that describes gun and plate; by default the shipped bench.
        modes: A CSV file with the measured modes of the plate; by default computed ones.
        contact: The contact model: a law ("hertz"), "prior", "registered" or "hybrid@3"; by default
            the model in use, else "prior".
        effects: Effects that act: ids of the catalogue with parameters in SI
            ("plate.damping:factor=2"), effects, or a diagnosis, whose likeliest cause acts.
        plate: The material of the mounted plate; by default that of the bench.
        impact_points: Places (x, y) of the impact points "#1", "#2" and so on in the outline of the
            plate, in m; by default those of the bench.
        sensors: Places (x, y) of acceleration_1, acceleration_2 and so on, in m; by default those
            of the bench.
        q: Q of the oscillators of the spectra, above 0.5.
        frequencies: The lines of the spectra in Hz, or "100:10000:6" for six lines an octave; by
            default that.
        chain_height: By how much the plate hangs higher than its drawing has it (lower: negative):
            in m, as text with a unit, or a quantity of pint; a multiple of the links of its chain,
            56 mm.
        coupled: Whether contact and plate are solved together, which needs "prior" or a law that is
            solved in time.

    Raises:
        NotFoundError: For an unknown material, effect or contact model.
        InvalidValueError: For a value that is out of its bounds, and a file with other content.
        StorageError: For a file that cannot be read.
    """
    from ..common.default_store import DEFAULT_DB

    return laboratory_twin(
        None,
        DEFAULT_DB,
        bench=bench,
        modes=modes,
        contact=contact,
        effects=effects,
        plate=plate,
        impact_points=impact_points,
        sensors=sensors,
        q=q,
        frequencies=frequencies,
        chain_height=chain_height,
        coupled=coupled,
    )


def laboratory_twin(store: Store | None, url: str, **arguments: Any) -> LaboratoryTwin:
    """The twin of a campaign's bench.

    Parameters:
        store: The store that has the campaign, its materials and adopted effects; None: the shipped
            bench.
        url: The address of the store, beside which models and solved plates lie.
        arguments: Those of `twin_request`, by name.

    Raises:
        LookupError: For an unknown campaign, material, effect or contact model.
        ValueError: For a value that is out of its bounds, and a file with other content.
    """
    return _built_twin(store, url, twin_request(python_name, **arguments))


def _built_twin(store: Store | None, url: str, request: TwinRequest) -> LaboratoryTwin:
    with models_extra():
        return LaboratoryTwin(twin_of(store, url, request), store, url, request)
