"""What was predicted of a plan's runs before their shots, beside what was measured: whether the
90 % bands hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ....schema.run_predictions import QUANTITIES
from ...common.number_format import percent
from ...common.run_forecasts import (
    ComparedShot,
    MeasuredHit,
    RunForecast,
    compared_with,
    comparison_rows,
    forecasts_of,
    hits_of_runs,
    quantity_label,
)
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result, ResultTable
from ..plan.status import NamedPlan
from ..sentence import (
    HOLDS,
    NOT_ENOUGH,
    TOO_NARROW,
    TOO_WIDE,
    Interval,
    Number,
    Sentence,
    first_allowed,
    sentence,
)

if TYPE_CHECKING:
    import pandas as pd

    from ....schema.session import Store
    from ....validation.prediction_scores.quantity_score import Coverage
    from ...figures.figure import Figure, Plot

#: The share of shots that a 90 % band promises to hold.
NOMINAL = 0.90


@dataclass(frozen=True)
class BandTest:
    """How many shots lie in the 90 % band of one quantity. `interval` is the 95 % interval of the
    share, where all quantities of the plan share the 5 % of errors; `count` independent values
    would give it, and `needed` are needed before bands are said to hold."""

    quantity: str
    shots: int
    runs: int
    inside: int
    interval: tuple[float, float]
    count: int
    needed: int

    @property
    def share(self) -> float:
        """The part of the shots that lies in the band."""
        return self.inside / self.shots

    def sentence(self) -> Sentence:
        """What the number of shots says of the band."""
        label = quantity_label(self.quantity)
        counted = (
            "Of {shots} shot{plural}, {inside} {lie} in the 90 % band of the "
            + label
            + " ({share}; 95 % interval {interval})"
        )
        evidence = {
            "interval": self.interval,
            "level": NOMINAL,
            "count": self.count,
            "needed": self.needed,
        }
        return first_allowed(
            evidence,
            (
                TOO_NARROW,
                counted + ": the band is too narrow, for the interval lies below 90 %.",
            ),
            (TOO_WIDE, counted + ": the band is wider than needed."),
            (
                NOT_ENOUGH,
                counted + ": too few shots to say whether the band holds. They are as good as "
                "{count} independent ones, and {needed} are needed.",
            ),
            (HOLDS, counted + ": the band holds, as far as these shots can tell."),
            shots=Number("shots", self.shots, "count"),
            plural="" if self.shots == 1 else "s",
            lie="lies" if self.inside == 1 else "lie",
            inside=Number("inside", self.inside, "count"),
            share=Number("share", self.share, "share"),
            interval=Interval("interval", *self.interval),
            count=Number("independent", self.count, "count"),
            needed=Number("needed", self.needed, "count"),
        )

    def row(self) -> dict[str, Any]:
        """The numbers of the sentence, as cells."""
        return {
            "quantity": quantity_label(self.quantity),
            "shots": self.shots,
            "runs": self.runs,
            "in the 90 % band": self.inside,
            "share": percent(self.share),
            "95 % interval": Interval("interval", *self.interval).cell,
            "independent values": self.count,
            "needed": self.needed,
        }

    def as_json(self) -> dict[str, Any]:
        """The same for programs."""
        return {
            "quantity": self.quantity,
            "shots": self.shots,
            "runs": self.runs,
            "inside": self.inside,
            "share": self.share,
            "interval_ci95": list(self.interval),
            "independent_values": self.count,
            "needed": self.needed,
        }


@dataclass(frozen=True, eq=False)
class PlanForecasts(Result):
    """The predictions that count of a plan's runs, and the shots that were compared with them.

    `left_out` is the number of shots of predicted runs that a check rejects, `unpredicted` that of
    accepted shots of runs without a prediction that was made before.
    """

    plan: str
    forecasts: Sequence[RunForecast]
    shots: Sequence[ComparedShot]
    left_out: int = 0
    unpredicted: int = 0

    @cached_property
    def tests(self) -> tuple[BandTest, ...]:
        """How many shots lie in the band of each quantity."""
        return tuple(_tests(self.shots))

    def notes(self) -> Sequence[str]:
        """What is not compared."""
        lines = []
        if self.left_out:
            lines.append(f"left out: shots that a check rejects ({self.left_out})")
        if self.unpredicted:
            lines.append(
                "left out: shots of runs without a prediction that was made before the first of "
                f"them was stored ({self.unpredicted})"
            )
        return lines

    def sentences(self) -> Sequence[Sentence]:
        """How many runs are predicted, and of each quantity whether the band holds."""
        runs = Number("runs", len(self.forecasts), "count")
        if not self.forecasts:
            return (
                sentence("No run of plan {plan} was predicted before its shot.", plan=self.plan),
            )
        if not self.tests:
            return (
                sentence(
                    "{runs} runs of plan {plan} are predicted, and none of them is shot.",
                    runs=runs,
                    plan=self.plan,
                ),
            )
        return tuple(test.sentence() for test in self.tests)

    def tables(self) -> Sequence[ResultTable]:
        """The tests of the bands, then a row for each shot and quantity, then the predictions."""
        return (
            ResultTable("Tests of the 90 % bands", self.test_rows(), "no shot to compare"),
            ResultTable("Predicted and measured", self.shot_rows(), "no shot to compare"),
            ResultTable("Predictions", self.forecast_rows(), "no run is predicted"),
        )

    def test_rows(self) -> list[dict[str, Any]]:
        """A row for each quantity, as people read it."""
        return [test.row() for test in self.tests]

    def shot_rows(self) -> list[dict[str, Any]]:
        """A row for each shot and quantity, in the units of the field."""
        return [
            {"run": shot.run, "repetition": shot.repetition, "impact": shot.impact, **row}
            for shot in self.shots
            for row in comparison_rows(shot.quantities)
        ]

    def forecast_rows(self) -> list[dict[str, Any]]:
        """A row for each predicted run: when and with what it was predicted."""
        return [
            {
                "run": forecast.run,
                "predicted at (UTC)": f"{forecast.made_at:%Y-%m-%d %H:%M:%S}",
                "by": forecast.by,
                "models": forecast.model_words,
                "adopted": forecast.adopted_words,
                "warning": " ".join(forecast.warnings),
                "remark": " ".join(forecast.remarks),
            }
            for forecast in self.forecasts
        ]

    def figures(self) -> Sequence[Figure]:
        """Measured values beside the bands, by quantity."""
        return tuple(self.plots().values())

    def plots(self) -> dict[str, Plot]:
        """Of each quantity, each shot beside its band, in the order of the runs."""
        from .figures import band_figure

        return {test.quantity: band_figure(test.quantity, self.shots) for test in self.tests}

    def plot(self, ax: Any = None, quantity: str | None = None) -> Any:
        """Measured values beside the bands of one quantity.

        Parameters:
            ax: The axes of matplotlib to draw on; by default new ones.
            quantity: The quantity, such as "velocity_m_s"; by default the first that was measured.

        Raises:
            NotFoundError: For a quantity that was not compared.
        """
        from ...common.errors import NotFoundError
        from ...figures.matplotlib_renderer import plot_on

        plots = self.plots()
        chosen = quantity or next(iter(plots), None)
        if chosen not in plots:
            raise NotFoundError(
                f"no compared quantity {chosen!r}; there are: {', '.join(plots) or 'none'}"
            )
        return plot_on(plots[chosen], ax)

    def to_frame(self) -> pd.DataFrame:
        """A row for each shot and quantity, SI: median, band, measured value, difference, rank."""
        from ...common.frames import frame_of

        rows = [
            {
                "run": shot.run,
                "repetition": shot.repetition,
                "impact": shot.impact,
                **comparison.as_json(),
                "made_at": shot.forecast.made_at.isoformat(),
                "models": shot.forecast.model_words,
            }
            for shot in self.shots
            for comparison in shot.quantities
        ]
        return frame_of(rows, ("run", "repetition", "impact", "quantity", "measured", "rank"))

    def to_json(self) -> dict[str, Any]:
        """The same for programs."""
        return {
            "plan": self.plan,
            "predictions": [
                {
                    **forecast.as_json(),
                    "quantities": {
                        band.quantity: {
                            "median": band.median,
                            "lower": band.lower,
                            "upper": band.upper,
                        }
                        for band in forecast.bands
                    },
                }
                for forecast in self.forecasts
            ],
            "shots": [
                {
                    "run": shot.run,
                    "repetition": shot.repetition,
                    "impact": shot.impact,
                    "quantities": [comparison.as_json() for comparison in shot.quantities],
                }
                for shot in self.shots
            ],
            "tests": [test.as_json() for test in self.tests],
            "rejected_shots": self.left_out,
            "unpredicted_shots": self.unpredicted,
        }


def _tests(shots: Sequence[ComparedShot]) -> Iterator[BandTest]:
    """A test for each quantity that was measured, those with columns of their own first."""
    if not shots:
        return  # and NumPy is not loaded for nothing
    import numpy as np

    from ....validation.prediction_scores.quantity_score import Coverage

    compared: dict[str, list[tuple[int, bool]]] = {}
    for shot in shots:
        for comparison in shot.quantities:
            compared.setdefault(comparison.band.quantity, []).append((shot.run, comparison.inside))
    for quantity in sorted(compared, key=_order):
        runs, inside = zip(*compared[quantity], strict=True)
        coverage = Coverage.of(np.array(inside, dtype=np.bool_), np.array(runs, dtype=np.intp))
        yield BandTest(
            quantity,
            len(runs),
            len(set(runs)),
            sum(inside),
            coverage.interval(len(compared)),
            int(coverage.effective + 1e-9),
            _needed(coverage, len(compared)),
        )


def _needed(coverage: Coverage, quantities: int) -> int:
    """Independent values below which nothing is said of bands that seem to hold."""
    from ..validate.verdict import needed_values

    return needed_values(quantities) if coverage.values else 0


def _order(quantity: str) -> tuple[int, str]:
    place = QUANTITIES.index(quantity) if quantity in QUANTITIES else len(QUANTITIES)
    return place, quantity


def plan_forecasts(store: Store, name: str) -> PlanForecasts:
    """The predictions of a plan beside its shots.

    Parameters:
        store: The store that has the plan.
        name: What the plan is called.

    Raises:
        UnknownPlanError: For a plan that there is not.
    """
    from sqlalchemy import select

    from ....doe.plans import read_plan
    from ....schema.campaigns import Plan, PlannedRun

    with store.reading() as session:
        stored = read_plan(session, name)
        query = select(PlannedRun.run, PlannedRun.id).join(Plan, PlannedRun.plan_id == Plan.id)
        keys = dict(iter(session.execute(query.where(Plan.name == name))))
        forecasts = forecasts_of(session, keys.values())
        hits = hits_of_runs(session, keys.values())
    return _compared(name, [keys[run.run] for run in stored.runs], forecasts, hits)


def _compared(
    plan: str,
    order: Sequence[int],
    forecasts: Mapping[int, RunForecast],
    hits: Sequence[MeasuredHit],
) -> PlanForecasts:
    places = {key: place for place, key in enumerate(order)}
    predicted = [hit for hit in hits if hit.planned_run in forecasts]
    shots = [
        ComparedShot(
            hit.run,
            hit.repetition,
            hit.impact,
            forecasts[hit.planned_run],
            compared_with(forecasts[hit.planned_run], hit),
        )
        for hit in sorted(predicted, key=lambda hit: (places[hit.planned_run], hit.repetition))
        if not hit.rejected
    ]
    return PlanForecasts(
        plan,
        [forecasts[key] for key in order if key in forecasts],
        shots,
        sum(hit.rejected for hit in predicted),
        sum(not hit.rejected for hit in hits if hit.planned_run not in forecasts),
    )


def _read(request: NamedPlan, laboratory: Laboratory, _: Progress) -> PlanForecasts:
    return plan_forecasts(laboratory.store, request.name)


def _nothing_to_draw(forecasts: PlanForecasts) -> str:
    return "" if forecasts.tests else "no shot of the plan was predicted before; nothing is drawn"


PLAN_PREDICTIONS: Operation[NamedPlan, PlanForecasts] = Operation(
    name="plan-predictions",
    request=NamedPlan,
    run=_read,
    help="""Show what was predicted of a plan's runs before their shots, beside what was measured.

Of each shot, the median, the 90 % band, the measured value, the difference and the rank of the
measured value among the predicted ones are listed. The share of shots in their band tests whether
the bands hold what they promise.""",
    example="pyroshock plan predictions rehearsal",
    command=("plan", "predictions"),
    route=("GET", "/plans/{name}/predictions"),
    outputs=(
        Output(
            "plot",
            "Draw the measured values beside the bands into FILE (.png, .svg, .pdf).",
            Result.write_figure,
            missing=_nothing_to_draw,
        ),
    ),
    absent={"form": "It changes nothing; the page of the plan shows it."},
)
