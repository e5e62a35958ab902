"""Pulses of benches whose laws of contact are not the twin's: those of the virtual bench, and its
second laws.

Each bench has effects of its own at strengths of its own. What is measured scatters: velocities by
1 % (a hand's by 3 %), pulses of a configuration by 2 % in force and 1 % in time for how it was set
up, and again from hit to hit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pyroshock.dataset.predictors import shipped
from pyroshock.dataset.table import POINTS, PulseTable
from pyroshock.twin.setting import THESIS
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import Impactor, ImpactTarget, hammer, projectile, target
from pyroshock.virtualbench.impact.strike import strike_many
from pyroshock.virtualbench.second_laws.contact import contact_forces

Floats = NDArray[np.float64]
Word = str | float

THICKNESS_M, PLATE_AREA_M2, HAMMER_KG = 0.010, 0.3, 0.32
_EFFECTS = tuple(
    f"contact.{name}"
    for name in (
        "viscous_loss",
        "plastic_yield",
        "layer_compliance",
        "plate_compliance",
        "effective_mass",
    )
)
_STRENGTHS = (0.5, 2.0)
_FORCE_SCATTER, _TIME_SCATTER, _POINT_NOISE = 0.02, 0.01, 0.003
_VELOCITY_SCATTER = {"gun": 0.01, "hammer": 0.03}
_LAYERS = ("none/none", "aluminum/none", "aluminum/polymeric", "steel/none", "steel/polymeric")
_FACTORS: Mapping[str, Mapping[str, Sequence[Word]]] = {
    "gun": {
        "mass": (0.2, 0.5, 1.0), "tip": ("PLA", "aluminum", "steel"), "radius": (0.03, 0.045, 0.06),
        "plate": ("aluminum", "steel"), "layers": _LAYERS, "velocity": (4.0, 8.0, 13.0, 18.0),
    },
    "hammer": {
        "tip": ("aluminum", "delrin", "polyurethane"), "layers": _LAYERS,
        "velocity": (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.65, 1.8, 2.0),
    },
}  # fmt: skip
_HAMMER_RADIUS_M = {"aluminum": 0.03, "delrin": 0.03, "polyurethane": 0.015}


@dataclass(frozen=True)
class LawBench:
    """`kind` is gun or hammer; `laws` are "first" (the virtual bench's), or a split of the second
    laws."""

    kind: str
    laws: str
    strengths: Mapping[str, float]

    @classmethod
    def drawn(cls, kind: str, laws: str, rng: np.random.Generator) -> LawBench:
        """Each effect has with probability one half a strength from a half to two of its usual one;
        else it does not act or, among the first laws, acts as usual."""
        low, high = np.log(_STRENGTHS)
        strengths = {
            name: float(np.exp(rng.uniform(low, high))) for name in _EFFECTS if rng.random() < 0.5
        }
        return cls(kind, laws, strengths)

    def __str__(self) -> str:
        return f"{self.kind}, {self.laws} laws"

    def forces(
        self,
        impactors: Sequence[Impactor],
        targets: Sequence[ImpactTarget],
        speed: Floats,
        rng: np.random.Generator,
    ) -> list[tuple[float, Floats]]:
        """Contact time (s) and true force (points,) in N at equal phases of each impact."""
        if self.laws != "first":
            histories = contact_forces(impactors, targets, self.strengths, self.laws, speed)
            return [(step * force.size, np.append(force, 0.0)) for step, force in histories]
        effects = Effects.default()
        for name in _EFFECTS:
            effects = effects.with_strength(name, self.strengths.get(name, 1.0))
        pulses = []
        for truth in strike_many(impactors, targets, effects, speed, rng):
            phases = np.linspace(0.0, truth.contact_time_s, 40 * POINTS)
            pulses.append(
                (
                    truth.contact_time_s,
                    np.maximum(np.interp(phases, truth.time_s, truth.force_n), 0.0),
                )
            )
        return pulses


def drawn_pulses(
    bench: LawBench,
    configurations: int,
    repetitions: int,
    rng: np.random.Generator,
    *,
    campaign: str,
    without: Collection[str] = (),
) -> PulseTable:
    """A campaign of random configurations, none of those in `without` (names as in
    `PulseTable.configuration`)."""
    rows = _drawn_rows(bench.kind, configurations, rng, without)
    rows = [row for row in rows for _ in range(repetitions)]
    n, gun = len(rows), bench.kind == "gun"
    masses = [float(row.get("mass", HAMMER_KG)) for row in rows]
    radii = [float(row.get("radius", _HAMMER_RADIUS_M.get(str(row["tip"]), 0.0))) for row in rows]
    tips, plates = (
        [str(row["tip"]) for row in rows],
        [str(row.get("plate", "aluminum")) for row in rows],
    )
    anvils, layers = zip(*(str(row["layers"]).split("/") for row in rows), strict=True)
    bodies = zip(tips, radii, masses, strict=True)
    impactors = [
        projectile(mass, tip, radius) if gun else hammer(tip, radius)
        for tip, radius, mass in bodies
    ]
    below = zip(plates, anvils, layers, strict=True)
    targets = [
        target(plate, THICKNESS_M, anvil_material=anvil, insulator=layer)
        for plate, anvil, layer in below
    ]
    nominal = np.array([float(row["velocity"]) for row in rows])
    speed = nominal * np.exp((0.02 if gun else 0.1) * rng.standard_normal(n))
    pulses = bench.forces(impactors, targets, speed, rng)
    member = np.arange(n) // repetitions
    scatter = rng.standard_normal((configurations, 2))[member] + rng.standard_normal((n, 2))
    time = np.array([duration for duration, _ in pulses]) * np.exp(_TIME_SCATTER * scatter[:, 0])
    gain = np.exp(_FORCE_SCATTER * scatter[:, 1])
    fine = np.array(
        [np.interp(np.linspace(0, 1, 400), np.linspace(0, 1, f.size), f) for _, f in pulses]
    )
    fine *= gain[:, None]
    points = np.array(
        [np.interp(np.linspace(0, 1, POINTS), np.linspace(0, 1, 400), force) for force in fine]
    )
    peak = fine.max(axis=1)
    points[:, 1:-1] += _POINT_NOISE * peak[:, None] * rng.standard_normal((n, POINTS - 2))
    measured = speed * np.exp(_VELOCITY_SCATTER[bench.kind] * rng.standard_normal(n))
    faces = [
        plate if anvil == "none" else anvil for plate, anvil in zip(plates, anvils, strict=True)
    ]
    names = np.array([_name(row) for row in rows])
    columns: dict[str, Floats | list[float]] = {
        "tip_radius": radii, "impact_velocity": measured, "bullet_mass": masses,
        "anvil_material": [float(("none", "aluminum", "steel").index(anvil)) for anvil in anvils],
        "insulator": [float(layer == "polymeric") for layer in layers],
        "boundary_conditions": [0.0] * n,
        "plate_mass": [
            THICKNESS_M * PLATE_AREA_M2 * THESIS[plate].density_kg_m3 for plate in plates
        ],
    }  # fmt: skip
    for part, materials in (("tip", tips), ("plate", faces)):
        for quantity, unit in (("youngs_modulus", "_pa"), ("poisson_ratio", ""),
                               ("density", "_kg_m3"), ("yield_strength", "_pa")):  # fmt: skip
            columns[f"{part}_{quantity}"] = [
                float(getattr(THESIS[name], quantity + unit) or 0) for name in materials
            ]
    predictors = shipped(bench.kind).predictors
    top = fine.argmax(axis=1) / (fine.shape[1] - 1)
    impulse = np.trapezoid(fine, axis=1) / (fine.shape[1] - 1) * time
    return PulseTable(
        predictors=predictors,
        x=np.column_stack([columns[predictor.name] for predictor in predictors]),
        impactor_mass_kg=np.array(masses),
        plate_thickness_m=np.full(n, THICKNESS_M),
        force_n=points,
        contact_time_s=time,
        compression_time_s=top * time,
        peak_force_n=peak,
        impulse_n_s=impulse,
        compression_impulse_n_s=impulse / 2,
        configuration=names,
        treatment=names,
        tip_material=np.array(tips),
        target_material=np.array(faces),
        campaign=np.full(n, campaign),
        run=member.astype(np.int64),
        repetition=np.arange(n) % repetitions + 1,
        key=np.array([f"{campaign}-{row:05d}" for row in range(n)]),
        pulse_id=np.arange(1, n + 1),
        sample_s=np.full(n, 1e-5 if gun else 1 / 51_200),
    )


def _name(row: Mapping[str, Word]) -> str:
    return "/".join(f"{factor}={row[factor]}" for factor in sorted(row))


def _drawn_rows(
    kind: str, count: int, rng: np.random.Generator, without: Collection[str]
) -> list[Mapping[str, Word]]:
    """Different configurations, each factor's levels about equally often; layers are an anvil and
    its insulator."""
    rows: dict[str, Mapping[str, Word]] = {}
    while len(rows) < count:
        columns = {
            factor: [levels[i] for i in rng.permutation(np.arange(count) % len(levels))]
            for factor, levels in _FACTORS[kind].items()
        }
        for values in zip(*columns.values(), strict=True):
            row = dict(zip(columns, values, strict=True))
            if _name(row) not in without and len(rows) < count:
                rows.setdefault(_name(row), row)
    return list(rows.values())
