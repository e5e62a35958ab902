"""Accelerometers with the wrong sign, in each other's place, or in another unit than the modal table's."""

from __future__ import annotations

import math

import numpy as np

from ..record import CampaignRecord
from .finding import Finding
from .first_millisecond import EarlyFits, early_fits
from .levels import Gap
from .mistakes import mistakes
from .suspicion import Suspicion, fitting, unit_finding

#: Below this a sign is wrong (a force that its filter delays reaches -0.5 against a right one). Two channels are
#: swapped where each fits the other better by `_BETTER`, and `_WELL`.
_REVERSED, _BETTER, _WELL = -0.8, 0.3, 0.6
#: Gains (nats) of channels that differ by less may have the force in common.
_ALIKE = 0.05


def channel_findings(record: CampaignRecord) -> list[Finding]:
    """What early fits tell; nothing where the plate or the force is not known."""
    fits = early_fits(record)
    if fits is None:
        return []
    swapped = _swapped(fits)
    return swapped or [*_reversed(fits), *_gains(fits)]


def _reversed(fits: EarlyFits) -> list[Finding]:
    found = []
    for name, fit in zip(fits.names, np.diag(fits.correlation), strict=True):
        if fit <= _REVERSED:
            message = (
                f"{name} begins with the sign opposite to the plate's (correlation {fit:.2f}): is its axis or polarity "
                f"reversed? turn shape_{name} in the modal table, or its sensitivity in campaign.toml"
            )
            found.append(Finding("refuse", name, message))
    return found


def _swapped(fits: EarlyFits) -> list[Finding]:
    found, size = [], np.abs(fits.correlation)
    for i, first in enumerate(fits.names):
        for j in range(i + 1, len(fits.names)):
            crossed, own = (size[i, j] + size[j, i]) / 2, (size[i, i] + size[j, j]) / 2
            if min(size[i, j], size[j, i]) >= _WELL and crossed >= own + _BETTER:
                message = (
                    f"{first} and {fits.names[j]} fit each other's place on the plate (correlation {crossed:.2f}) "
                    f"better than their own ({own:.2f}): are they swapped? check [channels.*] in campaign.toml and the "
                    "columns of the modal table"
                )
                found.append(Finding("refuse", first, message))
    return found


def _gains(fits: EarlyFits) -> list[Finding]:
    """Of channels that fit but for their size; one finding for all where all are off alike."""
    centres = np.median(fits.log_gain, axis=0)
    good = [i for i in range(len(fits.names)) if abs(fits.correlation[i, i]) >= _WELL and np.isfinite(centres[i])]
    if len(good) == len(fits.names) and np.ptp(centres) <= _ALIKE:
        return _gain(fits, good, "acceleration" if len(good) > 1 else fits.names[0], with_force=True)
    return [finding for i in good for finding in _gain(fits, [i], fits.names[i], with_force=False)]


def _gain(fits: EarlyFits, rows: list[int], channel: str, *, with_force: bool) -> list[Finding]:
    gains = fits.log_gain[:, rows]
    now = Gap.of(gains, gains)
    tried = [_tried(fits, rows, channel, mistake.reads, mistake.what, 1) for mistake in mistakes("acceleration")]
    if with_force:
        tried += [_tried(fits, rows, "force", mistake.reads, mistake.what, -1) for mistake in mistakes("force")]
    suspects = fitting([one for one in tried if one is not None])
    return [unit_finding(channel, "plate", now, suspects)] if now and suspects else []


def _tried(fits: EarlyFits, rows: list[int], channel: str, reads: float, what: str, side: int) -> Suspicion | None:
    shift = side * math.log(reads)
    gains = fits.log_gain[:, rows] - shift
    left = Gap.of(gains, gains)
    return Suspicion(channel, what, shift, left) if left else None
