"""What the families outside the catalogue do, a function for each stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from ...virtualbench.plate.modes import PlateModes
from .contact_case import CasePulse
from .designs import CaseSetting

#: Families that falsify the reading of a force that is as it should be; the plate feels the true
#: one.
READINGS = (
    "contact.clipping",
    "contact.force_drift",
    "contact.changed_range",
    "contact.ringing_cell",
    "contact.slew",
    "contact.cable_charge",
)
#: An amplifier of amount 0 follows a rise from nothing to the campaign's loudest blow in this time.
_SLEW_S = 20e-6
#: A hammer's handle bends at this frequency; blows below this share of the loudest are cushioned by
#: oil.
_HANDLE_HZ, _CUSHIONED = 900.0, 0.3


@dataclass(frozen=True)
class UnknownEffect:
    """A family that acts on a campaign with the configurations `plan`. Family "" does nothing."""

    family: str
    amount: float
    plan: Sequence[CaseSetting]

    def ln_velocity(self, settings: Sequence[CaseSetting], ln_v: Floats, order: Floats) -> Floats:
        """What is added to ln v (n,) at places (n,) in the order of runs, 0 to 1."""
        if self.family == "gun.tank_drift":
            return np.asarray(-self.amount * (order - 0.3))
        if self.family == "gun.velocity_warm_up":
            return np.asarray(self.amount * np.exp(-order / 0.25))
        if self.family == "gun.relief":
            over = np.log([s.tank_pressure_bar for s in settings]) - np.median(self._pressures)
            return np.asarray(-self.amount / 2 * np.maximum(over, 0.0))
        if self.family == "gun.tumbling":
            energy = np.array([np.log(s.tank_pressure_bar / s.mass_kg) for s in settings])
            onset = np.quantile([np.log(s.tank_pressure_bar / s.mass_kg) for s in self.plan], 0.6)
            return np.asarray(-self.amount / (1 + np.exp(-(energy - onset) / 0.15)))
        if self.family == "gun.partial_opening":
            lightest = min(s.mass_kg for s in self.plan)
            return np.array([-self.amount if s.mass_kg == lightest else 0.0 for s in settings])
        if self.family == "gun.cleaned_barrel":
            return np.asarray(self.amount * (order > 0.5))
        if self.family == "gun.worn_trigger":
            over = np.log([s.tank_pressure_bar for s in settings]) - np.median(self._pressures)
            return np.asarray(-self.amount * order * (over > 0))
        if self.family == "gun.tight_sabot":
            tight = sorted({s.mass_kg for s in self.plan})[1]
            return np.array([-self.amount if s.mass_kg == tight else 0.0 for s in settings])
        if self.family == "gun.standing_wave":
            return np.asarray(self.amount * np.sin(3 * np.pi * self._durations(settings)))
        if self.family == "gun.closing_valve":
            middle = float(np.median(self._durations(self.plan)))
            return np.asarray(
                -self.amount / 2 * np.log1p((self._durations(settings) / middle) ** 4)
            )
        if self.family == "gun.stiff_grease":
            return np.asarray(-self.amount * np.exp(-order / 0.2) * self._durations(settings))
        return np.zeros_like(ln_v)

    def _durations(self, settings: Sequence[CaseSetting]) -> Floats:
        """How long shots (n,) take, sqrt(m / p), over the plan's longest."""
        longest = max((s.mass_kg / s.tank_pressure_bar) ** 0.5 for s in self.plan)
        return np.asarray(
            np.array([(s.mass_kg / s.tank_pressure_bar) ** 0.5 for s in settings]) / longest
        )

    @property
    def _pressures(self) -> Floats:
        return np.log([s.tank_pressure_bar for s in self.plan])

    def pulse(
        self, setting: CaseSetting, pulse: CasePulse, order: float, loudest_n: float
    ) -> CasePulse:
        """The pulse that is recorded for a true one; `loudest_n` is the campaign's largest nominal
        peak."""
        a = self.amount
        if self.family == "contact.oblique":
            normal = 1 - a * setting.tip_radius_mm / max(s.tip_radius_mm for s in self.plan)
            return pulse.scaled(normal**1.2, normal**-0.2)
        if self.family == "contact.force_drift":
            return pulse.scaled(1 - a * order, 1.0)
        if self.family == "contact.worn_target":
            return pulse.scaled(np.exp(-0.4 * a * order), np.exp(0.4 * a * order))
        if self.family == "contact.clipping":
            level = loudest_n * (1 - a) ** 2
            return replace(pulse, force_n=np.minimum(pulse.force_n, level))
        if self.family == "contact.double_hit":
            return _double(pulse, a)
        if self.family == "contact.loose_tip" and setting.tip_material == min(
            s.tip_material for s in self.plan
        ):
            return pulse.scaled(1 - a, 1 + a / 2)
        if self.family == "contact.changed_range":
            return pulse.scaled(1 - a * (order > 0.5), 1.0)
        if self.family == "contact.ringing_cell":
            return _ringing_cell(pulse, a)
        if self.family == "contact.slew":
            return _slewed(pulse, (1 - a) ** 3 * loudest_n / _SLEW_S)
        if self.family == "contact.torn_layer" and self._torn(setting):
            return pulse.scaled(1 + a, 1 / (1 + a / 2))
        if self.family == "contact.ringing_handle":
            time = pulse.step_s * np.arange(pulse.force_n.size)
            return replace(
                pulse, force_n=pulse.force_n * (1 + a * np.sin(2 * np.pi * _HANDLE_HZ * time))
            )
        if self.family == "contact.cable_charge":
            phase = np.linspace(0, 1, pulse.force_n.size)
            return replace(
                pulse,
                force_n=pulse.force_n + a * pulse.force_n.max() * phase**2 * np.sin(np.pi * phase),
            )
        if self.family == "contact.oil_film":
            cushion = 1 - a * np.exp(-pulse.force_n.max() / (_CUSHIONED * loudest_n))
            return pulse.scaled(cushion, 1 / cushion)
        return pulse

    def _torn(self, setting: CaseSetting) -> bool:
        return setting.insulator != "none" and setting.tip_material == max(
            s.tip_material for s in self.plan
        )

    def modes(self, modes: PlateModes, peak_n: float, loudest_n: float, order: float) -> PlateModes:
        """The plate as it answers a blow with this peak at this place in the order of runs."""
        if self.family == "plate.amplitude_damping":
            return replace(
                modes,
                damping=np.minimum(modes.damping * (1 + self.amount * peak_n / loudest_n), 0.5),
            )
        if self.family == "plate.local_mode":
            return _with_bracket(modes, self.amount)
        if self.family == "plate.loosening_bolts":
            return replace(modes, frequencies_hz=modes.frequencies_hz * (1 - self.amount * order))
        if self.family == "plate.tuned_mass":
            return _split(modes, self.amount)
        if self.family == "plate.softening_joint":
            return replace(
                modes, frequencies_hz=modes.frequencies_hz * (1 - self.amount * peak_n / loudest_n)
            )
        if self.family == "plate.warming_pads":
            return replace(
                modes, damping=np.minimum(modes.damping * (1 + self.amount * order), 0.5)
            )
        if self.family == "plate.clamped_mode":
            return _clamped(modes, self.amount)
        if self.family == "plate.moved_sensor" and order > 0.5:
            return _elsewhere(modes, self.amount)
        if self.family == "plate.crack":
            felt = np.sum(modes.shape_impact**2, axis=0) / np.max(
                np.sum(modes.shape_impact**2, axis=0)
            )
            damping = np.minimum(modes.damping * (1 + 20 * self.amount * felt), 0.5)
            return replace(
                modes,
                frequencies_hz=modes.frequencies_hz * (1 - self.amount * felt),
                damping=damping,
            )
        return modes

    def acceleration(
        self, setting: CaseSetting, a: Floats, rate_hz: float, order: float, loud: float
    ) -> Floats:
        """What is recorded (S, n) of accelerations; `loud` is the blow's peak over the campaign's
        largest."""
        if self.family == "plate.gain_drift":
            return a * (1 - self.amount * order)
        if self.family == "plate.cross_axis":
            return a + self.amount * np.stack([a[1], np.zeros_like(a[1])])
        if self.family == "plate.cable_whip":
            return a + _whip(a, rate_hz, self.amount * loud)
        if self.family == "plate.loose_sensor" and setting.pulse_s == min(
            s.pulse_s for s in self.plan
        ):
            quiet = setting.pulse_s > 0 or setting.tip_material == min(
                s.tip_material for s in self.plan
            )
            return np.stack([a[0], _loose(a[1], rate_hz, self.amount)]) if quiet else a
        if self.family == "plate.rattle":
            return a + _rattle(a, rate_hz, self.amount * max(loud - 0.3, 0.0))
        if self.family == "plate.saturation":
            return np.stack([_bent(a[0], self.amount * loud), a[1]])
        if self.family == "plate.asymmetric_sensor":
            return np.stack([a[0], a[1] * np.where(a[1] > 0, 1 + self.amount, 1 - self.amount)])
        if self.family == "plate.base_strain":
            return a + self.amount * _slow(a, rate_hz)
        return a


