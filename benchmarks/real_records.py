"""`python -m benchmarks.real_records [FOLDER]`: the virtual bench beside real records, as a picture
and in figures.

FOLDER holds the measured records of others (default: where the tests look for them). The left panel
shows a modal hammer's hit and the virtual hammer's, the middle one pulse width against peak force
of 33 small hits, of which hammer and tip are not known, the right one the five gun shots of Table
3.1. The picture goes to docs/images/virtual-bench.png; the command prints its figures.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import fire
from pyroshock.virtualbench.impact.build import hammer, target
from pyroshock.virtualbench.impact.strike import strike_many

from .harness import ROOT
from .independent_figures import REAL_DATA, shipped_records

PICTURE = ROOT / "docs" / "images" / "virtual-bench.png"
REAL, VIRTUAL = "#1b6ca8", "#d1495b"
#: Tests 1, 2, 4, 5, 3 of Table 3.1: gauge pressure (bar) and velocity (m/s) of a bullet of 142.8 g.
SHOTS = ((0.2319, 10.366), (0.2651, 11.872), (0.4042, 13.799), (0.5784, 16.346), (0.6158, 18.973))
#: The transducer error with which the virtual gun's free figures were chosen.
OFFSET_BAR = 0.05

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Hits:
    """Peak force (N) and width at half of it (s), by hit."""

    peak_n: Floats
    width_s: Floats

    @property
    def slope(self) -> float:
        return float(np.polyfit(np.log(self.peak_n), np.log(self.width_s), 1)[0])


def small_hits(folder: Path) -> Hits:
    """The 33 hits of the vrtac records."""
    records = [record for record in shipped_records(folder) if record.origin == "vrtac"]
    pulses = [extract_pulses(record.samples, record.rate_hz)[0] for record in records]
    return Hits(
        np.array([p.peak_force_n for p in pulses]), np.array([p.width_half_s for p in pulses])
    )


def virtual_hits(hits: int = 33) -> Hits:
    """A small hammer with a hard plastic tip on a heavy steel plate, over the same range of
    forces."""
    impactor, plate = hammer("delrin", 0.003, mass_kg=0.005), target("steel", 0.04)
    velocities, rng = np.geomspace(0.05, 0.32, hits), np.random.default_rng(1)
    truths = strike_many([impactor] * hits, [plate] * hits, Effects.default(), velocities, rng)
    ends = np.array([_half(t.time_s, t.force_n) for t in truths])
    return Hits(np.array([t.peak_force_n for t in truths]), ends[:, 1] - ends[:, 0])


def _half(time_s: Floats, force_n: Floats) -> tuple[float, float]:
    """Where the force passes half of its peak, up and down, between samples."""
    half, above = force_n.max() / 2, np.flatnonzero(force_n >= force_n.max() / 2)
    first, last = int(above[0]), int(above[-1])
    up = np.interp(half, force_n[first - 1 : first + 1], time_s[first - 1 : first + 1])
    down = np.interp(-half, -force_n[last : last + 2], time_s[last : last + 2])
    return float(up), float(down)


def modal_hit(folder: Path) -> tuple[Floats, Floats]:
    """Time (s) and force (N) around the peak of the ladisk record."""
    (record,) = (record for record in shipped_records(folder) if record.origin == "ladisk")
    peak = int(record.samples.argmax())
    return np.arange(-25, 26) / record.rate_hz, record.samples[peak - 25 : peak + 26]


def virtual_hit() -> tuple[Floats, Floats]:
    """The virtual hammer with an aluminium tip on a steel anvil."""
    (truth,) = strike_many(
        [hammer("aluminum", 0.030)], [target("aluminum", 0.01, anvil_material="steel")],
        Effects.default(),
        np.array([0.3]), np.random.default_rng(2),
    )  # fmt: skip
    return truth.time_s, truth.force_n


def virtual_shots(offset_bar: float) -> Floats:
    """Muzzle velocities (m/s) at the pressures of Table 3.1, true pressures higher by
    `offset_bar`."""
    effects = Effects.default().with_strength("bench.hand_scatter", 0.0)
    gun, bullet = GunBuild(), Projectile()
    fired = [
        fire(gun, effects, (bar + offset_bar) * 1e5, bullet, np.random.default_rng(0))
        for bar, _ in SHOTS
    ]
    return np.array([shot.muzzle_velocity_m_s for shot in fired])


def main(folder: Path) -> int:
    figure = new_figure(13, 4)
    left, middle, right = figure.subplots(1, 3)
    _draw_pulses(left, modal_hit(folder), virtual_hit())
    _draw_widths(middle, small_hits(folder), virtual_hits())
    _draw_shots(right)
    figure.savefig(PICTURE, dpi=110)
    print(f"written: {PICTURE.relative_to(ROOT)}")
    return 0


def _draw_pulses(axes: Any, real: tuple[Floats, Floats], virtual: tuple[Floats, Floats]) -> None:
    for (time_s, force_n), colour, style, name in (
        (real, REAL, "o", "modal hammer, recorded"),
        (virtual, VIRTUAL, "-", "virtual hammer"),
    ):
        up, down = _half(time_s, force_n)
        time = (time_s - (up + down) / 2) / (down - up)
        axes.plot(time, force_n / force_n.max(), style, color=colour, ms=4, label=name)
    axes.set(xlim=(-1.8, 1.8), ylim=(-0.05, 1.3), xlabel="time over width at half maximum")
    axes.set_ylabel("force over peak force")
    axes.legend(frameon=False)


def _draw_widths(axes: Any, real: Hits, virtual: Hits) -> None:
    for hits, colour, name in ((real, REAL, "33 hits, recorded"), (virtual, VIRTUAL, "virtual")):
        label = f"{name}: slope {hits.slope:.3f}"
        axes.loglog(hits.peak_n, hits.width_s * 1e6, "o", color=colour, ms=4, label=label)
        forces = f"{hits.peak_n.min():.3g} to {hits.peak_n.max():.3g} N"
        print(
            f"{label}, {forces}, {hits.width_s.min() * 1e6:.3g} to "
            f"{hits.width_s.max() * 1e6:.3g} us"
        )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("{x:g}")
    axes.tick_params(which="both", labelsize=7)
    axes.set(xlabel="peak force (N)", ylabel="width at half maximum (µs)")
    axes.legend(frameon=False)


def _draw_shots(axes: Any) -> None:
    bars, measured = np.array(SHOTS).T
    axes.plot(bars, measured, "o", color=REAL, label="five shots, recorded")
    for offset, style in ((0.0, "--"), (OFFSET_BAR, "-")):
        velocities = virtual_shots(offset)
        name = "virtual" if not offset else f"virtual, transducer {offset * 1e3:.0f} mbar low"
        axes.plot(bars, velocities, style, color=VIRTUAL, label=name)
        print(f"{name}: over measured {np.round(velocities / measured, 3).tolist()}")
    axes.set(xlabel="tank pressure, gauge (bar)", ylabel="muzzle velocity (m/s)")
    axes.legend(frameon=False)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else REAL_DATA))
