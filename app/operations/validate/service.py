"""How far the predictions of the twin can be trusted, as notebooks see it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...common.frames import axes_or_new, frame_of, titled_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....schema.session import Store
    from ...common.progress import Step
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
        frame = self.to_frame()[::-1]
        axes = axes_or_new(ax, height=1.0 + 0.35 * max(len(frame), 2))
        axes.axvline(0.9, color="0.7", lw=1, zorder=0)
        for place, (_, row) in enumerate(frame.iterrows()):
            axes.plot(
                [row["coverage90_low"], row["coverage90_high"]], [place, place], color="0.6", lw=2
            )
            axes.plot(row["coverage90"], place, "o", color="#1b6ca8")
        axes.set_yticks(range(len(frame)), [str(name).replace("_", " ") for name in frame.index])
        axes.set(xlim=(0.0, 1.02), xlabel="share of shots inside the 90 % band")
        return axes

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
    from ...common.model_registry import models_extra
    from .validation import ValidationRequest, run_validation

    request = ValidationRequest(campaign, folds=folds, draws=draws, seed=seed, contact=contact)
    with models_extra():
        return TwinValidation(run_validation(store, url, request, step))
