"""The pulses of a campaign cut anew: a version of the same settings is put back in use, not made twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

from ..work import Ending, Result, RunningJob
from .base import Kind, told


@dataclass(frozen=True)
class ExtractArguments:
    """`settings` as `ExtractionSettings.as_json`; what is left out is as usual."""

    campaign: str
    settings: Mapping[str, Any] = field(default_factory=dict)


def _do(work: RunningJob, asked: ExtractArguments) -> Ending:
    from ....ingest.reextraction import reextract
    from ....ingest.settings import ExtractionSettings

    report = reextract(work.store, asked.campaign, ExtractionSettings(**asked.settings), work.step)
    skipped_text = f"; {len(report.skipped)} recordings left as they were" if report.skipped else ""
    words = f"{report.added} pulses cut, {report.reused} earlier ones put back in use{skipped_text}"
    return told(Result(f"/campaigns/{quote(asked.campaign, safe='')}", words, report.as_json()))


EXTRACT = Kind("extract", ExtractArguments, _do)
