"""What force and acceleration channels record of a case's runs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...array_types import Floats
from .case import TOLERANCES
from .contact_case import CasePulse, cell_reading, strikes
from .heavy_tail import heavy
from .nominal import loudest_n
from .plates import changed, plate_of
from .ringing import SAMPLES, accelerations, felt, pulses_of
from .runs import CaseRuns
from .unknown_effects import READINGS
from .unsteady import PlateBackground, warped

#: Samples of a force recording without accelerations, and when (s) contact begins.
FORCE_SAMPLES, START_S = 2048, 4e-3
#: Noise: of the load cell (N, and share of the peak), of the accelerometers (share of the peak).
FORCE_NOISE_N, FORCE_NOISE, ACCELERATION_NOISE = 0.2, 1e-3, 5e-4


def recordings(runs: CaseRuns, speeds: Floats, rng: np.random.Generator) -> Iterator[dict[str, Floats]]:
    """The recording of each run."""
    case, loudest = runs.case, loudest_n(runs.case.kind, runs.case.design)
    true, read = _pulses(runs, speeds, rng, loudest)
    plated = case.kind in ("plate", "chain")
    length = SAMPLES if plated else FORCE_SAMPLES
    plate = PlateBackground.of(case) if plated else None
    modes = changed(plate_of(case.kind, case.design), case.strengths, case.laws) if plated else None
    time = np.arange(length) / case.sampling_rate_hz
    for r, (setting, pulse, shown) in enumerate(zip(runs.settings, true, read, strict=True)):
        start = START_S + float(rng.uniform(0, 1)) / case.sampling_rate_hz
        noise = FORCE_NOISE_N + FORCE_NOISE * shown.force_n.max()
        signals = {"force": shown.on(time - start) + noise * rng.standard_normal(length)}
        if plate is not None and modes is not None:
            loud, order = float(pulse.force_n.max()) / loudest, float(runs.order[r])
            now = runs.outside.modes(plate.applied(modes, int(runs.which[r]), rng), loud * loudest, loudest, order)
            ringing = accelerations(now, pulse, start, case.sampling_rate_hz, length) * plate.gains(rng)
            ringing = runs.outside.acceleration(setting, ringing, case.sampling_rate_hz, order, loud)
            felt_by = felt(ringing, case.sampling_rate_hz, case.strengths, case.laws)
            hiss = ACCELERATION_NOISE * np.abs(felt_by).max(axis=1, keepdims=True)
            felt_by = felt_by + hiss * rng.standard_normal(felt_by.shape)
            signals |= {f"acceleration_{k}": row for k, row in enumerate(felt_by, start=1)}
        yield signals


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
    # blows of one hand differ in shape too, in some campaigns as much as in height, in some not at all
    share = np.random.default_rng([case.background.seed, 11]).uniform()
    shapes = away[:, 2:] + share * spread / tolerance * heavy(rng, len(pulses), 2)
    amplitude = np.exp(tolerance * away[:, 0] + spread * heavy(rng, len(pulses)))
    duration = np.exp(tolerance * away[:, 1] + spread * heavy(rng, len(pulses)))
    true = [
        warped(p, w, tolerance).scaled(a, t) for p, w, a, t in zip(pulses, shapes, amplitude, duration, strict=True)
    ]
    acted = [runs.outside.pulse(s, p, o, loudest) for s, p, o in zip(runs.settings, true, runs.order, strict=True)]
    read = [cell_reading(p, case.strengths, case.laws) for p in acted]
    return (true if runs.outside.family in READINGS else acted), read