def _slow(a: Floats, rate_hz: float) -> Floats:
    """What of accelerations (S, n) lies below 600 Hz."""
    from scipy.signal import butter, sosfilt

    return np.asarray(sosfilt(butter(2, 2 * 600 / rate_hz, output="sos"), a, axis=-1))


def _double(pulse: CasePulse, share: float) -> CasePulse:
    """A second pulse, 0.6 as long, that begins when nine tenths of the first are over."""
    n = pulse.force_n.size
    later = np.interp(np.arange(int(0.6 * n)) / 0.6, np.arange(n), pulse.force_n)
    force, begin = np.zeros(int(0.9 * n) + later.size + 1), int(0.9 * n)
    force[:n] = pulse.force_n[: force.size]
    force[begin : begin + later.size] += share * later
    return replace(pulse, force_n=force)


def _ringing_cell(pulse: CasePulse, share: float) -> CasePulse:
    """A swing of 3.5 periods to the pulse that dies away within it, beside the force."""
    phase = np.linspace(0, 1, pulse.force_n.size)
    swing = share * pulse.force_n.max() * np.exp(-4 * phase) * np.sin(7 * np.pi * phase)
    return replace(pulse, force_n=pulse.force_n + swing * np.sin(np.pi * phase))


def _slewed(pulse: CasePulse, most_n_s: float) -> CasePulse:
    """The reading climbs and falls no faster than `most_n_s`."""
    step, room = most_n_s * pulse.step_s, int(pulse.force_n.max() / (most_n_s * pulse.step_s)) + 1
    true = np.append(pulse.force_n, np.zeros(min(room, 4 * pulse.force_n.size)))
    read = np.zeros_like(true)
    for i in range(1, true.size):
        read[i] = read[i - 1] + min(max(true[i] - read[i - 1], -step), step)
    return replace(pulse, force_n=read)


