"""What a check of a record is: a pure function from a channel, with its contacts or its spectrum,
to findings.

A check is one file in this folder, listed in `checks/__init__.py`. It decides nothing: a finding is
stored with its evidence, and whoever builds a dataset obeys it or not.

One contact in a record, as segmentation found it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from ..channel import Channel
from ..srs.spectrum import Spectrum


@dataclass(frozen=True)
class Contact:
    """First and last sample of a contact, and the sample of its peak between."""

    first: int
    peak: int
    last: int


Severity = Literal["note", "warning", "reject"]


@dataclass(frozen=True)
class Finding:
    """A verdict on one channel, with the numbers that support it (JSON-serialisable, SI, units in
    the key).

    `note`: worth knowing. `warning`: the numbers drawn from it are doubtful. `reject`: do not use
    them. `contact` is the index into the recording's contacts where the finding concerns one of
    them.
    """

    check: str  # "clipping", "zero-shift", ...
    severity: Severity
    message: str  # one sentence for a person, with value and limit
    channel: str
    evidence: dict[str, Any] = field(default_factory=dict)
    contact: int | None = None


class Check(Protocol):
    """A function of a channel and its contacts, which ascend in time, to what it finds; none where
    all is well."""

    def __call__(self, channel: Channel, contacts: tuple[Contact, ...], /) -> list[Finding]: ...


class SpectrumCheck(Protocol):
    """A function of an acceleration and its spectrum to what it finds; none where all is well."""

    def __call__(self, channel: Channel, spectrum: Spectrum) -> list[Finding]: ...


__all__ = ["Check", "Contact", "Finding", "Severity", "SpectrumCheck"]
