"""What `runs.csv` says of a shot, held against its recording: the velocity against the laser's, the
tank's pressure against the transducer's."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...signals.checks.base import Finding
from ..folder.runs_table import RunRow
from .gunshot import ShotMeasurement, reported_uncertainty

VELOCITY, PRESSURE = "velocity-differs", "pressure-differs"


#: Two values of one quantity may differ by so many of their standard uncertainties, and by this
#: share beside.
UNCERTAINTIES, SHARE = 3.0, 0.05


#: What gauges of a regulator and of a recorder differ by at any pressure (Pa).
GAUGES_PA = 3e3


#: The velocity at the plate over that at the laser: gas still pushes behind the vents, or friction
#: brakes. 108 shots of the virtual gun have 0.69 to 1.25.
AT_PLATE = (0.6, 1.6)


@dataclass(frozen=True)
class ValuePair:
    """The value of runs.csv and the recording's for one shot, with standard uncertainties (SI).
    `allowed`: what they may differ by whatever the value; `ratios`: between which the row's may lie
    over the recording's."""

    row: float
    row_u: float
    read: float
    read_u: float
    ratios: tuple[float, float] = (1 - SHARE, 1 + SHARE)
    allowed: float = 0.0
    bullet_length_m: float | None = None

    def differs(self, factor: float = 1.0, offset: float = 0.0) -> bool:
        """Whether they do once the row's value less `offset` is divided by `factor`."""
        row, row_u = (self.row - offset) / factor, self.row_u / factor
        margin = UNCERTAINTIES * math.hypot(row_u, self.read_u) + self.allowed
        return not self.ratios[0] * self.read - margin <= row <= self.ratios[1] * self.read + margin


def velocity_pair(
    row: float, row_u: float | None, read: float, read_u: float | None, length_m: float | None
) -> ValuePair:
    """Of two velocities at the muzzle (m/s)."""
    return ValuePair(row, row_u or 0.0, read, read_u or 0.0, bullet_length_m=length_m)


def pressure_pair(row: float, read: float, read_u: float | None) -> ValuePair:
    """Of two gauge pressures (Pa)."""
    return ValuePair(row, 0.0, read, read_u or 0.0, allowed=GAUGES_PA)


USED_VELOCITY = "Datasets and the diagnosis use the velocity of runs.csv"


USED_PRESSURE = (
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
                row.impact_velocity_m_s, row.impact_velocity_u_m_s or 0.0, read, read_u, AT_PLATE
            )
            pairs.append(("impact_velocity_m_s", pair))
        for column, pair in pairs:
            if pair.differs():
                message = (
                    f"{column} of runs.csv is {pair.row:.4g} m/s and the laser shows {read:.4g} "
                    f"m/s (standard uncertainty {read_u:.2g} m/s): their ratio is "
                    f"{pair.row / read:.3g}, and {pair.ratios[0]:.3g} to {pair.ratios[1]:.3g} is "
                    f"expected beyond {UNCERTAINTIES:g} uncertainties. {USED_VELOCITY}"
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
                f"{pair.read_u / 1e5:.2g} bar): they differ by more than {UNCERTAINTIES:g} "
                f"uncertainties, {SHARE:.0%} and {GAUGES_PA / 1e5:g} bar together. "
                f"{USED_PRESSURE}"
            )
            evidence = {"row_pa": set_pa, "recorded_pa": pair.read, "recorded_u_pa": pair.read_u}
            findings.append(Finding(PRESSURE, "warning", message, tank, evidence))
    return findings