def _split(modes: PlateModes, apart: float) -> PlateModes:
    """The second mode becomes two, each of half its strength, `apart` of its frequency from one
    another."""
    k = 1
    frequencies, half = modes.frequencies_hz.copy(), np.sqrt(0.5)
    frequencies[k] *= 1 - apart / 2
    impact, shapes = modes.shape_impact.copy(), modes.shapes.copy()
    impact[:, k] *= half
    shapes[:, k] *= half
    return replace(
        modes,
        frequencies_hz=np.append(frequencies, modes.frequencies_hz[k] * (1 + apart / 2)),
        damping=np.append(modes.damping, modes.damping[k]),
        shape_impact=np.append(impact, impact[:, k : k + 1], axis=1),
        shapes=np.append(shapes, shapes[:, k : k + 1], axis=1),
    )


def _clamped(modes: PlateModes, amount: float) -> PlateModes:
    """The third mode from the middle of the table up loses so much of its strength."""
    k = modes.frequencies_hz.size // 2 + 2
    impact = modes.shape_impact.copy()
    impact[:, k] *= 1 - amount
    return replace(modes, shape_impact=impact)


def _elsewhere(modes: PlateModes, amount: float) -> PlateModes:
    """The second sensor's place takes something of another's: each mode there is mixed with its
    neighbour's shape."""
    shapes = modes.shapes.copy()
    shapes[1] = np.sqrt(1 - amount**2) * shapes[1] + amount * np.roll(shapes[1], 1)
    return replace(modes, shapes=shapes)


def _rattle(a: Floats, rate_hz: float, amount: float) -> Floats:
    """Bursts at 9.7 kHz on both channels, a share of the peak high, every 0.8 ms after the blow and
    ever smaller."""
    begin = int(np.argmax(np.abs(a[0]) > 0.05 * np.abs(a[0]).max()))
    since = np.maximum(np.arange(a.shape[1]) - begin, 0) / rate_hz
    burst = (
        np.sin(2 * np.pi * 9700 * since)
        * np.exp(-(since % 0.8e-3) / 0.15e-3)
        * np.exp(-since / 3e-3)
    )
    return np.asarray(amount * np.abs(a).max(axis=1, keepdims=True) * burst * (since > 0))


def _bent(a: Floats, amount: float) -> Floats:
    """The larger a sample, the smaller the amplifier's gain; the largest loses about `amount` of
    it."""
    return np.asarray(a / (1 + amount * np.abs(a) / np.abs(a).max()))


def _with_bracket(modes: PlateModes, amount: float) -> PlateModes:
    """One mode more, between the two in the middle of the table."""
    k = modes.frequencies_hz.size // 2
    frequency = np.sqrt(modes.frequencies_hz[k - 1] * modes.frequencies_hz[k])
    strength = np.sqrt(amount * np.mean(np.abs(modes.shape_impact)) * np.mean(np.abs(modes.shapes)))
    return replace(
        modes,
        frequencies_hz=np.append(modes.frequencies_hz, frequency),
        damping=np.append(modes.damping, 0.01),
        shape_impact=np.append(modes.shape_impact, [[strength]], axis=1),
        shapes=np.append(modes.shapes, [[strength], [0.7 * strength]], axis=1),
    )


def _whip(a: Floats, rate_hz: float, amount: float) -> Floats:
    """A swing at 70 Hz that begins with the blow, as large as a share of the peak, on the first
    channel."""
    begin = int(np.argmax(np.abs(a[0]) > 0.05 * np.abs(a[0]).max()))
    since = np.maximum(np.arange(a.shape[1]) - begin, 0) / rate_hz
    swing = amount * np.abs(a[0]).max() * np.sin(2 * np.pi * 70 * since) * np.exp(-since / 0.02)
    return np.stack([swing, np.zeros_like(swing)])


def _loose(a: Floats, rate_hz: float, amount: float) -> Floats:
    """The sensor follows late: a share of it passes a first-order low pass at 1 kHz."""
    from scipy.signal import butter, lfilter

    b, c = butter(1, 2 * 1000 / rate_hz)
    return np.asarray((1 - amount) * a + amount * lfilter(b, c, a))
