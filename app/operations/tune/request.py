"""What is asked of a search of settings: the spectrum, the twin, and what is searched."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from ....files.toml_text import read_toml_text
from ...common.frames import si
from ..fields import Names, Presentation, Seed, Share, TextFile, request_field, text_file
from ..operation import Request
from ..twin_fields import TwinFields, Word

if TYPE_CHECKING:
    from ....doe.space import Space
    from ....twin.srs.target import Target
    from ....twin.tune.space import ContinuousRange, Levels

#: A target of 2,000 break points has a tenth of this.
_MOST_BYTES = 260_000


def _factors(given: TextFile) -> TextFile:
    from ....doe.space import space_from_form

    space_from_form(given.text, str(given.path or "factors"))
    return given


def _readable_target(given: TextFile) -> TextFile:
    _target(given, "")
    return given


def _target(given: TextFile, tolerance: str) -> Target:
    from ..impacts.spectra import target_of_file

    return target_of_file(given, tolerance)


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
    from ....twin.tune.space import Levels

    if given is None or given == "":
        return None
    try:
        masses = masses_of(given, str(info.field_name))
    except TypeError as error:
        raise ValueError(str(error)) from error
    if isinstance(given, str):
        return given
    assert isinstance(masses, Levels)  # a range is a text
    return ",".join(f"{mass!r}kg" for mass in masses.values)


class SpectrumSearch(Request):
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


class Tuning(TwinFields, SpectrumSearch, _Prescribed):
    """A prescribed spectrum, the twin, and what is searched."""

    def prescribed(self) -> Target:
        """The spectrum with its tolerance."""
        return _target(self.target, self.tolerance)
