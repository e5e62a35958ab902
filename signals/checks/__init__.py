"""Checks of a record, whoever made it: a new check is one file here, and one line in `CHECKS` or
`SPECTRUM_CHECKS`."""

from __future__ import annotations

from ..channel import Channel
from ..srs.spectrum import Spectrum
from .balance import check_balance
from .base import Check, Contact, Finding, SpectrumCheck
from .clipping import check_clipping
from .displacement import check_displacement
from .double_hit import check_double_hit
from .dropouts import check_dropouts
from .few_samples import check_few_samples
from .no_shock import check_no_shock
from .noise_floor import check_noise_floor
from .placeholders import check_placeholders
from .pre_trigger_noise import check_pre_trigger_noise
from .resampled_time import check_resampled_time
from .rest_level import check_rest_level
from .sampling import check_sampling
from .saturation import check_saturation
from .truncation import check_truncation
from .velocity import check_velocity
from .zero_shift import check_zero_shift

__all__ = [
    "CHECKS",
    "SPECTRUM_CHECKS",
    "Check",
    "Contact",
    "Finding",
    "SpectrumCheck",
    "run_checks",
    "run_spectrum_checks",
]

CHECKS: tuple[Check, ...] = (
    check_dropouts,
    check_placeholders,
    check_resampled_time,
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

#: Of an acceleration beside its shock response spectrum.
SPECTRUM_CHECKS: tuple[SpectrumCheck, ...] = (check_balance, check_noise_floor, check_sampling)


def run_checks(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """What every check in `CHECKS` finds, in that order.

    Parameters:
        channel: The record that is checked.
        contacts: Its contacts in the order of time; there may be none.
    """
    return [finding for check in CHECKS for finding in check(channel, contacts)]


def run_spectrum_checks(channel: Channel, spectrum: Spectrum) -> list[Finding]:
    """What every check in `SPECTRUM_CHECKS` finds, in that order.

    Parameters:
        channel: The acceleration that is checked.
        spectrum: The shock response spectrum of this acceleration.
    """
    return [finding for check in SPECTRUM_CHECKS for finding in check(channel, spectrum)]
