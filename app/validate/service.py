"""How far the predictions of the twin can be trusted, as notebooks see it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.frames import frame_of, titled_table
from ..figures.figure import DIMENSIONLESS, Plot, PlotAxis, PointSeries, ReferenceLine
from ..figures.matplotlib_renderer import plot_on

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...schema.session import Store
    from ..common.progress import Step
    from .validation import Validation


@dataclass(frozen=True, eq=False)
class TwinValidation:
    """Measured shots beside predictions that had not seen them; `validation` is the record behind
    it."""

    validation: Validation

    @property
    def sentence(self) -> str:
        """The verdict: whether the 90 % bands hold what they promise."""
        return self.validation.verdict.sentence

    @property
    def calibrated(self) -> bool:
        """Whether the 90 % bands are wide enough."""
        return self.validation.verdict.calibrated

    def to_frame(self) -> pd.DataFrame:
        """A quantity in each row: shots, shares inside the 50 % and 90 % bands, errors (natural
        logarithms or dB)."""
        rows: list[dict[str, Any]] = []
        for row in self.to_json()["quantities"]:
            rows.append({name: value for name, value in row.items() if not isinstance(value, list)})
            for band in ("coverage50", "coverage90"):
                rows[-1][f"{band}_low"], rows[-1][f"{band}_high"] = row[f"{band}_ci95"]
        return frame_of(rows).set_index("name")

    @property
    def scores(self) -> pd.DataFrame:
        """As `to_frame`."""
        return self.to_frame()

    @property
    def shots(self) -> pd.DataFrame:
        """A measured shot and quantity in each row: measured and predicted value, 90 % band (SI),
        rank among draws."""
        rows = (
            {
                "shot": shot["shot"],
                "configuration": shot["configuration"],
                "quantity": name,
                **values,
            }
            for shot in self.to_json()["shots"]
            for name, values in shot["quantities"].items()
        )
        return frame_of(
            rows,
            (
                "shot",
                "configuration",
                "quantity",
                "measured",
                "predicted",
                "low90",
                "high90",
                "rank",
            ),
        )

    @property
    def failures(self) -> tuple[str, ...]:
        """Where the predictions fail, in sentences."""
        return tuple(failure.sentence for failure in self.validation.failures)

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock validate --json` prints it."""
        return self.validation.as_json()

    def plot(self, ax: Axes | None = None) -> Axes:
        """The share of shots inside the 90 % band of each quantity, with its 95 % interval, beside
        what is promised."""
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The share of shots inside the 90 % band of each quantity, as a figure."""
        frame = self.to_frame()
        shares = PointSeries(
            frame["coverage90"].to_numpy(dtype=np.float64),
            np.arange(len(frame), dtype=np.float64),
            x_low=frame["coverage90_low"].to_numpy(dtype=np.float64),
            x_high=frame["coverage90_high"].to_numpy(dtype=np.float64),
            detail="share, with its 95 % interval",
        )
        names = tuple(str(name).replace("_", " ") for name in frame.index)
        share = "share of shots inside the 90 % band"
        return Plot(
            f"Validation of {self.validation.campaign}",
            PlotAxis(share, DIMENSIONLESS, limits=(0.0, 1.02)),
            PlotAxis("quantity", DIMENSIONLESS, categories=names, reversed=True),
            (shares,),
            (ReferenceLine("x", 0.9),),
            height=96 + 30 * max(len(names), 2),
        )

    def __repr__(self) -> str:
        return f"<{self.validation.campaign}: {self.sentence}>"

    def _repr_html_(self) -> str:
        columns = ["unit", "shots", "coverage50", "coverage90", "median_abs_error", "crps"]
        return titled_table(
            f"{self.validation.campaign}: {self.sentence}", self.to_frame()[columns]
        )


def validate_twin(
    store: Store,
    url: str,
    campaign: str,
    contact: str | None,
    folds: int,
    draws: int,
    seed: int,
    step: Step,
) -> TwinValidation:
    """Raises as `validating.validation.validated`."""
    from ..common.model_registry import models_extra
    from .validation import ValidationRequest, run_validation

    request = ValidationRequest(campaign, folds=folds, draws=draws, seed=seed, contact=contact)
    with models_extra():
        return TwinValidation(run_validation(store, url, request, step))
