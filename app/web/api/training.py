"""Trainings and extractions: each answers with its job."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ....ingest.settings import ExtractionSettings
from ...jobs.kinds.train import TrainArguments
from ..dependencies import Name, OpenStore, Running, Text
from ..training import extract_job, train_job

router = APIRouter(tags=["models"])


class TrainingOptions(BaseModel):
    """As the options of `pyroshock train`; what is registered already is not trained again."""

    dataset: Text = Field(max_length=1000)
    models: Text = Field("all", max_length=1000, description="names with commas between them, or all")
    split: Text = Field("repetitions,configurations", max_length=1000)
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    budget: Literal["reduced", "full"] = "reduced"

    def asked(self) -> TrainArguments:
        """Raises `ValueError` for a model that there is not."""
        from ....training.models.catalogue import models_of

        return TrainArguments(self.dataset, list(models_of(self.models)), self.split, self.seed, self.budget)


class RepeatedExtraction(BaseModel):
    """As the options of `pyroshock extract`."""

    segmentation: Literal["walk", "mask"] = "walk"
    threshold: float = 0.005
    smoothing: float = 0.99


@router.post("/train")
def train(asked: TrainingOptions, store: OpenStore, running: Running) -> dict[str, Any]:
    """Train models on a dataset; answers with the job, whose result is `train --json`."""
    return train_job(running, store, asked.asked()).as_json()


@router.post("/campaigns/{name}/extract")
def extract(name: Name, asked: RepeatedExtraction, store: OpenStore, running: Running) -> dict[str, Any]:
    """Cut a campaign's pulses anew; answers with the job, whose result is `extract --json`."""
    return extract_job(running, store, name, ExtractionSettings(**asked.model_dump())).as_json()
