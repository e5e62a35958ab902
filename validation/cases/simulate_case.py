"""Plays the runs of a case in their order, with background and scatter.

What force and acceleration channels record of a case's runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...virtualbench.gun.build import Projectile
from .case import GUN_KINDS, TOLERANCES, Case
from .contact_case import CasePulse, cell_reading, strikes
from .designs import CaseSetting
from .effect_size import loudest_n
from .gun_case import gun_of, ln_reading, ln_truth, ln_velocity
from .gun_trace import ShotRecords, shot_records, velocities_as_read
from .plates import changed, plate_of
from .ringing import SAMPLES, accelerations, pulses_of, sensor_readings
from .run_scatter import CaseRuns, PlateBackground, heavy, warped
from .unknown_effects import READINGS

#: Samples of a force recording without accelerations, and when (s) contact begins.
FORCE_SAMPLES, START_S = 2048, 4e-3
#: Noise: of the load cell (N, and share of the peak), of the accelerometers (share of the peak).
FORCE_NOISE_N, FORCE_NOISE, ACCELERATION_NOISE = 0.2, 1e-3, 5e-4


def recordings(
    runs: CaseRuns, speeds: Floats, rng: np.random.Generator, shots: ShotRecords | None = None
) -> Iterator[dict[str, Floats]]:
    """The recording of each run; with the recordings of its shots, as long as those."""
    case, loudest = runs.case, loudest_n(runs.case.kind, runs.case.design)
    true, read = _pulses(runs, speeds, rng, loudest)
    plated = case.kind in ("plate", "chain")
    length = SAMPLES if plated else FORCE_SAMPLES
    flights_s = np.zeros(len(runs.rows))
    beside: list[Mapping[str, NDArray[Any]]] = [{}] * len(runs.rows)
    if shots is not None:
        gun = gun_of(case.kind, case.design)
        length, beside = shots.samples, list(shots.channels)
        flights_s = (
            np.array(shots.exit_s)
            + (gun.travel_m(Projectile()) - gun.vent_position_m) / speeds
            - START_S
        )
    plate = PlateBackground.of(case) if plated else None
    modes = changed(plate_of(case.kind, case.design), case.strengths, case.laws) if plated else None
    time = np.arange(length) / case.sampling_rate_hz
    for r, (setting, pulse, shown) in enumerate(zip(runs.settings, true, read, strict=True)):
        start = START_S + float(rng.uniform(0, 1)) / case.sampling_rate_hz + float(flights_s[r])
        noise = FORCE_NOISE_N + FORCE_NOISE * shown.force_n.max()
        signals = {"force": shown.on(time - start) + noise * rng.standard_normal(length)}
        if plate is not None and modes is not None:
            loud, order = float(pulse.force_n.max()) / loudest, float(runs.order[r])
            now = runs.outside.modes(
                plate.applied(modes, int(runs.which[r]), rng), loud * loudest, loudest, order
            )
            ringing = accelerations(now, pulse, start, case.sampling_rate_hz, length) * plate.gains(
                rng
            )
            ringing = runs.outside.acceleration(
                setting, ringing, case.sampling_rate_hz, order, loud
            )
            felt_by = sensor_readings(ringing, case.sampling_rate_hz, case.strengths, case.laws)
            hiss = ACCELERATION_NOISE * np.abs(felt_by).max(axis=1, keepdims=True)
            felt_by = felt_by + hiss * rng.standard_normal(felt_by.shape)
            signals |= {f"acceleration_{k}": row for k, row in enumerate(felt_by, start=1)}
        yield {**beside[r], **signals}


def _pulses(
    runs: CaseRuns, speeds: Floats, rng: np.random.Generator, loudest: float
) -> tuple[list[CasePulse], list[CasePulse]]:
    """True pulses, and what the load cell shows of them."""
    case = runs.case
    if case.kind == "plate":
        base = pulses_of(runs.settings)
        nominal = np.array([s.speed_m_s for s in runs.settings])
        true = [p.scaled(v, 1.0) for p, v in zip(base, speeds / nominal, strict=True)]
        return true, [cell_reading(p, case.strengths, case.laws) for p in true]
    pulses = strikes(runs.settings, speeds, case.strengths, case.laws)
    tolerance, away = TOLERANCES["contact"], runs.background(4, "contact")
    spread = runs.spread("contact") * np.sqrt(3 / 4)  # peak, width and, with both, impulse
    # blows of one hand differ in shape too, in some campaigns as much as in height, in some not at
    # all
    share = np.random.default_rng([case.background.seed, 11]).uniform()
    shapes = away[:, 2:] + share * spread / tolerance * heavy(rng, len(pulses), 2)
    amplitude = np.exp(tolerance * away[:, 0] + spread * heavy(rng, len(pulses)))
    duration = np.exp(tolerance * away[:, 1] + spread * heavy(rng, len(pulses)))
    true = [
        warped(p, w, tolerance).scaled(a, t)
        for p, w, a, t in zip(pulses, shapes, amplitude, duration, strict=True)
    ]
    acted = [
        runs.outside.pulse(s, p, o, loudest)
        for s, p, o in zip(runs.settings, true, runs.order, strict=True)
    ]
    read = [cell_reading(p, case.strengths, case.laws) for p in acted]
    return (true if runs.outside.family in READINGS else acted), read


#: Standard uncertainty of a velocity that is read, and a hand's scatter about its level.
READING_U, HAND_SPREAD = 0.003, 0.12


@dataclass(frozen=True, eq=False)
class SimulatedCase:
    """One run as it is recorded; channels (n,) as campaign.toml has them, in SI but for volts."""

    setting: CaseSetting
    repetition: int
    velocity_m_s: float | None = None
    velocity_u_m_s: float | None = None
    channels: Mapping[str, NDArray[Any]] = field(default_factory=dict)


def simulate_case(case: Case, seed: int) -> Iterator[SimulatedCase]:
    """The runs of a case in their order."""
    runs = CaseRuns.of(case)
    rng = np.random.default_rng([seed, case.background.seed])
    true, read = _speeds(runs, rng)
    shown = (f"{v:.6g}" for v in read) if case.kind != "plate" else ("",) * len(runs.rows)
    recorded = [float(text) if text else None for text in shown]
    u = [READING_U * v if v and case.kind in GUN_KINDS else None for v in recorded]
    shots = None
    if case.traces:
        own_rng = np.random.default_rng(
            [seed, case.background.seed, 17]
        )  # the same velocities with and without
        shots = shot_records(runs, true, velocities_as_read(runs, true), own_rng)
    channels: Iterator[Mapping[str, NDArray[Any]]] = iter(
        shots.channels if shots else [{}] * len(runs.rows)
    )
    if case.kind != "gun":
        channels = recordings(runs, true, rng, shots)
    for (c, repetition), v, error, signals in zip(runs.rows, recorded, u, channels, strict=True):
        yield SimulatedCase(runs.plan[c], int(repetition) + 1, v, error, signals)


def _speeds(runs: CaseRuns, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """True and recorded speeds (R,)."""
    case, count = runs.case, len(runs.rows)
    reading = READING_U * rng.standard_normal(count)
    acting = case.strengths, case.laws
    if case.kind in ("hammer", "plate"):
        ln_true = np.log([s.speed_m_s for s in runs.settings]) + HAND_SPREAD * rng.standard_normal(
            count
        )
        return np.exp(ln_true), np.exp(
            ln_true + ln_reading(runs.settings, ln_true, *acting) + reading
        )
    ln_read = ln_velocity(case.kind, case.design, *acting)[runs.which]
    scatter = max(runs.spread("gun") ** 2 - READING_U**2, 0.0) ** 0.5 * heavy(rng, count)
    added = runs.outside.ln_velocity(runs.settings, ln_read, runs.order)
    ln_read = ln_read + scatter + added + TOLERANCES["gun"] * runs.background(1, "gun")[:, 0]
    misread = added if runs.outside.family == "gun.velocity_warm_up" else 0.0
    return np.exp(ln_truth(runs.settings, ln_read - misread, *acting)), np.exp(ln_read + reading)
