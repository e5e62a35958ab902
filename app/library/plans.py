"""Plans of campaigns as notebooks make and read them: `store.plan.lhs("summer", runs=105)`."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...doe.plans import StoredPlan, list_plans, read_plan
from ...files.spreadsheet_guard import guarded_frame
from ...schema.session import Store
from ..common.errors import raises_library_errors
from ..common.frames import frame_of
from ..doors.python import PythonMethod, StoreAnswers
from ..operations.diagnose.plan_next_runs import DISCRIMINATE, NextRunsRequest
from ..operations.plan.make import PLAN, REQUESTS
from ..operations.plan.service import PlannedDesign
from ..operations.plan.status import NamedPlan
from ..operations.shot_predictions.predict_runs import (
    PLAN_PREDICT,
    PlanPredictionRequest,
    PredictedPlan,
)
from ..operations.shot_predictions.predicted_runs import PLAN_PREDICTIONS, PlanForecasts

if TYPE_CHECKING:
    import pandas as pd

    from ..doors.python import Answers, BoundMethod


class PlanCollection:
    """The plans of a store, and the methods to make one: `lhs`, `sobol`, `halton`, `factorial`,
    `subset`, `fractional_factorial`, `plackett_burman`, `central_composite`, `box_behnken`,
    `optimal` and `from_table`.

    Each design is put in an order of run with few changeovers, gets its tank pressures, is held
    against the limits of the bench, and is stored under its name. All methods raise
    `InvalidValueError` for what the factors do not allow, a name in use, and runs beyond the bench.
    """

    def __init__(self, store: Store, url: str) -> None:
        self.store, self.url = store, url
        self.answers: Answers = StoreAnswers(store, url)

    @raises_library_errors
    def list(self) -> pd.DataFrame:
        """A row for each plan, with its method and its counts of runs by state."""
        return frame_of(self._rows(), ("name", "kind", "method", "seed", "runs"))

    def _rows(self) -> Sequence[Mapping[str, Any]]:
        with self.store.reading() as session:
            return list_plans(session)

    @raises_library_errors
    def open(self, name: str) -> PlannedDesign:
        """A stored plan.

        Parameters:
            name: The name of the plan.

        Raises:
            NotFoundError: For an unknown plan; the message names those there are.
        """
        return PlannedDesign(self._plan(name))

    def _plan(self, name: str) -> StoredPlan:
        with self.store.reading() as session:
            return read_plan(session, name)

    def from_table(
        self, name: str, *, table: str | os.PathLike[str] | pd.DataFrame, **settings: Any
    ) -> PlannedDesign:
        """Somebody else's design, in its order.

        Parameters:
            name: The name under which the plan is stored.
            table: The path of a CSV file, or a DataFrame, with `run` and a column for each factor,
                in its unit.
            settings: Those of `pyroshock plan import`.

        Raises:
            InvalidValueError: For a table that cannot be read, a level that no factor has, and a
                name in use.
        """
        given: Any = table
        if not isinstance(table, str | os.PathLike):
            buffer = io.StringIO()
            guarded_frame(table).to_csv(buffer, index=False)
            given = {"name": "table.csv", "text": buffer.getvalue()}
        elif not isinstance(table, str):
            given = Path(table)
        make: Callable[..., PlannedDesign] = _METHODS["import"].__get__(self)
        return make(name, given, **settings)

    #: The runs that tell apart the causes which a diagnosis could not tell apart.
    discriminate = PythonMethod(NextRunsRequest, DISCRIMINATE)

    #: Predict the runs of a plan before they are shot, and store what was predicted.
    predict: PythonMethod[PredictedPlan] = PythonMethod(PlanPredictionRequest, PLAN_PREDICT)

    #: What was predicted of a plan's runs before their shots, beside what was measured.
    predictions: PythonMethod[PlanForecasts] = PythonMethod(NamedPlan, PLAN_PREDICTIONS)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> BoundMethod[PlannedDesign]: ...


_METHODS: dict[str, PythonMethod[PlannedDesign]] = {
    name: PythonMethod(request, PLAN) for name, request in REQUESTS.items()
}
for _name, _method in _METHODS.items():
    _identifier = _name.replace("-", "_")
    _method.__set_name__(PlanCollection, _identifier)
    if _name != "import":  # no word that Python takes: `from_table`
        setattr(PlanCollection, _identifier, _method)
