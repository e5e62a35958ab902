"""What the rows of `runs.csv` and the recordings of most shots of a campaign differ by alike: by a
factor, as a wrong unit, bullet length or sensitivity makes, or by a pressure, as absolute values
for gauge ones do.

The findings are made of what is stored whenever they are asked for, because they change with each
shot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.impacts import Impact, Shot
from ...schema.recordings import MUZZLE_VELOCITY, RecordedChannel
from ...signals.checks.base import Finding
from ..extraction.shot_plausibility import (
    AT_PLATE,
    GAUGES_PA,
    PRESSURE,
    SHARE,
    UNCERTAINTIES,
    USED_PRESSURE,
    USED_VELOCITY,
    VELOCITY,
    ValuePair,
    pressure_pair,
    velocity_pair,
)
from ..folder.unit_mistakes import unit_mistakes

COMMON_VELOCITY, COMMON_PRESSURE = "velocity-differs-throughout", "pressure-differs-throughout"
#: So many shots are compared, so large a share of them must differ, and so large a share agree by
#: the correction.
_LEAST_SHOTS, _OFF_SHARE, _RIGHT_SHARE = 3, 2 / 3, 0.8
_ATMOSPHERE_PA = 101_325.0
#: Pressures that differ by less (in nats) cannot tell a factor from a constant.
_PRESSURE_SPAN = 0.2


@dataclass(frozen=True)
class CommonDifference:
    """By what the rows of most shots differ from their recordings: `factor` with its interval (95
    %), or `offset`."""

    shots: int
    off: int
    factor: float
    low: float
    high: float
    offset: float | None = None
    offset_u: float = 0.0


def common_difference(
    pairs: Sequence[ValuePair], *, with_offset: bool = False
) -> CommonDifference | None:
    """What most shots differ by alike. None where most shots agree, or differ each in its own way.

    Parameters:
        pairs: The value of the row and that of the recording, for each shot.
        with_offset: Whether a constant difference, as of absolute and gauge pressures, may explain
            it as well; by default only a factor may.
    """
    off = sum(pair.differs() for pair in pairs)
    if len(pairs) < _LEAST_SHOTS or off < _OFF_SHARE * len(pairs):
        return None
    row, readings = (np.array([getattr(pair, name) for pair in pairs]) for name in ("row", "read"))
    if not (row.min() > 0 and readings.min() > 0):
        return None
    nats = np.log(row / readings)
    factor = math.exp(float(np.median(nats)))
    scatter = (
        1.2533 * 1.4826 * float(np.median(np.abs(nats - np.median(nats)))) / math.sqrt(len(pairs))
    )
    # The bullet's length and the calibration are the same in all shots.
    shared = float(np.median([pair.read_u / pair.read for pair in pairs]))
    half = 2 * math.hypot(scatter, shared)
    common = CommonDifference(
        len(pairs), off, factor, factor * math.exp(-half), factor * math.exp(half)
    )
    right = sum(not pair.differs(factor) for pair in pairs)
    differences = row - readings
    offset = float(np.median(differences))
    if with_offset:
        right_by_offset = sum(not pair.differs(offset=offset) for pair in pairs)
        scatters = [
            float(np.mean(np.abs(row / reading - 1)))
            for reading in (factor * readings, np.maximum(readings + offset, 1.0))
        ]
        alike = float(np.ptp(np.log(readings))) < _PRESSURE_SPAN
        atmosphere = abs(abs(offset) - _ATMOSPHERE_PA) < GAUGES_PA + 2 * shared * float(
            np.median(readings)
        )
        better = atmosphere if alike else scatters[1] < scatters[0]
        if better and right_by_offset >= _RIGHT_SHARE * len(pairs):
            spread = (
                1.2533
                * 1.4826
                * float(np.median(np.abs(differences - offset)))
                / math.sqrt(len(pairs))
            )
            offset_u = math.hypot(spread, shared * float(np.median(readings)))
            return CommonDifference(
                len(pairs), off, factor, common.low, common.high, offset, offset_u
            )
    return common if right >= _RIGHT_SHARE * len(pairs) else None


def campaign_differences(session: Session, campaign_id: int) -> list[Finding]:
    """At most one `warning` of each column of velocities and one of pressures, of the first shot's
    channels.

    Parameters:
        session: A session of the store.
        campaign_id: The key of the campaign.
    """
    velocities, at_plate, pressures, laser, tank = _stored_pairs(session, campaign_id)
    findings = []
    of_velocity = common_difference(velocities)
    if of_velocity is not None:
        lengths = [pair.bullet_length_m for pair in velocities if pair.bullet_length_m is not None]
        findings.append(
            _velocity_finding(of_velocity, float(np.median(lengths)) if lengths else None, laser)
        )
    of_impact = common_difference(at_plate)
    if of_impact is not None:
        findings.append(_velocity_finding(of_impact, None, laser, "impact_velocity_m_s", AT_PLATE))
    of_pressure = common_difference(pressures, with_offset=True)
    if of_pressure is not None:
        findings.append(_pressure_finding(of_pressure, tank))
    return findings


def _stored_pairs(
    session: Session, campaign_id: int
) -> tuple[list[ValuePair], list[ValuePair], list[ValuePair], str, str]:
    """Velocities at the muzzle and at the plate, pressures; the first laser and the first
    transducer."""
    query = (
        select(Shot, RecordedChannel.name, RecordedChannel.quantity, RecordedChannel.header, Impact)
        .join(RecordedChannel, RecordedChannel.recording_id == Shot.recording_id)
        .outerjoin(Impact, Shot.impact_id == Impact.id)
        .where(Shot.campaign_id == campaign_id)
        .order_by(Shot.id, RecordedChannel.id)
    )
    velocities: list[ValuePair] = []
    at_plate: list[ValuePair] = []
    pressures: list[ValuePair] = []
    names = {VELOCITY: "", PRESSURE: ""}
    recordings: set[int] = set()
    for shot, name, quantity, header, impact in session.execute(query):
        read = header.get(MUZZLE_VELOCITY)
        if read is not None and shot.velocity_source == "reported" and shot.measured_velocity_m_s:
            names[VELOCITY] = names[VELOCITY] or name
            velocities.append(
                velocity_pair(
                    shot.measured_velocity_m_s,
                    shot.measured_velocity_u_m_s,
                    read["velocity_m_s"],
                    read["velocity_u_m_s"],
                    shot.bullet_length_m,
                )
            )
        if read is not None and impact is not None and impact.velocity_source == "reported":
            names[VELOCITY] = names[VELOCITY] or name
            reported, reported_u = impact.impact_velocity_m_s, impact.impact_velocity_u_m_s or 0.0
            laser_u = read["velocity_u_m_s"]
            at_plate.append(
                ValuePair(reported, reported_u, read["velocity_m_s"], laser_u, AT_PLATE)
            )
        if (
            quantity == "pressure"
            and shot.recorded_pressure_pa is not None
            and shot.id not in recordings
        ):
            recordings.add(shot.id)
            names[PRESSURE] = names[PRESSURE] or name
            pressures.append(
                pressure_pair(
                    shot.tank_pressure_pa, shot.recorded_pressure_pa, shot.recorded_pressure_u_pa
                )
            )
    return velocities, at_plate, pressures, names[VELOCITY], names[PRESSURE]


def _evidence(common: CommonDifference) -> dict[str, object]:
    evidence: dict[str, object] = {
        "shots": common.shots,
        "differ": common.off,
        "factor": common.factor,
    }
    evidence["interval"] = [common.low, common.high]
    return (
        evidence
        if common.offset is None
        else evidence | {"offset_pa": common.offset, "offset_u_pa": common.offset_u}
    )


_RATIOS = (1 - SHARE, 1 + SHARE)


def _units(
    quantity: str, common: CommonDifference, ratios: tuple[float, float] = _RATIOS
) -> list[str]:
    """Mistakes of the row's unit within the factor's interval, or within what two values may differ
    by."""
    low, high = common.low / ratios[1], common.high / ratios[0]
    fitting = [
        (abs(math.log(value / common.factor)), words)
        for value, words in unit_mistakes(quantity)
        if low < value < high
    ]
    return [f"runs.csv has {words}" for _, words in sorted(fitting)[:2]]


def _velocity_finding(
    common: CommonDifference,
    length_m: float | None,
    laser: str,
    column: str = "measured_velocity_m_s",
    ratios: tuple[float, float] = _RATIOS,
) -> Finding:
    reasons = _units("velocity", common, ratios)
    if length_m is not None and 1 / 3 < common.factor < 3:
        reasons.append(
            f"the bullet is {1e3 * common.factor * length_m:.4g} mm long, where bullet_length_mm "
            f"is {1e3 * length_m:.4g}"
        )
    message = (
        f"the velocities of runs.csv ({column}) are {common.factor:.3g} times the laser's (95 %: "
        f"{common.low:.3g} to {common.high:.3g}) in most of {common.shots} shots; {common.off} are "
        f"outside of {ratios[0]:g} to {ratios[1]:g} times it by more than {UNCERTAINTIES:g} of "
        "their uncertainties. One of these would explain it: "
        f"{'; '.join((*reasons, 'a clock or gain that is wrong'))}. {USED_VELOCITY}: correct the "
        "column or the length"
    )
    return Finding(COMMON_VELOCITY, "warning", message, laser, _evidence(common))


def _pressure_finding(common: CommonDifference, tank: str) -> Finding:
    if common.offset is not None:
        bar, bar_u = common.offset / 1e5, common.offset_u / 1e5
        size = (
            f"{abs(bar):.3f} ± {2 * bar_u:.2g} bar "
            f"{'above' if bar > 0 else 'below'} the recorded ones"
        )
        near = abs(abs(common.offset) - _ATMOSPHERE_PA) < GAUGES_PA + 2 * common.offset_u
        absolute = "those of runs.csv are absolute" if bar > 0 else "the transducer's are absolute"
        reason = (
            f"this is one atmosphere: {absolute}, and gauge pressures are expected"
            if near
            else "the zero of a gauge or of the transducer (offset_v in campaign.toml) is off"
        )
        message = (
            f"the pressures of runs.csv are {size} in most of {common.shots} "
            f"shots, whatever the pressure; {reason}"
        )
    else:
        reasons = _units("pressure", common) or [
            "the sensitivity of the transducer in campaign.toml is wrong"
        ]
        message = (
            f"the pressures of runs.csv are {common.factor:.3g} times the recorded ones (95 %: "
            f"{common.low:.3g} to {common.high:.3g}) in most of {common.shots} shots; this would "
            f"explain it: {', or '.join(reasons)}, or the regulator's gauge is off by this factor"
        )
    return Finding(
        COMMON_PRESSURE, "warning", f"{message}. {USED_PRESSURE}", tank, _evidence(common)
    )
