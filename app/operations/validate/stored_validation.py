"""What the newest validation of a campaign found, beside a prediction for its bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select
from sqlalchemy.orm import undefer

from ....schema.job_results import data_of
from ....schema.jobs import DONE, Job
from ....validation.prediction_scores.failure_rules import EVERYWHERE
from ...common.number_format import join_words, percent
from ..sentence import Sentence
from .verdict import (
    DEVIATES,
    is_calibrated,
    joint_interval,
    prediction_deviation,
    quantity_words,
    verdict_sentences,
)

if TYPE_CHECKING:
    from ....schema.session import Store

#: Operation whose jobs are validations.
_KIND = "validate"
#: So many of the newest validations are looked through.
_MOST = 200


@dataclass(frozen=True)
class StoredValidation:
    """A finished validation: the key of its job, its arguments, and its result as `validate --json`
    prints it."""

    key: int
    contact: str | None
    data: Mapping[str, Any]

    @property
    def address(self) -> str:
        """Its page."""
        return f"/validations/{self.key}"

    @property
    def doubted(self) -> bool:
        """Whether it found bands that are too narrow, or predictions that are off."""
        return not is_calibrated(self.data) or any(self._failures())

    def sentences(self) -> Iterator[Sentence]:
        """Whether the bands hold, and which quantities are predicted wrong in all shots."""
        yield verdict_sentences(self.data)[0]
        yield from self._failures()

    def _failures(self) -> Iterator[Sentence]:
        """The mean deviations that chance does not explain, in one sentence."""
        failed = {
            own["quantity"]: own
            for own in self.data["failures"]
            if own.get("rule") == EVERYWHERE and "p_value" in own
        }
        rows = [row for row in self.data["quantities"] if row["name"] in failed]
        if not rows:
            return
        listed = join_words(
            [
                f"{prediction_deviation(row['bias'], row['unit'])} ({quantity_words(row['name'])})"
                for row in rows
            ]
        )
        largest = max((failed[row["name"]] for row in rows), key=lambda own: float(own["p_value"]))
        yield Sentence(
            f"Over all shots the predictions deviate from the measured values by {listed} in the "
            "mean.",
            (),
            DEVIATES,
            {"bias": largest["bias"], "p_value": largest["p_value"]},
        )

    def rows(self) -> list[dict[str, str]]:
        """The shares inside of the bands with their intervals, and the mean deviations."""
        quantities = self.data["quantities"]
        rows = []
        for row in quantities:
            low, high = joint_interval(row, len(quantities))
            rows.append(
                {
                    "quantity": quantity_words(row["name"]),
                    "shots": str(row["shots"]),
                    "inside 90 % band": percent(row["coverage90"]),
                    "at least": percent(low),
                    "at most": percent(high),
                    "mean deviation of the prediction": prediction_deviation(
                        row["bias"], row["unit"]
                    ),
                }
            )
        return rows


def newest_validation(store: Store, campaign: str | None) -> StoredValidation | None:
    """The newest finished validation on a campaign; None where there is none."""
    if campaign is None:
        return None
    query = (
        select(Job)
        .where(Job.kind == _KIND, Job.state == DONE)
        .order_by(Job.id.desc())
        .limit(_MOST)
        .options(undefer(Job.arguments))
    )
    with store.reading() as session:
        for job in session.scalars(query):
            data = data_of(job.result) if job.arguments.get("campaign") == campaign else None
            if data:
                return StoredValidation(job.id, job.arguments.get("contact"), dict(data))
    return None
