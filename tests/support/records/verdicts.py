"""A made-up diagnosis with every part filled, for tests of what is done with one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pyroshock.diagnosis.pictures import CurvePicture, Pictures, ResidualPicture
from pyroshock.diagnosis.verdict import (
    Band,
    Cause,
    Fitted,
    GapSize,
    NextRun,
    Region,
    Shrinkage,
    StageShare,
    TimeWindow,
    Verdict,
    Where,
)
from pyroshock.twin.effects import effect

LAYER = effect("contact.layer_compliance", compliance_m_n=3.4e-8)
VALVE = effect("gun.valve_flow")


def verdict(**changed: Any) -> Verdict:
    """A gun campaign with a layer under the tip, told as a group of two."""
    whole = Verdict(
        campaign="spring",
        simulator="gun:adiabatic | contact:hertz | plate:modal",
        gap=GapSize("rms of ln", 0.041, 0.009, 0.01, True),
        where=Where(
            stage=(StageShare("contact", 0.97, (0.93, 1.0), 4.2), StageShare("gun", 0.03, (-0.02, 0.06), 0.4)),
            factors=(Region("insulator = polymeric", 3.1, 0.001),),
            time=(TimeWindow("force", 0.0001, 0.0004),),
            frequency=(Band("force", 800.0, 4000.0),),
            drift=("ln_peak of the contact falls by 0.1 % a run (p = 0.03)",),
        ),
        causes=(
            Cause(
                ("contact.layer_compliance", "contact.plate_compliance"),
                0.93,
                (Fitted("compliance_m_n", 3.4e-8, "m/N", (3.1e-8, 3.8e-8)),),
                (0.8, 0.2),
                (LAYER,),
            ),
            Cause(("unknown",), 0.06),
            Cause(("none",), 0.01),
        ),
        shrinkage=(
            Shrinkage(("contact.layer_compliance",), "configuration", 0.041, 0.011, 0.94, (0.88, 0.97)),
            Shrinkage(("contact.layer_compliance",), "corner: tank_pressure > 2e+05", 0.05, 0.02, None, None),
        ),
        next_runs=(
            NextRun(
                "separates contact.layer_compliance from contact.plate_compliance",
                {"tank_pressure_bar": 0.3, "bullet_mass_kg": 1.0, "tip_material": "steel"},
                4,
            ),
        ),
        assumptions=("floor of 2 observables assumed: no repetitions",),
        seconds=12.3,
        fits={"contact.layer_compliance": (LAYER,), "gun.valve_flow": (VALVE,)},
        pictures=pictures(),
    )
    return replace(whole, **changed)


def none() -> Verdict:
    """Agreement: nothing to see."""
    return verdict(
        gap=GapSize("rms of ln", 0.008, 0.009, 0.01, False),
        where=Where(),
        causes=(Cause(("none",), 0.97), Cause(("unknown",), 0.03)),
        shrinkage=(),
        next_runs=(),
        fits={},
        pictures=Pictures(),
    )


def pictures() -> Pictures:
    configurations = tuple(f"{tip}, {bar} bar" for tip in ("steel", "aluminum", "PLA") for bar in (0.3, 0.6))
    before = np.array([0.05, 0.04, 0.03, np.nan, 0.06, 0.05])
    residual = ResidualPicture("ln_peak", "contact", "1", 0.03, before, 0.1 * before, np.full(6, 0.009))
    time = np.linspace(0.0, 4e-4, 50)
    pulse = np.sin(np.pi * time / 4e-4) * 1e4
    curve = CurvePicture("steel, 0.3 bar", "time", "s", "force", "N", time, pulse, 1.1 * pulse, 1.01 * pulse)
    lines = np.geomspace(100, 1e4, 30)
    spectrum = CurvePicture(
        "acceleration_1", "frequency", "Hz", "SRS", "m/s2", lines, lines * 9, lines * 11, lines * 9.1, True
    )
    return Pictures(configurations, (residual,), (curve, spectrum))
