"""Mistakes of channels: the sign of a force, held against that of the campaign's other recordings;
units (factors of NIST SP 811) and gains of amplifiers that nobody wrote down; numbers that no
sensor gives, in any unit.

A contact pushes. Which sign a push has is the wiring's choice, and an extraction turns it upright
by itself; but within a campaign it is the same, unless a cable was turned over or the sensor was
pulled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.access.append_only import withdraw_findings
from ..schema.campaigns import Campaign
from ..schema.impacts import Impact, Pulse
from ..schema.recordings import QualityFinding, RecordedChannel, Recording
from ..schema.session import Store
from ..signals.checks.base import Finding
from .pulses import ExtractedPulse as ForcePulse
from .readers import RecordingError

#: Keys of a recording and of the channel that measured its force.
Place = tuple[int, int | None]
NEGATIVE, OTHER_SIGN = "negative-force", "force-sign"


def check_force_sign(pulses: Sequence[ForcePulse], channel: str) -> list[Finding]:
    """A `note` where the pulses of a recording are negative in its force."""
    if not pulses or pulses[0].sign > 0:
        return []
    message = (
        "the force of the contact is negative in this recording; the pulses are stored upright"
    )
    return [Finding(NEGATIVE, "note", message, channel, {"sign": -1})]


def warn_of_sign(store: Store, campaign: str) -> None:
    """A `warning` on each recording of `campaign` whose force has another sign than that of most;
    on those of negative force where there are as many of either. What was said before is brought up
    to date."""
    wanted, present = store.read(lambda session: _minority(session, campaign))
    if wanted.keys() != present:
        store.write(
            lambda session: _write(store, session, wanted, present - wanted.keys(), present),
            idempotent=True,
        )


def _minority(session: Session, campaign: str) -> tuple[dict[Place, str], set[Place]]:
    """(recording, channel) -> what is to be said of it; and those of which it is said already."""
    with_pulses = (
        select(Impact.recording_id)
        .join(Pulse, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .where(Campaign.name == campaign)
        .distinct()
    )
    forces = select(RecordedChannel.recording_id, RecordedChannel.id).where(
        RecordedChannel.quantity == "force", RecordedChannel.recording_id.in_(with_pulses)
    )
    channels: dict[int, int] = dict(
        iter(session.execute(forces.order_by(RecordedChannel.id.desc())))
    )
    columns = (QualityFinding.recording_id, QualityFinding.channel_id, QualityFinding.check)
    query = select(*columns).join(Recording, QualityFinding.recording_id == Recording.id)
    query = query.join(Campaign, Recording.campaign_id == Campaign.id).where(
        Campaign.name == campaign, QualityFinding.check.in_((NEGATIVE, OTHER_SIGN))
    )
    findings = session.execute(query).all()
    negative = {
        recording for recording, _, check in findings if check == NEGATIVE
    } & channels.keys()
    positive = channels.keys() - negative
    minority, sign, others = negative, "negative", len(positive)
    if len(positive) < len(negative):
        minority, sign, others = positive, "positive", len(negative)
    message = (
        f"the force is {sign} here and the other way in {others} recordings "
        f"of the campaign: a cable was turned over, "
        "or the sensor was pulled; look at the wiring and at the sensitivity's sign"
    )
    wanted: dict[Place, str] = {(key, channels[key]): message for key in minority} if others else {}
    return wanted, {(row[0], row[1]) for row in findings if row[2] == OTHER_SIGN}


def _write(
    store: Store,
    session: Session,
    wanted: dict[Place, str],
    withdrawn: set[Place],
    present: set[Place],
) -> None:
    for recording, _ in sorted(withdrawn):
        withdraw_findings(session.connection(), recording, OTHER_SIGN)
    rows: list[dict[str, object]] = [
        {
            "recording_id": recording,
            "channel_id": channel,
            "impact_id": None,
            "check": OTHER_SIGN,
            "severity": "warning",
            "message": message,
            "evidence": {},
        }
        for (recording, channel), message in sorted(wanted.items())
        if (recording, channel) not in present
    ]
    store.add_rows(session, QualityFinding, rows)


_POUND_FORCE_N, _GRAVITY_M_S2, _FOOT_M, _MILE_KM = 4.4482216, 9.80665, 0.3048, 1.609344
#: By quantity the unit of its columns, and others with what they read per truth: one may be taken
#: for the other.
_UNITS: dict[str, tuple[str, dict[str, float]]] = {
    "force": ("N", {"kN": 1e-3, "lbf": 1 / _POUND_FORCE_N, "kgf": 1 / _GRAVITY_M_S2}),
    "acceleration": (
        "m/s2",
        {"g": 1 / _GRAVITY_M_S2, "mm/s2": 1e3, "cm/s2": 1e2, "ft/s2": 1 / _FOOT_M},
    ),
    "velocity": (
        "m/s",
        {"km/h": 3.6, "ft/s": 1 / _FOOT_M, "mph": 3.6 / _MILE_KM, "cm/s": 1e2, "mm/s": 1e3},
    ),
    "pressure": ("bar", {"psi": 14.503774, "kPa": 1e2, "mbar": 1e3, "Pa": 1e5, "MPa": 1e-1}),
    "clock": ("Hz", {"kHz": 1e-3}),
}
#: A conditioner's switch that nobody wrote down.
_AMPLIFIED = {"force": (10.0, 100.0), "acceleration": (10.0, 100.0)}


def unit_mistakes(quantity: str) -> Iterator[tuple[float, str]]:
    """Readings over the truth, each with the mistake that makes them; those of a quantity, in both
    directions."""
    unit, factors = _UNITS[quantity]
    for name, factor in factors.items():
        yield factor, f"values in {name} where {unit} is declared"
        yield 1 / factor, f"values in {unit} where {name} is declared"
    for gain in _AMPLIFIED.get(quantity, ()):
        yield gain, f"an amplifier's gain of {gain:g} that is not divided out"
        yield 1 / gain, f"a gain of {gain:g} divided out that the amplifier does not have"


#: Beyond it products of three samples overflow, and every figure after them.
LARGEST = 1e100


def refuse_no_reading(file: str, channel: str, samples: NDArray[Any]) -> None:
    """Raises `RecordingError` for a finite sample beyond `LARGEST`: the file is damaged, or has
    another type."""
    if samples.dtype.kind != "f" or samples.dtype.itemsize < 8:
        return
    beyond = (np.abs(samples) > LARGEST) & np.isfinite(samples)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise RecordingError(
            f"{file}: channel {channel!r} holds {samples[at]:.3g} at sample {at}; no sensor gives "
            "such a number, the file is damaged or has another type of number"
        )
