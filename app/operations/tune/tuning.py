"""Search the settings of the bench that give a prescribed spectrum."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from ....files.atomic_write import write_text
from ....files.toml_text import read_toml_text
from ...common.frames import si
from ...common.number_format import finite
from ..faults import about_field
from ..fields import Names, Presentation, Seed, Share, TextFile, request_field, text_file
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress, Request
from ..twin_fields import TwinFields, Word
from .service import TunedSettings, search_settings

if TYPE_CHECKING:
    from ....doe.space import Space
    from ....twin.srs.target import Target
    from ....twin.tune.space import ContinuousRange, Levels

#: A target of 2,000 break points has a tenth of this.
_MOST_BYTES = 260_000


def _factors(given: TextFile) -> TextFile:
    from ....doe.space import space_from_form

    space_from_form(given.text)
    return given


def _readable_target(given: TextFile) -> TextFile:
    _target(given, "")
    return given


def _target(given: TextFile, tolerance: str) -> Target:
    from ..impacts.spectra import target_from_upload

    return target_from_upload(given.text, Path(given.name).name, tolerance or None)


def _tolerance(given: Any) -> Any:
    """`6dB` of the number 6, which Python may give; other texts as they are, once they are read."""
    from ....twin.srs.standards import parse_tolerance

    if given is None:
        return ""
    if isinstance(given, int | float) and not isinstance(given, bool):
        return f"{given:g}dB"
    if isinstance(given, str) and given.strip():
        parse_tolerance(given)
    return given


def masses_of(given: Any, name: str) -> Levels | ContinuousRange:
    """Masses that the laboratory owns: one, several ("0.2kg,0.5kg", or a list), or any between two
    ("0.2kg:1kg").

    Raises `ValueError` that says `name`.
    """
    from ....twin.tune.space import ContinuousRange, Levels

    is_range = isinstance(given, str) and ":" in given
    if isinstance(given, str):
        given = given.split(":" if is_range else ",")
    several = isinstance(given, Iterable) and not hasattr(given, "units")
    masses = sorted(si(mass, "kg", name) for mass in (given if several else [given]))
    if not masses or not masses[0] > 0 or (is_range and len(masses) != 2):
        raise ValueError(f"{name} is {given!r}; expected masses above 0, or two ends of a range")
    if is_range and not math.isclose(*masses):
        return ContinuousRange(*masses)
    return Levels(tuple(dict.fromkeys(masses)))


def _masses(given: Any, info: ValidationInfo) -> Any:
    """Masses as text, which every door can give and a job can keep."""
    if given is None or given == "":
        return None
    try:
        masses = masses_of(given, str(info.field_name))
    except TypeError as error:
        raise ValueError(str(error)) from error
    return given if isinstance(given, str) else ",".join(f"{mass!r}kg" for mass in masses.values)


class SettingsSearch(Request):
    """What is searched, whatever the twin and the spectrum: what the laboratory owns, what it has
    measured, and when a setting is good."""

    measured: Names = request_field(
        (),
        max_length=20,
        help="Learn from the measured shots of these campaigns. Give several with commas: a,b.",
        presentation=Presentation(
            metavar="CAMPAIGN", completion="campaign_names", label="Learn from the shots of"
        ),
    )
    sensor: Word | None = request_field(
        None,
        help="Name the sensor for which the spectrum is prescribed. [default: the first]",
        presentation=Presentation(metavar="NAME"),
    )
    bullet_mass: Annotated[str, BeforeValidator(_masses), Field(max_length=1000)] | None = (
        request_field(
            None,
            help="List your bullets (0.2kg,0.5kg), or allow any mass of a range (0.2kg:1kg). "
            "[default: the levels of the factor]",
            presentation=Presentation(metavar="MASSES"),
        )
    )
    factors: Annotated[text_file(200_000, read_toml_text), AfterValidator(_factors)] | None = (  # type: ignore[valid-type]
        request_field(
            None,
            help="Say what the laboratory owns, by the TOML file of a plan's factors.",
            presentation=Presentation(metavar="FILE.toml"),
        )
    )
    share: Share = request_field(
        1.0,
        help="Set the share of the lines that must lie within the tolerance.",
        presentation=Presentation(label="Share of the lines required"),
    )
    at_least: Share = request_field(
        0.5,
        help="Count a setting as meeting the target from this probability on.",
        presentation=Presentation(metavar="PROBABILITY", label="Probability required"),
    )
    extrapolate: bool = request_field(
        False, help="Propose settings outside of the domain of the model, too."
    )
    seed: Seed = request_field(0, help="Set the seed of the search and its random draws.")

    def space(self) -> Space:
        """What the laboratory owns: its file, or the levels that ship with the software."""
        from ....doe.space import shipped_factors, space_from_form

        return space_from_form(
            shipped_factors("gun") if self.factors is None else self.factors.text
        )

    def masses(self) -> Levels | ContinuousRange | None:
        """None: the bullets of the factors."""
        return None if self.bullet_mass is None else masses_of(self.bullet_mass, "bullet_mass")


class _Prescribed(Request):
    """Declared apart, so that the spectrum is the first that help and forms ask for."""

    target: Annotated[text_file(_MOST_BYTES), AfterValidator(_readable_target)] = request_field(  # type: ignore[valid-type]
        help="Read the prescribed spectrum from a CSV file.",
        presentation=Presentation(metavar="SPEC.csv", label="Specification"),
    )
    tolerance: Annotated[str, BeforeValidator(_tolerance), Field(max_length=200)] = request_field(
        "",
        help="Set the tolerance, such as 6dB or +9/-6dB. [default: that of the file, else that of "
        "NASA-STD-7003]",
        presentation=Presentation(metavar="6dB"),
    )


class Tuning(TwinFields, SettingsSearch, _Prescribed):
    """A prescribed spectrum, the twin, and what is searched."""

    def prescribed(self) -> Target:
        """The spectrum with its tolerance."""
        return _target(self.target, self.tolerance)


def check(request: Tuning, laboratory: Laboratory) -> None:
    """Raises `LookupError` for names that the store does not have: the search would end without a
    result."""
    from ....schema.listings import get_campaign_id

    request.check_names(laboratory)
    with laboratory.store.reading() as session, about_field("measured"):
        for name in request.measured:
            get_campaign_id(session, name)


def _run(request: Tuning, laboratory: Laboratory, progress: Progress) -> TunedSettings:
    progress(0, 0, "building the twin")
    with request.twin_request() as twin:
        return search_settings(
            laboratory.store, laboratory.db, request.prescribed(), request, twin, progress
        )


def _write_plot(settings: TunedSettings, path: Path) -> None:
    from .session import plot_tuned

    plot_tuned(settings.tuned, settings.goal, path)


def _write_avoid(settings: TunedSettings, path: Path) -> None:
    from .bench_adapter import avoid_json

    rows = [avoid_json(item) for item in settings.tuned.avoid]
    write_text(path, json.dumps(finite(rows), indent=2) + "\n")


def _label(request: Any) -> str:
    path = request.target.path
    return "to a spectrum" if path is None else f"to {path.name}"


TUNE = Operation(
    name="tune",
    request=Tuning,
    run=_run,
    check=check,
    help="Search the settings of the bench that give a prescribed spectrum.\n\n"
    "The settings are ranked, each with the probability that every line fits. The first line says "
    "whether any setting meets the target, with which probability, and what stands in the way if "
    "none does; the exit code is 1 then. Settings that the bench must not fire are never proposed. "
    "A shot that was fired updates the next proposal.",
    example="pyroshock tune --target examples/specifications/component.csv --measured rehearsal "
    "--plot spectra.png",
    route=("POST", "/tune"),
    long=True,
    steps="settings",
    outputs=(
        Output(
            "avoid",
            "Write the settings that must be avoided to FILE, as JSON.",
            _write_avoid,
        ),
        Output(
            "plot",
            "Draw the spectra of the best settings into FILE.",
            _write_plot,
            missing=lambda settings: (
                "" if settings.tuned.proposals else "the bench can fire no setting"
            ),
        ),
    ),
    label=_label,
    form=FormPage("/tune", "tune", "/tune"),
    result_page="/tune/{job}",
)
