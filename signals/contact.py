"""One contact in a record, as segmentation found it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Contact:
    """First and last sample of a contact, and the sample of its peak between."""

    first: int
    peak: int
    last: int
