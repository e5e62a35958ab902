"""Checks of any recording alone: one a file, listed here."""

from __future__ import annotations

from ....signals.srs.record import Spectrum
from .balance import check_balance
from .base import Check, Finding, Record
from .clipping import check_clipping
from .displacement import check_displacement
from .noise_floor import check_noise_floor
from .rest_level import check_rest_level
from .sampling import check_sampling
from .truncation import check_truncation
from .velocity import check_velocity
from .zero_shift import check_zero_shift

#: Every check, in the order in which findings are told; a new one is a file in this folder and a line here.
CHECKS: tuple[Check, ...] = (
    check_clipping,
    check_zero_shift,
    check_rest_level,
    check_velocity,
    check_displacement,
    check_balance,
    check_noise_floor,
    check_sampling,
    check_truncation,
)

__all__ = ["CHECKS", "Check", "Finding", "Record", "run_checks"]


def run_checks(record: Record, spectrum: Spectrum) -> tuple[Finding, ...]:
    """The findings of all checks on a record and its spectrum (f,); empty where there is nothing to tell."""
    return tuple(found for check in CHECKS if (found := check(record, spectrum)) is not None)
