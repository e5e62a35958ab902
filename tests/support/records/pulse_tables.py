"""Tables of pulses whose law is known, for tests of models: no store, no recording."""

from __future__ import annotations

import numpy as np
import pandas
from pyroshock.dataset.table import POINTS, Inputs, Predictor, PulseTable
from pyroshock.training.registry.loading import input_column

MASS_KG = 0.32
THICKNESS_M = 0.01

#: name: (Young's modulus Pa, Poisson ratio, density kg/m3, yield strength Pa), Table 4.2
MATERIALS = {
    "aluminum": (69.9e9, 0.33, 2700.0, 276e6),
    "steel": (200e9, 0.30, 7800.0, 400e6),
    "delrin": (3.2e9, 0.35, 1410.0, 71.7e6),
    "polyurethane": (0.03e9, 0.39, 1210.0, 51e6),
}

#: The thesis's 13 (Table 4.3), as `dataset/data/hammer.toml` names them.
PREDICTORS = (
    Predictor("tip_radius", "m"), Predictor("tip_youngs_modulus", "Pa"),
    Predictor("tip_poisson_ratio"),
    Predictor("tip_density", "kg/m3"), Predictor("tip_yield_strength", "Pa"),
    Predictor("impact_velocity", "m/s"),
    Predictor("plate_youngs_modulus", "Pa"), Predictor("plate_poisson_ratio"),
    Predictor("plate_density", "kg/m3"),
    Predictor("plate_yield_strength", "Pa"), Predictor("anvil_material", levels=("none", "aluminum",
    "steel")),
    Predictor("insulator", levels=("none", "polymeric")),
    Predictor("boundary_conditions", levels=("free", "fixed")),
)  # fmt: skip

_RADIUS_M = {"aluminum": 0.03, "delrin": 0.03, "polyurethane": 0.015}
_TIME_S = {"aluminum": 2e-4, "delrin": 6e-4, "polyurethane": 3e-3}
_LAYERS = (
    ("none", "none"),
    ("aluminum", "none"),
    ("aluminum", "polymeric"),
    ("steel", "none"),
    ("steel", "polymeric"),
)


def pulse_table(
    rng: np.random.Generator,
    repetitions: int = 10,
    noise: float = 0.02,
    positions: int = 1,
    campaign: str = "synthetic",
) -> PulseTable:
    """A hammer campaign of 60 x `positions` configurations (Table 4.1's 30 treatments, two speeds
    each).

    Truth: contact time T = T(tip, insulator) u^-0.2, impulse P = 1.6 m u, force as sin(pi t / T)^s
    with impulse P and s = 1, behind an insulator 1.3; times and impulses scatter by `noise`
    (log-normal), points by a fifth of it of the peak.
    """
    rows: list[tuple[int, int, str, str, str, str, float, str, str]] = []
    run = 0
    for position in range(1, positions + 1):
        for speed, nominal in (("low", 0.6), ("high", 1.3)):
            for tip in _TIME_S:
                for anvil, insulator in _LAYERS:
                    for boundary in ("free", "fixed"):
                        run += 1
                        treatment = f"{tip}/{anvil}/{insulator}/{boundary}"
                        configuration = f"#{position}/{speed}/{treatment}"
                        for repetition in range(1, repetitions + 1):
                            struck = nominal * float(np.exp(0.15 * rng.standard_normal()))
                            where = (configuration, treatment)
                            rows.append(
                                (run, repetition, tip, anvil, insulator, boundary, struck, *where)
                            )
    n = len(rows)
    x = np.array([_inputs_of(*row[2:7]) for row in rows])
    velocity = x[:, 5]
    soft = np.array([row[4] == "polymeric" for row in rows])
    time = np.array([_TIME_S[row[2]] for row in rows]) * np.where(soft, 1.3, 1.0) * velocity**-0.2
    time *= np.exp(noise * rng.standard_normal(n))
    impulse = 1.6 * MASS_KG * velocity * np.exp(noise * rng.standard_normal(n))
    phase = np.linspace(0.0, 1.0, POINTS)
    shape = np.sin(np.pi * phase) ** (1 + 0.3 * soft[:, None])
    shape /= np.trapezoid(shape, phase, axis=1)[:, None]
    force = impulse[:, None] / time[:, None] * shape
    force[:, 1:-1] += (
        noise / 5 * force.max(axis=1, keepdims=True) * rng.standard_normal((n, POINTS - 2))
    )
    return PulseTable(
        predictors=PREDICTORS,
        x=x,
        impactor_mass_kg=np.full(n, MASS_KG),
        plate_thickness_m=np.full(n, THICKNESS_M),
        force_n=force,
        contact_time_s=time,
        compression_time_s=phase[np.argmax(force, axis=1)] * time,
        peak_force_n=force.max(axis=1),
        impulse_n_s=np.trapezoid(force, phase, axis=1) * time,
        compression_impulse_n_s=0.5 * np.trapezoid(force, phase, axis=1) * time,
        configuration=np.array([row[7] for row in rows]),
        treatment=np.array([row[8] for row in rows]),
        tip_material=np.array([row[2] for row in rows]),
        target_material=np.array(["aluminum" if row[3] == "none" else row[3] for row in rows]),
        campaign=np.full(n, campaign),
        run=np.array([row[0] for row in rows], dtype=np.int64),
        repetition=np.array([row[1] for row in rows], dtype=np.int64),
        key=np.array([f"{campaign}-{i:06d}" for i in range(n)]),
        pulse_id=np.arange(1, n + 1),
    )


def _inputs_of(tip: str, anvil: str, insulator: str, boundary: str, velocity: float) -> list[float]:
    """One row of x: the first layer that is hit is the anvil, or the plate of aluminium."""
    layer = MATERIALS["aluminum" if anvil == "none" else anvil]
    levels = (
        ("none", "aluminum", "steel").index(anvil),
        int(insulator == "polymeric"),
        int(boundary == "fixed"),
    )
    return [_RADIUS_M[tip], *MATERIALS[tip], velocity, *layer, *map(float, levels)]


def held_out(
    table: PulseTable, rng: np.random.Generator, per_configuration: int = 2
) -> tuple[PulseTable, PulseTable]:
    """Training and test rows: `per_configuration` repetitions of each configuration are held
    out."""
    test = np.zeros(len(table), dtype=bool)
    for configuration in np.unique(table.configuration):
        rows = np.flatnonzero(table.configuration == configuration)
        test[rng.choice(rows, per_configuration, replace=False)] = True
    return table.take(~test), table.take(test)


def inputs_at(table: PulseTable, **columns: float) -> Inputs:
    """The table's inputs with some predictors set to a value."""
    x = table.x.copy()
    names = [predictor.name for predictor in table.predictors]
    for name, value in columns.items():
        x[:, names.index(name)] = value
    return Inputs(table.predictors, x, table.impactor_mass_kg, table.plate_thickness_m)


def frame_of_inputs(inputs: Inputs, levels: bool = True) -> pandas.DataFrame:
    """Impacts as MLflow's models take them: a column for each predictor, categories by the names of
    their levels."""
    columns: dict[str, list[float] | list[str]] = {}
    for values, predictor in zip(inputs.x.T, inputs.predictors, strict=True):
        named = predictor.levels and levels
        columns[input_column(predictor)] = (
            [predictor.levels[int(v)] for v in values] if named else values.tolist()
        )
    bench = {
        "impactor_mass_kg": inputs.impactor_mass_kg,
        "plate_thickness_m": inputs.plate_thickness_m,
    }
    return pandas.DataFrame({**bench, **columns})
