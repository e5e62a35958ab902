"""Shock response spectra of stored impacts, held against a specification or their mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import model_validator

from ...common.number_format import finite, percent
from ..fields import Key, Keys, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result, ResultTable
from .recording_spectrum import SIDES, SpectrumChoice

if TYPE_CHECKING:
    from ...figures.figure import Figure
    from .overlays import SpectrumOverlay


class SpectrumComparing(SpectrumChoice):
    """Impacts whose spectra are compared."""

    impact: Keys = request_field(
        min_length=1,
        max_length=200,
        help="Give the numbers of the impacts.",
        presentation=Presentation(positional=True, metavar="IMPACT…"),
    )
    reference: Key | None = request_field(
        None,
        help="Compare with the spectrum of this one of the impacts: the mean of its channels in "
        "dB. [default: the specification, else the mean of all]",
        presentation=Presentation(metavar="IMPACT"),
    )

    @model_validator(mode="after")
    def _has_one_reference(self) -> SpectrumComparing:
        if self.reference is None:
            return self
        if self.specification is not None:
            raise ValueError(
                "reference and specification both say what spectra are compared with; expected one "
                "of them"
            )
        if self.reference not in self.impact:
            named = ", ".join(map(str, self.impact))
            raise ValueError(f"reference is {self.reference}; expected one of the impacts: {named}")
        return self


@dataclass(frozen=True, eq=False)
class ComparedSpectra(Result):
    """Spectra over each other."""

    overlay: SpectrumOverlay

    def notes(self) -> Sequence[str]:
        """Channels without a spectrum."""
        return [f"left out: {words}" for words in self.overlay.left_out]

    def tables(self) -> Sequence[ResultTable]:
        """How each spectrum keeps to the reference."""
        return (ResultTable("", self.rows()),)

    def rows(self) -> list[dict[str, Any]]:
        """The same as a page shows it."""
        shares = ("share_within", "share_above")
        return [
            {**row, **{name: percent(row[name]) for name in shares}} for row in self.overlay.rows()
        ]

    def figures(self) -> Sequence[Figure]:
        """The spectra with their reference and its bands, and their differences from it."""
        from .spectra_figures import compared_figure

        return (compared_figure(self.overlay),)

    def to_json(self) -> Any:
        """All spectra, and the reference at its lines."""
        overlay = self.overlay
        rows = [
            {**row, **{name: getattr(part.spectrum, name).tolist() for name in SIDES}}
            for row, part in zip(overlay.rows(), overlay.spectra, strict=True)
        ]
        reference = {
            name: getattr(overlay.reference, name).tolist()
            for name in ("frequency_hz", "level_m_s2")
        }
        return finite(
            {
                "frequency_hz": overlay.frequency_hz.tolist(),
                "spectra": rows,
                "reference": reference,
            }
        )


def _compare(request: SpectrumComparing, laboratory: Laboratory, _: Progress) -> ComparedSpectra:
    from .overlays import spectrum_overlay

    target = request.target()
    with laboratory.store.reading() as session:
        overlay = spectrum_overlay(
            session,
            request.impact,
            request.channel,
            q=request.q or 10.0,
            specification=target,
            reference=request.reference,
        )
    return ComparedSpectra(overlay)


COMPARE_SPECTRA: Operation[SpectrumComparing, ComparedSpectra] = Operation(
    name="spectra",
    request=SpectrumComparing,
    run=_compare,
    help="""Compare the shock response spectra of impacts with a specification or one of them, else
with their mean.

A recording of one impact is taken whole, else from the rest before this contact up to the next
one.""",
    example="pyroshock impacts spectra 1 2 --plot spectra.png",
    command=("impacts", "spectra"),
    route=("GET", "/spectra"),
    outputs=(
        Output("plot", "Draw the spectra into FILE (.png, .svg, .pdf).", Result.write_figure),
    ),
    absent={"form": "It changes nothing; a page of its own draws it."},
)
