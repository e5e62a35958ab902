"""Extract the pulses of a campaign again with other settings, from the stored series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any
from urllib.parse import quote

from ....ingest.storing.reextraction import ReextractionReport, reextract
from ....schema.conditions import get_campaign_id
from ....schema.person_roles import ENGINEER
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Result
from .request import ExtractionChoice, NamedCampaign


class Extraction(ExtractionChoice, NamedCampaign):
    """A campaign whose pulses are extracted again."""


@dataclass(frozen=True)
class ExtractedPulses(Result):
    """What changed in the store."""

    report: ReextractionReport

    def notes(self) -> Sequence[str]:
        """Counts of pulses, and recordings that were left as they were."""
        return (
            f"{self.report.campaign}: {self._counts()}",
            *(
                f"  left as it was: {item['recording']}: {item['reason']}"
                for item in self.report.skipped
            ),
        )

    def to_json(self) -> dict[str, Any]:
        """Counts, and the recordings that were skipped."""
        return asdict(self.report)

    def address(self) -> str:
        """The page of the campaign."""
        return f"/campaigns/{quote(self.report.campaign, safe='')}"

    def summary(self) -> str:
        """Counts of pulses and of what was left as it was."""
        skipped = len(self.report.skipped)
        return self._counts() + (f"; {skipped} recordings left as they were" if skipped else "")

    def next_command(self) -> Sequence[str]:
        """A dataset with the new pulses."""
        return ("dataset", "build", self.report.campaign, "--from", self.report.campaign)

    def _counts(self) -> str:
        return (
            f"{self.report.added} pulses extracted, {self.report.reused} earlier ones put back in "
            "use"
        )


def _is_stored(request: Extraction, laboratory: Laboratory) -> None:
    """Raises `LookupError` for an unknown campaign."""
    with laboratory.store.reading() as session:
        get_campaign_id(session, request.campaign)


def _extract(request: Extraction, laboratory: Laboratory, progress: Progress) -> ExtractedPulses:
    report = reextract(
        laboratory.store,
        request.campaign,
        request.settings(),
        progress,
        executor=laboratory.executor,
    )
    return ExtractedPulses(report)


EXTRACT: Operation[Extraction, ExtractedPulses] = Operation(
    name="extract",
    role=ENGINEER,
    request=Extraction,
    run=_extract,
    check=_is_stored,
    help="""Extract the pulses of a campaign again from the stored series, with other settings.

The new version of the pulses is in use from then on. The old versions stay, and `pyroshock show`
lists them. The same settings again put their version back in use.""",
    example="pyroshock extract rehearsal --segmentation mask --threshold 0.01",
    route=("POST", "/campaigns/{campaign}/extract"),
    long=True,
    steps="recordings",
    workers="Set the number of processes that extract pulses.",
    form=FormPage(
        "/campaigns/{campaign}/extract?"
        + "&".join(f"{name}={{{name}}}" for name in ExtractionChoice.model_fields),
        "",
        "/campaigns/{campaign}/extract",
    ),
)
