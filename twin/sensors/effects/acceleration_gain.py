"""Gain error of an accelerometer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Complexes, Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, along_first

#: Frequency at which the gain is the stated one, Hz: where plates ring that are shocked.
REFERENCE_HZ = 1e3
#: Below this frequency the sensitivity is taken to be constant, Hz: a charge amplifier reaches no
#: lower.
_LOWEST_HZ = 1.0


@dataclass(frozen=True)
class AccelerationGain(SensorEffect):
    """A sensitivity other than the certificate's; the charge sensitivity of a ceramic falls with
    frequency besides.

    The fall is by the same share in each decade. The phase goes with it, as that of every causal
    law does: the sensitivity is a power of i f.
    """

    id = "sensor.acceleration_gain"
    law = "a_reading = gain (i f / (1 kHz))^lg(1 - fall) a"
    source = (
        "ISO 16063-1:1998 (calibration of accelerometers); JCGM 200:2012 (VIM), 4.12 sensitivity; "
        "fall of ceramics: Serridge and Licht, Piezoelectric Accelerometers (1987), ch. 2"
    )

    # Some per cent for a certificate that is old, up to 3 dB for a wrong setting of the amplifier
    # (ISO 16063-1).
    gain: Value = parameter(
        "reading over true acceleration, at 1 kHz",
        "",
        default=1.05,
        low=0.2,
        high=5.0,
        off=1.0,
        likely=(0.7, 1.4),
        typical=0.03,
        owner="channel",
    )
    # Soft ceramics lose 2 to 3 % of their charge in each decade; more is a wrong amplifier.
    fall: Value = parameter(
        "share of the sensitivity that is lost in each decade of frequency",
        "",
        default=0.0,
        low=-0.5,
        high=0.5,
        off=0.0,
        likely=(-0.3, 0.3),
        typical=0.025,
        owner="channel",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("gain",), ("gain", "fall"))

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:
        scaled = np.asarray(acceleration_m_s2 * along_first(self.gain, acceleration_m_s2))
        if not np.any(self.fall):
            return scaled
        from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

        samples = scaled.shape[-1]
        padded = next_fast_len(
            samples + samples // 2, real=True
        )  # so that the end does not meet the beginning
        power = along_first(np.log10(1 - np.asarray(self.fall)), scaled)
        sensitivity = _sensitivity(
            np.asarray(2j * np.pi * rfftfreq(padded, dt_s), dtype=np.complex128), power
        )
        return np.asarray(
            irfft(rfft(scaled, padded, axis=-1) * sensitivity, padded, axis=-1)[..., :samples]
        )

    def measured_amplitude(self, amplitude: Complexes, poles: Complexes) -> Complexes:
        power = np.reshape(np.log10(1 - np.asarray(self.fall)), (-1, 1))
        return np.asarray(amplitude * np.reshape(self.gain, (-1, 1)) * _sensitivity(poles, power))


def _sensitivity(poles: Complexes, power: Value) -> Complexes:
    """Over that at 1 kHz, of what goes as exp(lambda t) with `poles` lambda in 1/s."""
    lowest = 2j * np.pi * _LOWEST_HZ
    held = np.where(np.abs(poles) < abs(lowest), lowest, poles)
    return np.asarray((held / (2j * np.pi * REFERENCE_HZ)) ** power)
