"""What a withheld campaign's plate does: accelerations under a pulse, and the spectra in which they
are compared.

Shock response spectra of the bench's own: the ramp-invariant oscillator of Smallwood (1981),
maximax.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from ...virtualbench.plate.modes import PlateModes
from ...virtualbench.plate.respond import respond
from ...virtualbench.second_laws.sensors import accelerations_read
from ...virtualbench.sensors.filters import mounted, zero_shift
from .contact_case import CasePulse
from .designs import CaseSetting
from .plates import CasePlate

QUALITY = 10.0


def third_octaves(low_hz: float, high_hz: float) -> Floats:
    """Centres of the third octaves between two frequencies."""
    first, last = np.ceil(3 * np.log2(low_hz / 1000)), np.floor(3 * np.log2(high_hz / 1000))
    return np.asarray(1000 * 2 ** (np.arange(first, last + 1) / 3))


def spectrum_db(acceleration: Floats, sampling_rate_hz: float, frequency_hz: Floats) -> Floats:
    """Absolute acceleration, maximax, Q = 10, of records (..., n): 20 lg (..., lines)."""
    from scipy.signal import lfilter

    zeta, step = 1 / (2 * QUALITY), 1 / sampling_rate_hz
    levels = []
    for omega in 2 * np.pi * frequency_hz:
        decay, turn = np.exp(-zeta * omega * step), omega * np.sqrt(1 - zeta**2) * step
        c, s = decay * np.cos(turn), decay * np.sin(turn)
        ramp = s / turn
        b = [1 - ramp, 2 * (ramp - c), decay**2 - ramp]
        levels.append(np.abs(lfilter(b, [1.0, -2 * c, decay**2], acceleration)).max(axis=-1))
    return np.asarray(20 * np.log10(np.stack(levels, axis=-1)))


#: The force between two samples of the recorder is followed at so many times its rate.
RATIO = 8
SAMPLES = 8192
#: An accelerometer's mounting resonates here at strength 1 of sensor.mount_resonance.
MOUNT_HZ, MOUNT_DAMPING = 45e3, 0.02
SHIFT_DECAY_S = 0.25
#: Momentum (N s) of a modal hammer for each m/s.
_MOMENTUM_KG = 0.05


@lru_cache(maxsize=256)
def modal_pulse(pulse_s: float, speed_m_s: float) -> CasePulse:
    """The pulse of a modal hammer whose tip sets its length: a blow's momentum is that of its
    speed."""
    phase = np.linspace(0, 1, 400)
    shape = np.sin(np.pi * phase**1.08) ** 1.6
    step = pulse_s / (phase.size - 1)
    return CasePulse(shape * (_MOMENTUM_KG * speed_m_s / (shape.sum() * step)), step)


def accelerations(
    modes: PlateModes, pulse: CasePulse, start_s: float, rate_hz: float, samples: int = SAMPLES
) -> Floats:
    """True accelerations (S, n) in m/s^2 of a plate at rest that a pulse meets at `start_s` of the
    recorder's clock."""
    time = np.arange(samples) / rate_hz
    fine = 1 / (rate_hz * RATIO)
    first = int(start_s / fine) - 1
    grid = np.asarray(
        (first + np.arange(int(pulse.force_n.size * pulse.step_s / fine) + 4)) * fine,
        dtype=np.float64,
    )
    return respond(modes, grid, pulse.on(grid - start_s), time, bandwidth_hz=np.inf)


def sensor_readings(
    acceleration: Floats, rate_hz: float, strengths: Mapping[str, float], laws: str = ""
) -> Floats:
    """What the accelerometers show (S, n) of true accelerations."""
    if laws:
        return accelerations_read(acceleration, rate_hz, strengths, laws, MOUNT_HZ)
    mount = strengths.get("sensor.mount_resonance", 0.0)
    if mount:
        rows = [mounted(row, 1 / rate_hz, MOUNT_HZ / mount, MOUNT_DAMPING) for row in acceleration]
        acceleration = np.array(rows)
    acceleration = acceleration * (1 + strengths.get("sensor.acceleration_gain", 0.0))
    share = strengths.get("sensor.zero_shift", 0.0)
    if share:
        shifts = [zero_shift(row, 1 / rate_hz, share, SHIFT_DECAY_S) for row in acceleration]
        acceleration = acceleration + np.array(shifts)
    return acceleration


def lines_hz(plate: CasePlate) -> Floats:
    """Third octaves from half of the lowest mode to the highest one of a table."""
    frequencies = plate.table.frequencies_hz
    return third_octaves(0.5 * float(frequencies[0]), float(frequencies[-1]))


def levels_db(acceleration: Floats, plate: CasePlate, rate_hz: float) -> Floats:
    """Spectra (S * lines,) of records (S, n)."""
    return spectrum_db(acceleration, rate_hz, lines_hz(plate)).ravel()


def pulses_of(settings: Sequence[CaseSetting]) -> list[CasePulse]:
    """A modal hammer's pulse for each setting."""
    return [modal_pulse(setting.pulse_s, setting.speed_m_s) for setting in settings]
