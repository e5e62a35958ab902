"""74 shots of a small gun, its valve not calibrated: `python -m docs.studies.small_gun
[SHOTS.csv]`.

What single effects and pairs leave of the gap, and how they predict a pressure that they were not
fitted to, beside a constant factor.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.gun.shot import GunEffect
from pyroshock.twin.gun.shots import gun_velocity

from .gun_causes import Fit, Floats, Gap, fit, gap, left_out, left_out_factor
from .real_guns import DART_KG, SMALL_GUN, STUCK_PA, TRETTEL, trettel_record

#: Pairs that a gun of this kind suggests: no tank without atmosphere, and a solenoid valve before a
#: small bore.
PAIRS = (
    ("gun.back_pressure", "gun.barrel_loss"),
    ("gun.back_pressure", "gun.dead_volume"),
    ("gun.barrel_loss", "gun.sliding_friction"),
    ("gun.blow_by", "gun.dead_volume"),
    ("gun.back_pressure", "gun.valve_flow"),
)

#: The same with an atmosphere of any pressure, which no place has: three causes that are one.
FREE = tuple(
    ("gun.back_pressure", other)
    for other in ("gun.dead_volume", "sensor.velocity_gain", "gun.valve_flow")
)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """ln measured over predicted (C,) of each pressure, by effects (or a factor) that the others
    chose."""

    name: str
    errors: Floats

    def rms(self, of: Gap) -> float:
        """Of the errors, with the noise of the means subtracted."""
        return float(np.sqrt(max(float(np.mean(self.errors**2 - of.s**2)), 0.0)))


def held_out(stage: GunObservables, of: Gap, ids: tuple[str, ...]) -> HeldOut:
    return HeldOut("+".join(ids), left_out(stage, of, ids))


def constant_factor(of: Gap) -> HeldOut:
    return HeldOut("constant factor", left_out_factor(of))


def stuck_stays(found: Fit) -> bool:
    """Whether the dart that stayed in the barrel at 25 psi stays there in the simulation, too."""
    effects = [each for each in found.effects if isinstance(each, GunEffect)]
    return not gun_velocity(SMALL_GUN, STUCK_PA, DART_KG, effects).left[0]


def said(found: Fit) -> str:
    """Parameters that are not off, three digits."""
    told = [
        f"{item.name} {getattr(each, item.name):.3g}"
        for each in found.effects
        for item in each.parameters()
        if item.likely is not None and getattr(each, item.name) != item.off
    ]
    return ", ".join(told) or "off"


def main(path: Path) -> None:
    stage = GunObservables(trettel_record(path))
    of = gap(stage)
    print("ln measured over nominal", np.round(of.y, 3), "standard errors", np.round(of.s, 4))
    factor = constant_factor(of)
    print("constant factor, held out", np.round(factor.errors, 3), f"rms {factor.rms(of):.3f}")
    for ids in [*((one,) for one in stage.shows), *PAIRS]:
        found = fit(stage, of, ids, anywhere=len(ids) == 1)
        left = np.round(of.y - found.change, 3)
        print(
            f"{found.name}: chi2 {found.chi2:.1f}, {said(found)}, likely "
            f"{found.likely}, left {left}",
            flush=True,
        )
        if np.max(np.abs(left)) < 0.2:
            told = held_out(stage, of, ids)
            print(
                f"  held out {np.round(told.errors, 3)} rms "
                f"{told.rms(of):.3f}, stuck {stuck_stays(found)}",
                flush=True,
            )
    for ids in FREE:
        found = fit(stage, of, ids, anywhere=True)
        print(f"{found.name}, any atmosphere: chi2 {found.chi2:.1f}, {said(found)}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else TRETTEL)
