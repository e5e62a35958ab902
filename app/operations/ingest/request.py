"""What is asked of an ingest and of an extraction: the fields that both share, and what an ingest
has beside them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, model_validator

from ....ingest.extraction.settings import ExtractionSettings
from ..fields import Names, Presentation, Texts, quantity, request_field, source_of
from ..machine_paths import CampaignFolder
from ..operation import Request

_USUAL = ExtractionSettings()
#: Shares of a peak.
_PeakShare = Annotated[float, Field(ge=1e-6, le=1)]


class NamedCampaign(Request):
    """One campaign of the store."""

    campaign: Annotated[str, Field(min_length=1, max_length=1000)] = request_field(
        help="Name the campaign.",
        presentation=Presentation(positional=True, completion="campaign_names"),
    )


class ExtractionChoice(Request):
    """How pulses are cut out of a record."""

    segmentation: Literal["walk", "mask"] = request_field(
        _USUAL.segmentation, help="Choose how a contact is delimited."
    )
    threshold: Annotated[float, Field(ge=1e-6, le=0.5)] = request_field(
        _USUAL.threshold, help="Set the share of the peak at which a contact begins and ends."
    )
    smoothing: _PeakShare = request_field(
        _USUAL.smoothing, help="Set the csaps parameter of the spline, on the sample index."
    )
    refinement: Annotated[int, Field(ge=1, le=1000)] = request_field(
        _USUAL.refinement, help="Set the points of the fine pulse per recorded sample."
    )
    points: Annotated[int, Field(ge=4, le=10_000)] = request_field(
        _USUAL.points, help="Set the number of equidistant points of the force."
    )
    event_share: _PeakShare = request_field(
        _USUAL.event_share,
        help="Take as impacts what reaches this share of the largest peak of the record.",
    )
    separation_s: Annotated[quantity("s", named=True), Field(ge=0, le=1e6)] = request_field(  # type: ignore[valid-type]
        _USUAL.separation_s,
        help="Join contacts that are nearer than this into one impact. [default: 100ms]",
        example="100ms",
        presentation=Presentation(metavar="SECONDS", option="separation"),
    )

    @model_validator(mode="before")
    @classmethod
    def _of_an_older_job(cls, values: Any, info: ValidationInfo) -> Any:
        """Jobs of earlier versions have the settings together, and an upload beside its folder."""
        if source_of(info) != "stored" or not isinstance(values, Mapping):
            return values
        settings = values.get("settings", {})
        kept = {name: value for name, value in values.items() if name != "settings"}
        return {**kept, **{name: settings[name] for name in settings if name in cls.model_fields}}

    def settings(self) -> ExtractionSettings:
        """The settings of the extraction; those without a field are as usual."""
        return ExtractionSettings(
            **{name: getattr(self, name) for name in ExtractionChoice.model_fields}
        )


class _Folder(Request):
    """A campaign folder, and what is decided about its rows."""

    path: CampaignFolder = request_field(
        help="Read this campaign folder.",
        presentation=Presentation(positional=True, metavar="FOLDER…", several=True),
    )
    plan: Annotated[str, Field(min_length=1, max_length=200)] | None = request_field(
        None,
        help="Name the plan whose runs the campaign does. [default: the plan of the campaign's "
        "name, if there is one]",
        presentation=Presentation(completion="plan_names"),
    )
    free_factors: Names = request_field(
        (),
        max_length=1000,
        help="Take this column of runs.csv as a factor of its own, although its name resembles a "
        "known column. The option can be repeated.",
        presentation=Presentation(metavar="COLUMN", option="free-factor"),
    )
    confirmed: Names = request_field(
        (),
        max_length=1000,
        help="Allow rows to break this rule of what a bench can have. The message that refuses a "
        "row, or the unit of a campaign, names its rule. The option can be repeated.",
        presentation=Presentation(metavar="RULE", option="confirm"),
    )
    again: Texts = request_field(
        (),
        max_length=100_000,
        help="Store this recording although `runs discard` removed it. Give its path as in "
        "runs.csv. The option can be repeated.",
        presentation=Presentation(metavar="RECORDING"),
    )
    target_motion: Literal["none", "plate"] = request_field(
        "none",
        help="Add the motion of the plate under the force to velocities that are integrated from "
        "the deceleration of the impactor.",
        presentation=Presentation(option="velocity-target-motion"),
    )


class FolderReading(ExtractionChoice, _Folder):
    """A campaign folder that is read."""

    @model_validator(mode="before")
    @classmethod
    def _of_another_name(cls, values: Any, info: ValidationInfo) -> Any:
        """Notebooks and jobs of earlier versions call the path `folder`."""
        source = source_of(info)
        if source not in ("python", "stored") or not isinstance(values, Mapping):
            return values
        if "folder" not in values or "path" in values:
            return values
        kept = {name: part for name, part in values.items() if name not in ("folder", "scratch")}
        folder = values["folder"]
        if source == "stored":
            return {**kept, "path": {"path": folder, "scratch": values.get("scratch")}}
        return {**kept, "path": folder}


class FolderIngest(FolderReading):
    """A campaign folder that is stored, or tried."""

    dry_run: bool = request_field(
        False,
        help="Report what would be stored, beside what is stored now, and store nothing.",
    )
