"""The digital twin of a bench for notebooks: predict a shot, many shots, or find settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any

from ..common.errors import argument_names, raises_library_errors
from ..common.frames import facts_table, step_bar, with_units
from ..common.model_registry import models_extra
from ..doors.python import with_arguments_of
from ..operations.faults import read_arguments
from ..operations.predict.described_twin import describe
from ..operations.predict.predicting import predict_shot
from ..operations.predict.request import DRAWS, DrawnShot, TwinOptions, effects_of
from ..twins.building import BuiltTwin, TwinRequest, twin_of

if TYPE_CHECKING:
    import pandas as pd

    from ...schema.session import Store
    from ...twin.srs.target import Target
    from ..common.progress import Step
    from ..operations.predict.batch import ShotRow
    from ..operations.predict.request import EffectsLike
    from ..operations.predict.service import ShotPrediction
    from ..operations.tune.request import SpectrumSearch
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
        self._described = describe(built)
        self._store, self._url = store, url

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, and what each stage rests on."""
        return tuple(argument_names(note) for note in self._described.notes if note)

    @property
    def rests_on(self) -> str:
        """What the bands of its predictions rest on, in one sentence."""
        return self._described.rests_on

    @property
    def models(self) -> dict[str, str]:
        """Stage -> the model or law that answers there."""
        return dict(self._described.models)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors on the plate."""
        return self._described.sensor_names

    @with_arguments_of(DrawnShot)
    @raises_library_errors
    def predict(self, **shot: Any) -> ShotPrediction:
        """One shot: velocity, force, accelerations and spectra with 90 % bands.

        Quantities are numbers in SI, text with a unit ("5 bar"), or quantities of pint.

        Raises:
            NotFoundError: For an unknown material or impact position.
            InvalidValueError: For both `tank_pressure` and `velocity`, a quantity in a wrong unit,
                and a factor that no stage of the twin uses.
        """
        return self._predict(read_arguments(DrawnShot, shot))

    def _predict(self, shot: DrawnShot) -> ShotPrediction:
        from ..operations.predict.service import ShotPrediction

        draws, seed = shot.draws, shot.seed
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

        from ..operations.predict.service import shot_rows

        rows = shot_rows(shots)
        with step_bar("predicting", "shots", progress) as step:
            figures, notes = self._predict_rows(rows, draws, seed, jobs, step)
        numbers = [
            {name: value for name, value in own.items() if name not in row.labels}
            for own, row in zip(figures, rows, strict=True)
        ]
        table = with_units(shots.reset_index(drop=True).join(pd.DataFrame(numbers)))
        table.attrs["notes"] = [argument_names(note) for note in notes]
        return table

    def _predict_rows(
        self, rows: Sequence[ShotRow], draws: int, seed: int, jobs: int, step: Step
    ) -> tuple[list[dict[str, Any]], Sequence[str]]:
        """The figures of each row, and what was assumed."""
        from ...parallel.executor import ExecutorConfig
        from ..operations.predict.batch import bench_of_rows, predict_batch

        bench, rows, notes = bench_of_rows(
            self._store, self._twin_of, self.request, rows, draws, seed
        )
        predicted = predict_batch(bench, rows, ExecutorConfig(jobs=jobs), step)
        return [shot.figures for shot in predicted], notes

    def _twin_of(self, request: TwinRequest) -> BuiltTwin:
        return self.built if request == self.request else _built(self._store, self._url, request)

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
        from ..operations.tune.service import target_of

        prescribed, request = target_of(target, tolerance), read(SpectrumSearch, search, "python")
        return self._search(prescribed, request, progress)

    def _search(self, target: Target, search: SpectrumSearch, progress: bool) -> TunedSettings:
        from ..operations.tune.service import search_settings

        with step_bar("tune", "settings", progress) as step:
            return search_settings(self._store, self._url, target, search, self.request, step)

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
        built = _built(self._store, self._url, request)
        return LaboratoryTwin(built, self._store, self._url, request)

    def __repr__(self) -> str:
        return (
            f"<twin of {self._bench()}: "
            f"{', '.join(f'{stage} {model}' for stage, model in self.models.items())}>"
        )

    def _repr_html_(self) -> str:
        notes = "".join(f"<p>{escape(note)}</p>" for note in (self.rests_on, *self.notes) if note)
        return facts_table(f"twin of {self._bench()}", self.models) + notes

    def _bench(self) -> str:
        campaign = self._described.bench.campaign
        return f"campaign {campaign}" if campaign else "the bench that ships with the software"


@with_arguments_of(TwinOptions)
@raises_library_errors
def shipped_twin(**options: Any) -> LaboratoryTwin:
    """The twin of the bench that ships with the software, without a store.

    Solved plates are kept below the current folder, as `pyroshock predict` keeps them.

    Raises:
        NotFoundError: For an unknown material, effect or contact model.
        InvalidValueError: For a value that is out of its bounds, and a file with other content.
        StorageError: For a file that cannot be read.
    """
    from ..common.default_store import DEFAULT_DB

    return laboratory_twin(None, DEFAULT_DB, **options)


def laboratory_twin(store: Store | None, url: str, **options: Any) -> LaboratoryTwin:
    """The twin of a campaign's bench.

    Parameters:
        store: The store that has the campaign, its materials and adopted effects; None: the shipped
            bench.
        url: The address of the store, beside which models and solved plates lie.
        options: The fields of `TwinOptions`, by name.

    Raises:
        LookupError: For an unknown campaign, material, effect or contact model.
        ValueError: For a value that is out of its bounds, and a file with other content.
    """
    with read_arguments(TwinOptions, options).twin_request() as request:
        return LaboratoryTwin(_built(store, url, request), store, url, request)


def _built(store: Store | None, url: str, request: TwinRequest) -> BuiltTwin:
    with models_extra():
        return twin_of(store, url, request)
