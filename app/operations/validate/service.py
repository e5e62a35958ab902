"""How far the predictions of the twin can be trusted, as notebooks see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.frames import frame_of, titled_table
from ...figures.figure import DIMENSIONLESS, Figure, Plot, PlotAxis, PointSeries, ReferenceLine
from ...figures.matplotlib_renderer import plot_on
from ..operation import Lines, Result, ResultTable
from ..sentence import Sentence
from .validation import adopted_lines, reason_lines, score_rows
from .verdict import failure_sentences, verdict_sentences

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....schema.session import Store
    from ...common.progress import Step
    from .request import ValidationRequest
    from .validation import Validation


@dataclass(frozen=True, eq=False)
class TwinValidation(Result):
    """Measured shots beside predictions that had not seen them; `validation` is the record behind
    it."""

    validation: Validation

    @cached_property
    def _data(self) -> dict[str, Any]:
        return self.validation.as_json()

    def notes(self) -> Sequence[str]:
        """Which shots were not compared, and what was assumed."""
        left_out = (f"not compared: {line}" for line in reason_lines(self._data["left_out"]))
        return (*left_out, *self._data["notes"])

    def sentences(self) -> Sequence[Sentence]:
        """The verdict, and what the predictions had seen."""
        seen = Sentence(f"What the predictions had seen: {self._data['seen']}.")
        return (*verdict_sentences(self._data), seen)

    def tables(self) -> Sequence[ResultTable | Lines]:
        """The scores, where the predictions fail, and the errors with adopted effects."""
        return (
            ResultTable("", list(score_rows(self._data))),
            Lines("Where the predictions fail", failure_sentences(self._data)),
            Lines("With the adopted effects", adopted_lines(self._data)),
        )

    @property
    def exit_code(self) -> int:
        """1 where the bands are too narrow."""
        return 0 if self.calibrated else 1

    def summary(self) -> str:
        """The campaign and the verdict."""
        return f"{self.validation.campaign}: {self.sentence}"

    def next_command(self) -> Sequence[str]:
        """What a twin that is trusted is used for, or what finds the cause."""
        if self.calibrated:
            return ("tune", "--target", "SPEC.csv", "--measured", self.validation.campaign)
        return ("diagnose", self.validation.campaign)

    @property
    def sentence(self) -> str:
        """The verdict: whether the 90 % bands hold what they promise."""
        return str(self._data["verdict"])

    @property
    def calibrated(self) -> bool:
        """Whether the 90 % bands are wide enough."""
        return bool(self._data["calibrated"])

    def to_frame(self) -> pd.DataFrame:
        """A quantity in each row: shots, shares inside the 50 % and 90 % bands, errors (natural
        logarithms or dB)."""
        rows: list[dict[str, Any]] = []
        for row in self.to_json()["quantities"]:
            rows.append({name: value for name, value in row.items() if not isinstance(value, list)})
            for band in ("coverage50", "coverage90", "coverage90_joint"):
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
        return self._data

    def figures(self) -> Sequence[Figure]:
        """The share of shots inside the 90 % band of each quantity."""
        return (self.figure(),)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The share of shots inside the 90 % band of each quantity, with the 95 % interval that the
        quantities share, beside what is promised.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The share of shots inside the 90 % band of each quantity, as a figure."""
        frame = self.to_frame()
        shares = PointSeries(
            frame["coverage90"].to_numpy(dtype=np.float64),
            np.arange(len(frame), dtype=np.float64),
            x_low=frame["coverage90_joint_low"].to_numpy(dtype=np.float64),
            x_high=frame["coverage90_joint_high"].to_numpy(dtype=np.float64),
            detail="share, with the 95 % interval that the quantities share",
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


def validate_twin(store: Store, url: str, request: ValidationRequest, step: Step) -> TwinValidation:
    """Measured shots beside predictions that had not seen them.

    Parameters:
        store: The store that has the campaign.
        url: Its address, beside which models and solved plates lie.
        request: The campaign and the twin.
        step: Receives the progress.

    Raises:
        LookupError: For an unknown campaign or contact model.
        ValueError: For a campaign without shots that can be compared.
    """
    from ...common.model_registry import models_extra
    from .validation import run_validation

    with models_extra():
        return TwinValidation(run_validation(store, url, request, step))
