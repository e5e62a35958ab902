"""A specification in words, and one that stands in the address of a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ....twin.srs.target import Target
from ...common.number_format import format_number
from ...common.quantities import display_of
from ..impacts.spectra import target_from_upload
from ..predict.figures import tolerance_words

#: Fields of an address that tell a specification.
SPECIFICATION, TOLERANCE = "specification", "tolerance"
#: A longer specification does not fit into an address that every browser and proxy takes.
MOST_ADDRESS = 1500


def target_sentence(target: Target) -> str:
    """`The specification reaches from 100 to 10000 Hz and from 30 to 300 g, with a tolerance of
    +6/−6 dB.`"""
    display = display_of("level_m_s2")
    ends = [format_number(end) for end in (target.frequency_hz[0], target.frequency_hz[-1])]
    levels = [
        format_number(end * display.scale, 3)
        for end in (target.level_m_s2.min(), target.level_m_s2.max())
    ]
    return (
        f"The specification reaches from {ends[0]} to {ends[1]} Hz and from {levels[0]} to "
        f"{levels[1]} {display.unit}, with a tolerance of "
        f"{tolerance_words(target).removeprefix('tolerance ')}."
    )


@dataclass(frozen=True, eq=False)
class AddressedTarget:
    """The specification of an address: its text and tolerance, what was understood of it (None for
    none, or for one that cannot be used), and the reason."""

    text: str = ""
    tolerance: str = ""
    target: Target | None = None
    fault: str = ""

    @property
    def fields(self) -> dict[str, str]:
        """As an address has them; nothing without a specification, or where it is too long."""
        if not self.text or len(self.text) > MOST_ADDRESS:
            return {}
        return {SPECIFICATION: self.text, TOLERANCE: self.tolerance}


def target_of_address(
    pairs: Sequence[tuple[str, str]],
) -> tuple[list[tuple[str, str]], AddressedTarget]:
    """The other fields of an address, and its specification."""
    own = {name: text for name, text in pairs if name in (SPECIFICATION, TOLERANCE)}
    others = [pair for pair in pairs if pair[0] not in (SPECIFICATION, TOLERANCE)]
    text, tolerance = own.get(SPECIFICATION, "").strip(), own.get(TOLERANCE, "").strip()
    if not text:
        return others, AddressedTarget(tolerance=tolerance)
    try:
        target = target_from_upload(text, "the specification", tolerance or None)
    except ValueError as error:
        return others, AddressedTarget(text, tolerance, None, str(error))
    return others, AddressedTarget(text, tolerance, target)
