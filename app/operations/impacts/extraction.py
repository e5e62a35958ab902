"""The pulse of one impact with other settings: tried, or stored for its whole recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ....schema.person_roles import ENGINEER, READER
from ...common.number_format import finite
from ..ingest.extract import ExtractedPulses
from ..ingest.request import ExtractionChoice
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Result, ResultTable
from .showing import NamedImpact

if TYPE_CHECKING:
    from .curves import PulseCurve

_ARRAYS = ("time_s", "force_n", "points_time_s", "points_n")


class PulseExtraction(ExtractionChoice, NamedImpact):
    """An impact whose recording is extracted again."""


@dataclass(frozen=True, eq=False)
class PreviewedPulse(Result):
    """The pulse that other settings give."""

    curve: PulseCurve

    def tables(self) -> Sequence[ResultTable]:
        """Its figures."""
        return (ResultTable("", [self.curve.figures], upright=True),)

    def to_json(self) -> Any:
        """Its settings, figures, spline and points."""
        curves = {name: getattr(self.curve, name).tolist() for name in _ARRAYS}
        return finite({**vars(self.curve), **curves})


@dataclass(frozen=True)
class ExtractedImpact(ExtractedPulses):
    """What changed with the recording of an impact."""

    impact: int

    def fault(self) -> str:
        """Why its recording was left as it was."""
        skipped = self.report.skipped
        return f"left as it was: {skipped[0]['reason']}" if skipped else ""

    def address(self) -> str:
        """The page of the impact."""
        return f"/impacts/{self.impact}"


def _recording(request: PulseExtraction, laboratory: Laboratory) -> int:
    from .impact import get_impact

    with laboratory.store.reading() as session:
        recording = get_impact(session, request.impact).recording_id
    if recording is None:
        raise LookupError(f"impact {request.impact} has no recording to extract a pulse from")
    return recording


def _preview(request: PulseExtraction, laboratory: Laboratory, _: Progress) -> PreviewedPulse:
    from ....ingest.storing.reextraction import preview_impacts
    from .curves import preview_curve

    settings = request.settings()
    extracted = preview_impacts(laboratory.store, _recording(request, laboratory), settings)
    pulse = extracted.pulse_of(request.impact)
    if pulse is None:
        raise ValueError("these settings find another number of impacts in the recording")
    return PreviewedPulse(preview_curve(pulse, settings))


def _extract(request: PulseExtraction, laboratory: Laboratory, _: Progress) -> ExtractedImpact:
    from ....ingest.storing.reextraction import reextract_recording

    recording = _recording(request, laboratory)
    report = reextract_recording(laboratory.store, recording, request.settings())
    return ExtractedImpact(report, request.impact)


_PAGE = "/impacts/{impact}?preview=true&" + "&".join(
    f"{name}={{{name}}}" for name in ExtractionChoice.model_fields
)

IMPACT_PREVIEW: Operation[PulseExtraction, PreviewedPulse] = Operation(
    name="impact-preview",
    role=READER,
    unrecorded=True,
    request=PulseExtraction,
    run=_preview,
    help="""Show the pulse that other settings give of the impact with number IMPACT; nothing is
stored.""",
    example="pyroshock impacts preview 1 --threshold 0.01",
    command=("impacts", "preview"),
    route=("POST", "/impacts/{impact}/preview"),
    absent={"form": "It changes nothing; the page of the impact draws it beside the pulse in use."},
)
IMPACT_EXTRACT: Operation[PulseExtraction, ExtractedImpact] = Operation(
    name="impact-extract",
    role=ENGINEER,
    request=PulseExtraction,
    run=_extract,
    help="""Extract the pulses of the recording of IMPACT again with other settings, and use them.

The impacts of a recording are told apart together, so that all of its pulses are extracted. The old
versions stay, and `pyroshock show` lists them.""",
    example="pyroshock impacts extract 1 --threshold 0.01",
    command=("impacts", "extract"),
    route=("POST", "/impacts/{impact}/extract"),
    form=FormPage(_PAGE, "", "/impacts/{impact}/extract"),
)
