"""Checks of a record, whoever made it. `CHECKS` is the list: a new check is one file here and one line in it."""

from __future__ import annotations

from ..channel import Channel
from .base import Check, Contact, Finding
from .clipping import check_clipping
from .displacement import check_displacement
from .double_hit import check_double_hit
from .dropouts import check_dropouts
from .few_samples import check_few_samples
from .no_shock import check_no_shock
from .pre_trigger_noise import check_pre_trigger_noise
from .rest_level import check_rest_level
from .saturation import check_saturation
from .truncation import check_truncation
from .velocity import check_velocity
from .zero_shift import check_zero_shift

__all__ = ["CHECKS", "Check", "Contact", "Finding", "run_checks"]

CHECKS: tuple[Check, ...] = (
    check_dropouts,
    check_clipping,
    check_saturation,
    check_no_shock,
    check_rest_level,
    check_zero_shift,
    check_velocity,
    check_displacement,
    check_truncation,
    check_double_hit,
    check_few_samples,
    check_pre_trigger_noise,
)


def run_checks(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """What every check in `CHECKS` finds, in that order. `contacts` ascend in time and may be empty."""
    return [finding for check in CHECKS for finding in check(channel, contacts)]
