"""`python -m benchmarks.coupled`: 1,000 impacts against the modes of a plate, beside the plate without edges.

Both as stages of the chain, in one process, in turn, one core each: `LawContact` with the effect
`contact.plate_compliance`, and `CoupledContact` on all modes of the plate up to 20 kHz. The exit code is 1 where
the promise is lost: ten times at most.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.app.twins.benches import OUTLINE_M, THICKNESS_M, PlateDrawing
from pyroshock.app.twins.building import solved
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.stage import NO_SPREAD, LawContact
from pyroshock.twin.contact_interface import ImpactBatch
from pyroshock.twin.coupled_contact import CoupledContact
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import THESIS, Setting

from .apart import busy_seconds_of, in_turn
from .figures import Figure
from .measuring import Spread, ratio

THEME = "Impacts solved together with the plate"
IMPACTS, REPEATS, MOST_TIMES, HIGHEST_HZ = 1000, 5, 10.0, 20e3
TIPS = ("steel", "delrin", "polyurethane")


def strikes(tip: str, count: int = IMPACTS) -> ImpactBatch:
    """Bullets of 0.5 kg on the bench's plate of aluminium, 1 to 20 m/s."""
    drawing = PlateDrawing.of(OUTLINE_M, "shipped")
    plate = THESIS["aluminum"]
    mass = drawing.area_m2 * THICKNESS_M * plate.density_kg_m3
    velocity = np.linspace(1.0, 20.0, count)
    settings = [
        Setting(0.5, THESIS[tip], 0.045, plate, THICKNESS_M, mass, impact_velocity_m_s=float(u)) for u in velocity
    ]
    return ImpactBatch(settings, velocity)


def measure_coupled(folder: Path, count: int = IMPACTS, repeats: int = REPEATS) -> Iterator[Figure]:
    plate = solved(PlateDrawing.of(OUTLINE_M, "shipped"), THESIS["aluminum"], HIGHEST_HZ, folder / "plates")
    uncoupled = LawContact(effects=[PlateCompliance(1.0)], spread=NO_SPREAD)
    coupled = CoupledContact(LawContact(spread=NO_SPREAD), PlateStage({"aluminum": plate}))
    for tip in TIPS:
        struck = strikes(tip, count)
        ways = {
            "coupled": partial(busy_seconds_of, partial(coupled.pulses, struck)),
            "uncoupled": partial(busy_seconds_of, partial(uncoupled.pulses, struck)),
        }
        for way in ways.values():
            way()  # compiled, and the plate's points made
        taken = in_turn(ways, repeats)
        yield Figure(
            THEME, f"{count:,} impacts with a tip of {tip}, {plate.frequency_hz.size} modes",
            Spread.of(taken["coupled"]).text(" s"), Spread.of(taken["uncoupled"]).text(" s"),
            ratio(taken["coupled"], taken["uncoupled"]), "at most", MOST_TIMES, "the plate without edges",
            of="bound",
        )  # fmt: skip


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        figures = list(measure_coupled(Path(folder)))
    sys.stdout.write("\n".join(figure.row() for figure in figures) + "\n")
    return 0 if all(figure.holds for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
