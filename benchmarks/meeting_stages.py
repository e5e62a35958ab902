"""`python -m benchmarks.meeting_stages`: where contact and plate have to be solved together, on the virtual bench.

Truth is the virtual bench with echoes: its own contact and its own plate of Mindlin elements, whose edges act on the
contact. Its losses are off, so that the twin's law of Hertz is its law. The twin answers with a rigid target, with the
plate without edges (`contact.plate_compliance`), and coupled, with modes of its own elements. A row for each thickness
and tip: the bench's peak force, contact time and impulse over m u, and the errors of the three.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.stage import NO_SPREAD, LawContact
from pyroshock.twin.contact_interface import ContactStage, ForcePulses, ImpactBatch
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

#: The bench's plate gives way to a hard tip in steps that grow small with its thickness: those take hours.
TIPS = {
    0.003: ("delrin", "polyurethane"),
    0.005: ("delrin", "polyurethane"),
    0.010: ("steel", "delrin", "polyurethane"),
    0.020: ("steel", "delrin", "polyurethane"),
}
MASS_KG, RADIUS_M, SPEED_M_S = 0.5, 0.03, 5.0
HIGHEST_HZ = 10e3
_ELASTIC = Effects.none().with_strength("contact.plate_compliance", 1.0)


def bench_impacts(thickness_m: float) -> Iterator[ImpactTruth]:
    """One impact of each tip on the first impact point of a free plate of the bench's outline."""
    build = replace(resonant_plate("aluminum", "free", np.random.default_rng(0)), thickness_m=thickness_m)
    plate, struck = modes(build, Effects.none(), max_frequency_hz=HIGHEST_HZ), target("aluminum", thickness_m)
    echoes = PlateEchoes(plate.frequencies_hz, plate.damping, plate.shape_impact[0], struck.plate_impedance_n_s_m)
    for tip in TIPS[thickness_m]:
        impactor = Impactor(contact_material(tip), RADIUS_M, MASS_KG)
        yield strike_many(
            [impactor], [struck], _ELASTIC, [SPEED_M_S], np.random.default_rng(0), steps_per_contact=100, echoes=echoes
        )[0]


def twins(thickness_m: float) -> dict[str, ContactStage]:
    build = resonant_plate("aluminum", "free", np.random.default_rng(0))
    plate = solve_plate(
        PlateBuild(
            outline_m=build.outline_m,
            thickness_m=thickness_m,
            material=THESIS["aluminum"],
            impact_points=named_points({"#1": build.impact_points_m[0]}),
            sensors=named_points({"acceleration_1": build.sensors[0].position_m}),
            damping=ConstantDamping(0.005),
        ),
        HIGHEST_HZ,
    )
    return {
        "rigid": LawContact(spread=NO_SPREAD),
        "without edges": LawContact(effects=[PlateCompliance(1.0)], spread=NO_SPREAD),
        "coupled": CoupledContact(LawContact(spread=NO_SPREAD), PlateStage({"aluminum": plate})),
    }


def rows(thickness_m: float) -> Iterator[str]:
    area = resonant_plate("aluminum", "free", np.random.default_rng(0)).area_m2
    mass, stages = area * thickness_m * THESIS["aluminum"].density_kg_m3, twins(thickness_m)
    for tip, truth in zip(TIPS[thickness_m], bench_impacts(thickness_m), strict=True):
        setting = Setting(MASS_KG, THESIS[tip], RADIUS_M, THESIS["aluminum"], thickness_m, mass,
                          impact_velocity_m_s=SPEED_M_S)  # fmt: skip
        strikes = ImpactBatch([setting], np.array([SPEED_M_S]))
        impulse = float(np.trapezoid(truth.force_n, truth.time_s))
        cells = [f"{thickness_m * 1e3:g} mm", tip, f"{truth.peak_force_n / 1e3:.3g} kN",
                 f"{truth.contact_time_s * 1e3:.3g} ms", f"{impulse / MASS_KG / SPEED_M_S:.2f}"]  # fmt: skip
        truths = truth.peak_force_n, truth.contact_time_s, impulse
        cells += [_errors(stage.pulses(strikes), *truths) for stage in stages.values()]
        yield f"| {' | '.join(cells)} |"


def _errors(pulses: ForcePulses, peak_n: float, time_s: float, impulse_n_s: float) -> str:
    ratios = pulses.peak_force_n[0] / peak_n, pulses.contact_time_s[0] / time_s, pulses.impulse_n_s[0] / impulse_n_s
    return " / ".join(f"{100 * (share - 1):+.0f} %" for share in ratios)


def main() -> int:
    for thickness in TIPS:
        for row in rows(thickness):
            sys.stdout.write(row + "\n")
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
