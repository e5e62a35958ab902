"""What runs.csv says of shots, held against their recordings: the velocity against the laser's, the
tank's pressure against the transducer's.

A finding for a shot that differs by more than its uncertainties and a share allow, and one for a
campaign most of whose shots differ alike: by a factor, as a wrong unit, bullet length or
sensitivity makes, or by a pressure, as absolute values for gauge ones do. The latter is made of
what is stored whenever it is asked for, because it changes with each shot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.impacts import Impact, Shot
from ..schema.recordings import RecordedChannel
from ..signals.checks.base import Finding
from .channel_mistakes import unit_mistakes
from .gunshot import ShotMeasurement
from .processing import MUZZLE_VELOCITY
from .runs import RunRow
from .stored_rows import reported_uncertainty

VELOCITY, PRESSURE = "velocity-differs", "pressure-differs"
COMMON_VELOCITY, COMMON_PRESSURE = "velocity-differs-throughout", "pressure-differs-throughout"
#: Two values of one quantity may differ by so many of their standard uncertainties, and by this
#: share beside.
_UNCERTAINTIES, _SHARE = 3.0, 0.05
#: What gauges of a regulator and of a recorder differ by at any pressure (Pa).
_GAUGES_PA = 3e3
#: The velocity at the plate over that at the laser: gas still pushes behind the vents, or friction
#: brakes. 108 shots of the virtual gun have 0.69 to 1.25.
_AT_PLATE = (0.6, 1.6)
#: So many shots are compared, so large a share of them must differ, and so large a share agree by
#: the correction.
_LEAST_SHOTS, _OFF_SHARE, _RIGHT_SHARE = 3, 2 / 3, 0.8
_ATMOSPHERE_PA = 101_325.0
#: Pressures that differ by less (in nats) cannot tell a factor from a constant.
_PRESSURE_SPAN = 0.2


@dataclass(frozen=True)
class ValuePair:
    """The value of runs.csv and the recording's for one shot, with standard uncertainties (SI).
    `allowed`: what they may differ by whatever the value; `ratios`: between which the row's may lie
    over the recording's."""

    row: float
    row_u: float
    read: float
    read_u: float
    ratios: tuple[float, float] = (1 - _SHARE, 1 + _SHARE)
    allowed: float = 0.0
    bullet_length_m: float | None = None

    def differs(self, factor: float = 1.0, offset: float = 0.0) -> bool:
        """Whether they do once the row's value less `offset` is divided by `factor`."""
        row, row_u = (self.row - offset) / factor, self.row_u / factor
        margin = _UNCERTAINTIES * math.hypot(row_u, self.read_u) + self.allowed
        return not self.ratios[0] * self.read - margin <= row <= self.ratios[1] * self.read + margin


def velocity_pair(
    row: float, row_u: float | None, read: float, read_u: float | None, length_m: float | None
) -> ValuePair:
    """Of two velocities at the muzzle (m/s)."""
    return ValuePair(row, row_u or 0.0, read, read_u or 0.0, bullet_length_m=length_m)


def pressure_pair(row: float, read: float, read_u: float | None) -> ValuePair:
    """Of two gauge pressures (Pa)."""
    return ValuePair(row, 0.0, read, read_u or 0.0, allowed=_GAUGES_PA)


_USED_VELOCITY = "Datasets and the diagnosis use the velocity of runs.csv"
_USED_PRESSURE = (
    "Datasets use tank_pressure_bar of runs.csv, the diagnosis uses the recorded pressure"
)


def check_shot(
    row: RunRow, shot: ShotMeasurement | None, laser: str | None, tank: str | None
) -> list[Finding]:
    """A `warning` for each value of `row` that differs from the recording's; `laser` and `tank` are
    channels."""
    findings: list[Finding] = []
    if shot is None:
        return findings
    if shot.velocity_m_s is not None and laser is not None:
        read, read_u = shot.velocity_m_s, shot.velocity_u_m_s or 0.0
        pairs = []
        if row.measured_velocity_m_s is not None:
            pair = velocity_pair(
                row.measured_velocity_m_s,
                reported_uncertainty(row),
                read,
                read_u,
                row.bullet_length_m,
            )
            pairs.append(("measured_velocity_m_s", pair))
        if row.impact_velocity_m_s is not None:
            pair = ValuePair(
                row.impact_velocity_m_s, row.impact_velocity_u_m_s or 0.0, read, read_u, _AT_PLATE
            )
            pairs.append(("impact_velocity_m_s", pair))
        for column, pair in pairs:
            if pair.differs():
                message = (
                    f"{column} of runs.csv is {pair.row:.4g} m/s and the laser shows {read:.4g} "
                    f"m/s (standard uncertainty {read_u:.2g} m/s): their ratio is "
                    f"{pair.row / read:.3g}, and {pair.ratios[0]:.3g} to {pair.ratios[1]:.3g} is "
                    f"expected beyond {_UNCERTAINTIES:g} uncertainties. {_USED_VELOCITY}"
                )
                evidence = {
                    "column": column,
                    "row_m_s": pair.row,
                    "laser_m_s": read,
                    "laser_u_m_s": read_u,
                }
                findings.append(Finding(VELOCITY, "warning", message, laser, evidence))
    set_pa = row.number("tank_pressure")
    if shot.tank_pressure_pa is not None and set_pa is not None and tank is not None:
        pair = pressure_pair(set_pa, shot.tank_pressure_pa, shot.tank_pressure_u_pa)
        if pair.differs():
            message = (
                f"tank_pressure_bar of runs.csv is {set_pa / 1e5:.4g} bar and "
                f"{pair.read / 1e5:.4g} bar is recorded before the shot (standard uncertainty "
                f"{pair.read_u / 1e5:.2g} bar): they differ by more than {_UNCERTAINTIES:g} "
                f"uncertainties, {_SHARE:.0%} and {_GAUGES_PA / 1e5:g} bar together. "
                f"{_USED_PRESSURE}"
            )
            evidence = {"row_pa": set_pa, "recorded_pa": pair.read, "recorded_u_pa": pair.read_u}
            findings.append(Finding(PRESSURE, "warning", message, tank, evidence))
    return findings


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
    """None where most shots agree, or differ each in its own way."""
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
        atmosphere = abs(abs(offset) - _ATMOSPHERE_PA) < _GAUGES_PA + 2 * shared * float(
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
    channels."""
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
        findings.append(_velocity_finding(of_impact, None, laser, "impact_velocity_m_s", _AT_PLATE))
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
                ValuePair(reported, reported_u, read["velocity_m_s"], laser_u, _AT_PLATE)
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


_RATIOS = (1 - _SHARE, 1 + _SHARE)


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
        f"outside of {ratios[0]:g} to {ratios[1]:g} times it by more than {_UNCERTAINTIES:g} of "
        "their uncertainties. One of these would explain it: "
        f"{'; '.join((*reasons, 'a clock or gain that is wrong'))}. {_USED_VELOCITY}: correct the "
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
        near = abs(abs(common.offset) - _ATMOSPHERE_PA) < _GAUGES_PA + 2 * common.offset_u
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
        COMMON_PRESSURE, "warning", f"{message}. {_USED_PRESSURE}", tank, _evidence(common)
    )
