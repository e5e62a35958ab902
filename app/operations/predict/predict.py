"""Predict a shot, or every shot of a plan or of a table; and what can be set of a shot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..faults import about_field
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result
from .request import NONE, PredictionRequest, PredictionsRequest

if TYPE_CHECKING:
    from ....schema.session import Store
    from ....twin.prediction import Prediction
    from ...twins.building import BuiltTwin
    from .batch import PredictedShots
    from .same_setting import MeasuredRange
    from .service import ShotPrediction


def check(request: PredictionsRequest, laboratory: Laboratory) -> None:
    """Raises `LookupError` for names that store and bench do not have, and as
    `ShotRequest.check_gun`: to solve a plate before it is told takes up to half a minute."""
    request.check_names(laboratory)
    if request.plan is not None:
        from ....doe.plans import read_plan

        with laboratory.store.reading() as session, about_field("plan"):
            read_plan(session, request.plan)
    elif request.shots is None:
        _check_shot(request, laboratory)


def _check_shot(request: PredictionsRequest, laboratory: Laboratory) -> None:
    from ....dataset.rows import material_named, stored_materials

    with laboratory.store.reading() as session:
        materials = stored_materials(session)
        for field in ("tip_material", "anvil_material"):
            name = getattr(request, field)
            if name.lower() != NONE or field == "tip_material":
                with about_field(field):
                    material_named(materials, name)
        if request.bench is not None or request.modes is not None:
            return  # their gun and points are read with the twin
        from ....twin.plate.modal import get_impact_point
        from ...twins.benches import bench_of_campaign

        bench = bench_of_campaign(session, request.campaign)
        request.check_gun(bench)
        with about_field("impact_position"):
            get_impact_point(bench.impact_points(request.impact_at), request.impact_position)


def _run(
    request: PredictionsRequest, laboratory: Laboratory, progress: Progress
) -> ShotPrediction | PredictedShots:
    if request.is_table:
        return _table(request, laboratory, progress)
    from .predicting import predict_shot
    from .service import ShotPrediction

    with request.twin_request() as twin:
        built = laboratory.twin(twin)
    prediction = predict_shot(built, request, draws=request.draws, seed=request.seed)
    return ShotPrediction(built, prediction, _measured(laboratory.store, built, prediction))


def _measured(
    store: Store | None, built: BuiltTwin, prediction: Prediction
) -> Mapping[str, MeasuredRange]:
    """What shots of the twin's bench measured at this setting; nothing of the shipped bench."""
    from .nearest_shots import setting_values, shots_of
    from .same_setting import measured_ranges, shots_of_setting

    if store is None or built.bench.campaign is None:
        return {}
    shots = shots_of_setting(setting_values(prediction.setting), shots_of(store, built))
    return measured_ranges(prediction, shots)


def _table(
    request: PredictionsRequest, laboratory: Laboratory, progress: Progress
) -> PredictedShots:
    from .batch import PredictedShots, bench_of_rows, predict_batch, rows_of_plan, rows_of_text

    if request.plan is not None:
        rows = rows_of_plan(laboratory.store, request.plan)
    else:
        assert request.shots is not None
        rows = rows_of_text(request.shots)
    with request.twin_request() as twin:
        bench, rows, remarks = bench_of_rows(
            laboratory.store, laboratory.twin, twin, rows, request.draws, request.seed
        )
    shots = predict_batch(bench, rows, laboratory.executor, progress)
    return PredictedShots(shots, remarks, request.plan)


def _needs_table(request: PredictionsRequest) -> str:
    if request.is_table:
        return ""
    return "--out and --spectra go with --plan or --shots; one shot prints, or --json FILE"


def _needs_one_shot(request: PredictionsRequest) -> str:
    return "--plot: of one shot; with --plan or --shots leave it out" if request.is_table else ""


_TABLES = (".csv", ".parquet")

PREDICT: Operation[PredictionsRequest, Any] = Operation(
    name="predict",
    request=PredictionsRequest,
    run=_run,
    check=check,
    help="""Predict velocity, force, acceleration and shock response spectrum of one shot, with 90 %
bands.

The first line says what the bands rest on. If a quantity lies beyond the shots that the model
learned from, their range stands beside the number. Without a store, the bench that ships with the
software is taken. The contact model is the one in use for the kind of the campaign. A factor that
no stage uses is an error.""",
    example="pyroshock predict --tank-pressure 5bar --bullet-mass 0.5kg --tip steel\n"
    "pyroshock predict --velocity 8m/s --tip steel --effect plate.damping:factor=2 "
    "--plot shot.png\n"
    "pyroshock predict --plan slow-valve --draws 8 --out predicted.csv",
    route=("GET", "/predict"),
    also_posted=True,
    steps="shots",
    needs_store=False,
    without_store="the bench that ships with the software",
    workers="Set the number of processes, for many shots.",
    outputs=(
        Output(
            "plot",
            "Draw the prediction into FILE (.png, .svg, .pdf).",
            Result.write_figure,
            refused=_needs_one_shot,
        ),
        Output(
            "out",
            "Write the predicted figures of many shots to FILE.csv or FILE.parquet.",
            lambda predicted, path: predicted.write_figures(path),
            _TABLES,
            in_place_of_tables=True,
            refused=_needs_table,
        ),
        Output(
            "spectra",
            "Write the predicted spectra of many shots to FILE.csv or FILE.parquet.",
            lambda predicted, path: predicted.write_spectra(path),
            _TABLES,
            refused=_needs_table,
        ),
    ),
    absent={"form": "The page of the twin asks for the prediction while its controls move."},
)


@dataclass(frozen=True)
class TwinControls(Result):
    """What can be set of a shot (`controls.sliders`), and what the twin is made of."""

    controls: Mapping[str, Any]

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return dict(self.controls)


def _controls(request: PredictionRequest, laboratory: Laboratory, _: Progress) -> TwinControls:
    from .controls import sliders

    with request.twin_request() as twin:
        built = laboratory.twin(twin)
    made_of = {"plate": built.plate.name, "campaign": built.bench.campaign}
    return TwinControls({**sliders(built), "notes": list(built.notes), **made_of})


TWIN: Operation[PredictionRequest, TwinControls] = Operation(
    name="twin",
    request=PredictionRequest,
    run=_controls,
    help="What can be set of a shot, in which ranges, what the model knows of it, and what the "
    "twin is made of.",
    route=("GET", "/twin"),
    needs_store=False,
    absent={
        "command": "The help of `predict` says what can be set.",
        "form": "The page of the twin shows them as its controls.",
    },
)
