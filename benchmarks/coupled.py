"""`python -m benchmarks.coupled [errors]`: impacts solved together with the modes of a plate.

The measurement compares 1,000 impacts on all modes of a plate up to 20 kHz (`CoupledContact`) with
the plate without edges (`LawContact` with the effect `contact.plate_compliance`), both as stages of
the chain, one core each.

`errors` shows where contact and plate have to be solved together. Truth is the virtual bench with
echoes: its own contact and its own plate of Mindlin elements, whose edges act on the contact. Its
losses are off, so that the twin's law of Hertz is its law. The twin answers with a rigid target,
with the plate without edges, and coupled, with modes of its own elements. A row for each thickness
and tip gives the bench's peak force, contact time and impulse over m u, and the errors of the
three.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.app.twins.benches import OUTLINE_M, THICKNESS_M, PlateDrawing
from pyroshock.app.twins.building import solved
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.stage import NO_SPREAD, LawContact
from pyroshock.twin.contact_interface import ContactStage, ImpactBatch
from pyroshock.twin.coupled_contact import CoupledContact
from pyroshock.twin.plate.build import ConstantDamping, PlateBuild, named_points
from pyroshock.twin.plate.modes import solve_plate
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import THESIS, Setting
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import Impactor, contact_material, target
from pyroshock.virtualbench.impact.echoes import PlateEchoes
from pyroshock.virtualbench.impact.strike import ImpactTruth, strike_many
from pyroshock.virtualbench.plate.build import resonant_plate
from pyroshock.virtualbench.plate.modes import modes

from .harness import Figure, compared, processor_seconds, report, table_row, take_turns

THEME = "Impacts solved together with the plate"
IMPACTS, REPEATS, LIMIT, HIGHEST_HZ = 1000, 5, 10.0, 20e3
PLATE = THESIS["aluminum"]
#: The bench's plate gives way to a hard tip in steps that grow small with its thickness: those take
#: hours.
TIPS = {
    0.003: ("delrin", "polyurethane"),
    0.005: ("delrin", "polyurethane"),
    0.010: ("steel", "delrin", "polyurethane"),
    0.020: ("steel", "delrin", "polyurethane"),
}
MASS_KG, RADIUS_M, SPEED_M_S, ERRORS_HIGHEST_HZ = 0.5, 0.03, 5.0, 10e3


def measure_coupled(folder: Path, count: int = IMPACTS, repeats: int = REPEATS) -> Iterator[Figure]:
    """Bullets of 0.5 kg on the bench's plate of aluminium, 1 to 20 m/s."""
    drawing, velocity = PlateDrawing.of(OUTLINE_M, "shipped"), np.linspace(1.0, 20.0, count)
    plate = solved(drawing, PLATE, HIGHEST_HZ, folder / "plates")
    uncoupled = LawContact(effects=[PlateCompliance(1.0)], spread=NO_SPREAD)
    coupled = CoupledContact(LawContact(spread=NO_SPREAD), PlateStage({"aluminum": plate}))
    mass = drawing.area_m2 * THICKNESS_M * PLATE.density_kg_m3
    for tip in TIPS[0.010]:
        body = (MASS_KG, THESIS[tip], 0.045, PLATE, THICKNESS_M, mass)
        strikes = ImpactBatch(
            [Setting(*body, impact_velocity_m_s=float(u)) for u in velocity], velocity
        )
        functions = {
            "coupled": partial(coupled.pulses, strikes),
            "uncoupled": partial(uncoupled.pulses, strikes),
        }
        seconds = take_turns(functions, repeats, processor_seconds)
        yield compared(
            THEME, f"{count:,} impacts with a tip of {tip}, {plate.frequency_hz.size} modes",
            seconds["coupled"],
            seconds["uncoupled"], "s", limit=LIMIT, bound="the plate without edges", kind="bound",
        )  # fmt: skip


def bench_impacts(thickness_m: float) -> Iterator[ImpactTruth]:
    """One impact of each tip on the first impact point of a free plate of the bench's outline."""
    build = replace(
        resonant_plate("aluminum", "free", np.random.default_rng(0)), thickness_m=thickness_m
    )
    plate, body = (
        modes(build, Effects.none(), max_frequency_hz=ERRORS_HIGHEST_HZ),
        target("aluminum", thickness_m),
    )
    echoes = PlateEchoes(
        plate.frequencies_hz, plate.damping, plate.shape_impact[0], body.plate_impedance_n_s_m
    )
    elastic = Effects.none().with_strength("contact.plate_compliance", 1.0)
    for tip in TIPS[thickness_m]:
        impactor, rng = Impactor(contact_material(tip), RADIUS_M, MASS_KG), np.random.default_rng(0)
        yield strike_many(
            [impactor], [body], elastic, [SPEED_M_S], rng, steps_per_contact=100, echoes=echoes
        )[0]


def error_rows(thickness_m: float) -> Iterator[str]:
    build = resonant_plate("aluminum", "free", np.random.default_rng(0))
    plate = solve_plate(
        PlateBuild(
            build.outline_m, thickness_m, PLATE, named_points({"#1": build.impact_points_m[0]}),
            named_points({"acceleration_1": build.sensors[0].position_m}),
            damping=ConstantDamping(0.005),
        ),
        ERRORS_HIGHEST_HZ,
    )  # fmt: skip
    stages: tuple[ContactStage, ...] = (
        LawContact(spread=NO_SPREAD),
        LawContact(effects=[PlateCompliance(1.0)], spread=NO_SPREAD),
        CoupledContact(LawContact(spread=NO_SPREAD), PlateStage({"aluminum": plate})),
    )
    mass = build.area_m2 * thickness_m * PLATE.density_kg_m3
    for tip, truth in zip(TIPS[thickness_m], bench_impacts(thickness_m), strict=True):
        setting = Setting(
            MASS_KG, THESIS[tip], RADIUS_M, PLATE, thickness_m, mass, impact_velocity_m_s=SPEED_M_S
        )
        strikes = ImpactBatch([setting], np.array([SPEED_M_S]))
        truths = (
            truth.peak_force_n,
            truth.contact_time_s,
            float(np.trapezoid(truth.force_n, truth.time_s)),
        )
        cells = [f"{thickness_m * 1e3:g} mm", tip, f"{truths[0] / 1e3:.3g} kN",
        f"{truths[1] * 1e3:.3g} ms",
                 f"{truths[2] / MASS_KG / SPEED_M_S:.2f}"]  # fmt: skip
        for pulses in (stage.pulses(strikes) for stage in stages):
            figures = pulses.peak_force_n[0], pulses.contact_time_s[0], pulses.impulse_n_s[0]
            pairs = zip(figures, truths, strict=True)
            cells.append(
                " / ".join(f"{100 * (figure / true - 1):+.0f} %" for figure, true in pairs)
            )
        yield table_row(*cells)


if __name__ == "__main__":
    if sys.argv[1:] == ["errors"]:
        for thickness in TIPS:
            for row in error_rows(thickness):
                print(row, flush=True)
    else:
        sys.exit(report(measure_coupled))
