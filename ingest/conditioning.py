"""Conditioning of an acceleration before it is integrated: transfer function, deconvolution, delay."""

from __future__ import annotations

from .acceleration import (
    DEFAULT_REGULARISATION,
    clean_acceleration,
    deconvolve,
    delay_is_plausible,
    force_from_acceleration,
    measured_delay_samples,
    propagation_delay,
)
from .transfer_function import (
    TransferFunction,
    TransferFunctionError,
    estimate_transfer_function,
    hit_windows,
    rigid_body_normalised,
)

__all__ = [
    "DEFAULT_REGULARISATION",
    "TransferFunction",
    "TransferFunctionError",
    "clean_acceleration",
    "deconvolve",
    "delay_is_plausible",
    "estimate_transfer_function",
    "force_from_acceleration",
    "hit_windows",
    "measured_delay_samples",
    "propagation_delay",
    "rigid_body_normalised",
]
