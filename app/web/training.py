"""What a campaign's pulses become, as jobs: models trained on a dataset, and pulses cut anew."""

from __future__ import annotations

from ...dataset.snapshot import read_snapshot
from ...ingest.settings import ExtractionSettings
from ...schema.listings import get_campaign_id
from ...schema.session import Store
from ..jobs.kinds.extract import EXTRACT, ExtractArguments
from ..jobs.kinds.train import TRAIN, TrainArguments
from ..jobs.queue import JobView
from ..models.training import splits_of
from .jobs import Jobs


def train_job(jobs: Jobs, store: Store, asked: TrainArguments) -> JobView:
    """Queue a training; its result is `train --json`. Raises `LookupError`, `ValueError` for what there is not."""
    splits_of(read_snapshot(store, asked.dataset).table, asked.split)
    return jobs.ask(store, TRAIN, f"Training on {asked.dataset}", asked)


def extract_job(jobs: Jobs, store: Store, campaign: str, settings: ExtractionSettings) -> JobView:
    """Queue an extraction; its result is `extract --json`. Raises `LookupError` for an unknown campaign."""
    with store.reading() as session:
        get_campaign_id(session, campaign)
    arguments = ExtractArguments(campaign, settings.as_json())
    return jobs.ask(store, EXTRACT, f"Extraction of {campaign}", arguments)
