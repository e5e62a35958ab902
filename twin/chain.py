"""The twin: gun, contact, plate, sensors and spectrum as one; what is not known goes along to the
end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..signals.srs.spectrum import octave_grid
from .contact_interface import (
    AboveAnvil,
    ContactStage,
    Extrapolation,
    ExtrapolationPolicy,
    ForcePulses,
    ImpactBatch,
)
from .gun.stage import GunStage
from .measured_shots import MeasuredShots
from .plate.response import PlateResponse
from .plate.stage import PlateStage
from .prediction import Band, Prediction, Quantity, RestsOn, ShotDraws, stratified_normals
from .sensors.chain import SensorChain
from .sensors.measured_pulses import MeasuredForce, measured_pulses, sampled
from .setting import Setting
from .spectrum_calibration import SpectrumCalibration, at_velocities, stretched
from .srs.ringing_window import ringing_spectra

#: Strikes that are computed at once: what they take stays below 50 MB for each sensor.
_CHUNK = 128
#: Settings of one draw hang together: the same random numbers for all, so that they can be
#: compared.
_NOMINAL = 0

_Members = NDArray[np.intp]
#: Plate, impact point, member of the ensemble, sensors.
_Key = tuple[str, str, int, tuple[str, ...]]


def default_lines() -> Floats:
    """100 Hz to 10 kHz, six to an octave."""
    return octave_grid(100.0, 10_000.0, 6)


@dataclass(frozen=True, eq=False)
class Twin:
    """The chain. A stage that is None is not there: without gun, settings tell the velocity.

    Accelerations are `samples` from the beginning of contact at `sampling_rate_hz`; spectra are
    maximax, m/s2, at `frequency_hz` for quality `q`. With a `calibration`, all draws have the
    nominal plate: what is not known of a plate is in the calibration. `rests_on` says what the
    bands rest on; None: on the contact stage alone. Picklable where its contact stage is.
    """

    contact: ContactStage
    gun: GunStage | None = None
    plate: PlateStage = field(default_factory=lambda: PlateStage({}))
    sensors: SensorChain = field(default_factory=SensorChain)
    frequency_hz: Floats = field(default_factory=default_lines)
    q: float = 10.0
    sampling_rate_hz: float = 100_000.0
    samples: int = 10_000
    calibration: SpectrumCalibration | None = None
    rests_on: RestsOn | None = None
    _responses: dict[_Key, PlateResponse] = field(default_factory=dict, init=False, repr=False)

    @property
    def sensor_names(self) -> tuple[str, ...]:
        return self.plate.sensors

    @property
    def models(self) -> dict[str, str]:
        """Stage to what answers there."""
        plate = " + ".join((self.plate.label, *(effect.id for effect in self.plate.effects)))
        return {
            "gun": self.gun.label if self.gun is not None else "none",
            "contact": self.contact.label,
            "plate": plate if self.sensor_names else "none",
            "sensors": " + ".join(effect.id for effect in self.sensors.effects) or "nominal",
            "srs": f"ISO 18431-4, Q = {self.q:g}",
        }

    def velocities(self, settings: Sequence[Setting]) -> Floats:
        """True velocities of impact (n,), m/s; 0 for a bullet that stays in the barrel.

        Parameters:
            settings: n settings of the bench.

        Raises:
            ValueError: For a setting with a tank pressure where there is no gun, and where eq. 2.16
                gives more than the escape speed of the gas.
        """
        if self.gun is not None:
            return self.gun.velocities(settings, self.sensors)
        given = [setting.impact_velocity_m_s for setting in settings]
        if None in given:
            raise ValueError(
                "a tank pressure is set, and this twin has no gun: give the impact velocity"
            )
        return np.array(given, dtype=np.float64)

    def predict(
        self,
        setting: Setting,
        *,
        draws: int = 64,
        rng: np.random.Generator | None = None,
        measured_force: MeasuredForce | None = None,
    ) -> Prediction:
        """One shot with its bands. The same rng, the same shot.

        Measured interfaces stand in for the stages before them: an impact velocity in `setting`, a
        recorded force in `measured_force`.

        Parameters:
            setting: How the bench is set for the shot.
            draws: How many random shots the bands are made from; 64 by default, 0 for the nominal
                shot alone.
            rng: Generator of the random shots; by default one with seed 0.
            measured_force: A recorded force that takes the place of gun and contact; by default
                None, and the force is predicted.

        Raises:
            ValueError: For a bullet that stays in the barrel, and as `velocities`.
            LookupError: For a plate or an impact position there is none of.
        """
        rng = rng or np.random.default_rng(0)
        velocity, normals, member = self._draw_inputs(setting, draws, rng)
        factors = self._factors(
            [setting], velocity.mean(keepdims=True), self.sensor_names, draws, rng
        )
        models = self.models
        if (stay := draws - len(velocity)) > 0:  # the bands say nothing of these
            models["gun"] = f"{models['gun']}; {stay} draws stay in the barrel, left out"
        return self._predicted(
            setting, velocity, normals, member, factors[: len(velocity), 0], measured_force, models
        )

    def predict_many(
        self,
        settings: Sequence[Setting],
        *,
        draws: int = 64,
        rng: np.random.Generator | None = None,
    ) -> list[Prediction]:
        """`predict` for each setting, of random numbers of its own.

        Parameters:
            settings: n settings of the bench.
            draws: How many random shots the bands of each setting are made from; 64 by default, 0
                for the nominal shots alone.
            rng: Generator from which each setting gets a generator of its own; by default one with
                seed 0.

        Returns:
            n predictions, in the order of the settings.

        Raises:
            ValueError: As `predict`.
            LookupError: As `predict`.
        """
        generators = (rng or np.random.default_rng(0)).spawn(len(settings))
        return [
            self.predict(setting, draws=draws, rng=generator)
            for setting, generator in zip(settings, generators, strict=True)
        ]

    def spectra(self, settings: Sequence[Setting], sensor: str | None = None) -> Floats:
        """Nominal maximax spectra (n, f), m/s2, at one sensor; 0 for a bullet that stays in the
        barrel.

        Parameters:
            settings: n settings of the bench.
            sensor: Name of the sensor; by default None, the first one.

        Raises:
            ValueError: Where the twin has no plate, and as `velocities`.
            LookupError: For a sensor, a plate or an impact position there is none of.
        """
        velocity = self.velocities(settings)
        nominal = self._maximax(settings, velocity, None, np.full(len(settings), _NOMINAL), sensor)
        return (
            nominal
            * self._factors(settings, velocity, self._selected_sensors(sensor)[:1], 0, None)[
                0, :, 0, 1:
            ]
        )

    def draws(
        self,
        settings: Sequence[Setting],
        count: int,
        rng: np.random.Generator,
        sensor: str | None = None,
    ) -> Floats:
        """Random spectra (count, n, f), m/s2, as `spectra`; one draw has the same random numbers
        and the same plate for every setting.

        Parameters:
            settings: n settings of the bench.
            count: How many random spectra each setting gets.
            rng: Generator of the random numbers.
            sensor: Name of the sensor; by default None, the first one.

        Raises:
            ValueError: As `spectra`.
            LookupError: As `spectra`.
        """
        z, member = self._sample_draws(count, rng)
        velocity = self._velocity_draws(settings, z)
        many = [setting for _ in range(count) for setting in settings]
        normals = np.repeat(z[:, self._gun_normals :], len(settings), axis=0)
        flat = self._maximax(
            many, velocity.ravel(), normals, np.repeat(member, len(settings)), sensor
        )
        factors = self._factors(
            settings, self.velocities(settings), self._selected_sensors(sensor)[:1], count, rng
        )
        return flat.reshape(count, len(settings), -1) * factors[:, :, 0, 1:]

    def accelerations(
        self, settings: Sequence[Setting], pulses: ForcePulses, sensor: str | None = None
    ) -> Floats:
        """Measured accelerations (n, sensors, samples) of the nominal plate under pulses, m/s2.

        Parameters:
            settings: n settings, which name the plate and the impact position.
            pulses: The force pulses on the plate, one for each setting.
            sensor: Name of one sensor, for an array (n, 1, samples); by default None, all sensors.

        Raises:
            LookupError: For a sensor, a plate or an impact position there is none of.
        """
        return self._measured_accelerations(
            settings, pulses, np.full(len(settings), _NOMINAL), self._selected_sensors(sensor)
        )

    def replayed_db(self, shots: MeasuredShots) -> Floats:
        """Levels of measured shots that the nominal plate shows under their measured forces,
        without calibration, dB re 1 m/s2.

        Pulses have the contact's shape, peak and impulse of the measured force, or are that force
        where shots are predicted from it.

        Parameters:
            shots: n measured shots.

        Returns:
            Levels (n, sensors, 1 + lines), peaks first, as `SpectrumCalibration.of` takes them. NaN
            for shots without a measured force (where any has one), and on plates or at positions
            that this twin has not.
        """
        out = np.full((len(shots), len(self.sensor_names), 1 + self.frequency_hz.size), np.nan)
        usable = np.array([self._has_place(setting) for setting in shots.settings], dtype=np.bool_)
        measured = np.isfinite(shots.peak_force_n) & np.isfinite(shots.impulse_n_s)
        usable &= measured if measured.any() else True
        for rows, pulses in self._replays(shots, usable):
            shown = self.accelerations([shots.settings[row] for row in rows], pulses)
            out[rows, :, 0] = np.abs(shown).max(axis=-1)
            out[rows, :, 1:] = self._spectra_of(shown, pulses)
        return np.asarray(20 * np.log10(out))

    def _replays(
        self, shots: MeasuredShots, usable: NDArray[np.bool_]
    ) -> Iterator[tuple[_Members, ForcePulses]]:
        """Rows of usable shots, in parts, and the pulses on the plate under their measured
        forces."""
        by_setting, velocity = usable & ~shots.force_is_given, shots.impact_velocity_m_s.copy()
        if (unknown := np.flatnonzero(by_setting & ~(velocity > 0))).size:
            velocity[unknown] = self.velocities([shots.settings[row] for row in unknown])
        for rows in self._chunks(np.where(by_setting, velocity, 0.0)):
            strikes = ImpactBatch([shots.settings[row] for row in rows], velocity[rows])
            pulses = self.contact.pulses(strikes)
            measured_force = shots.peak_force_n[rows], shots.impulse_n_s[rows]
            yield rows, stretched(self._on_plate(strikes, None, pulses), pulses, *measured_force)
        for rows in self._chunks(np.where(usable & shots.force_is_given, 1.0, 0.0)):
            yield rows, shots.given_pulses(rows)

    def _on_plate(self, strikes: ImpactBatch, z: Floats | None, pulses: ForcePulses) -> ForcePulses:
        return (
            self.contact.plate_pulses(strikes, z, pulses)
            if isinstance(self.contact, AboveAnvil)
            else pulses
        )

    def _has_place(self, setting: Setting) -> bool:
        plate = self.plate.plates.get(setting.plate.name)
        return plate is not None and setting.impact_position in plate.impact_points

    # --- one shot ---

    def _draw_inputs(
        self, setting: Setting, draws: int, rng: np.random.Generator
    ) -> tuple[Floats, Floats | None, _Members]:
        """Velocities (d,), the contact's normals (d, normals), members of the plate's ensemble
        (d,).

        Of those draws in which the bullet leaves the barrel: what strikes no target has no force.
        """
        velocity = self.velocities([setting])
        if not velocity[0] > 0:
            raise ValueError(self._stays(setting))
        if draws == 0:
            return velocity, None, np.full(1, _NOMINAL)
        z, member = self._sample_draws(draws, rng)
        velocity = self._velocity_draws([setting], z)[:, 0]
        leaves = velocity > 0
        if not leaves.any():
            raise ValueError(self._stays(setting))
        normals = z[leaves, self._gun_normals :] if self.contact.normals else None
        return velocity[leaves], normals, member[leaves]

    def _predicted(
        self,
        setting: Setting,
        velocity: Floats,
        normals: Floats | None,
        member: _Members,
        factors: Floats,
        measured: MeasuredForce | None,
        models: Mapping[str, str],
    ) -> Prediction:
        many = [setting] * len(velocity)
        strikes = ImpactBatch(many, velocity)
        pulses = (
            self.contact.pulses(strikes, normals)
            if measured is None
            else measured.repeated(len(velocity))
        )
        seen = measured_pulses(self.sensors, pulses)
        on_plate = pulses if measured is not None else self._on_plate(strikes, normals, pulses)
        accelerations = self._measured_accelerations(many, on_plate, member, self.sensor_names)
        spectra = self._spectra_of(accelerations, on_plate) * factors[..., 1:]
        accelerations *= factors[..., :1]
        measured_velocity = self.sensors.measured_velocity_m_s(velocity)
        nominal = ImpactBatch([setting], velocity.mean(keepdims=True))
        phases = np.linspace(0.0, 1.0, seen.force_n.shape[1])
        return Prediction(
            setting=setting,
            velocity_m_s=Quantity.of(measured_velocity),
            contact_time_s=Quantity.of(seen.contact_time_s),
            compression_time_s=Quantity.of(seen.compression_time_s),
            peak_force_n=Quantity.of(seen.peak_force_n),
            impulse_n_s=Quantity.of(seen.impulse_n_s),
            time_s=phases * float(seen.contact_time_s.mean()),
            force_n=Band.of(seen.force_n),
            sensors=self.sensor_names,
            sampling_rate_hz=self.sampling_rate_hz,
            acceleration_band_hz=self.plate.band_hz,
            accelerations_m_s2=accelerations,
            frequency_hz=self.frequency_hz,
            q=self.q,
            spectra_m_s2={name: Band.of(spectra[:, i]) for i, name in enumerate(self.sensor_names)},
            models=models
            if measured is None
            else {**models, "gun": "none", "contact": "measured force"},
            outside=() if measured is not None else self.contact.outside(nominal)[0],
            extrapolation=self._extrapolation(nominal) if measured is None else (),
            rests_on=self.rests_on
            or RestsOn(0, self.contact.label, f"The bands rest on {self.contact.label} alone."),
            draws=ShotDraws(
                velocity_m_s=measured_velocity,
                contact_time_s=seen.contact_time_s,
                peak_force_n=seen.peak_force_n,
                impulse_n_s=seen.impulse_n_s,
                peak_acceleration_m_s2=np.abs(accelerations).max(axis=2),
                spectra_m_s2=spectra,
            ),
        )

    def _extrapolation(self, nominal: ImpactBatch) -> tuple[Extrapolation, ...]:
        """Of gun and contact, each quantity once."""
        of_gun = () if self.gun is None else self.gun.extrapolation(nominal.settings)[0]
        of_contact = (
            self.contact.extrapolation(nominal)[0]
            if isinstance(self.contact, ExtrapolationPolicy)
            else ()
        )
        same = {"impactor_mass_kg": "bullet_mass_kg"}  # the contact's name, and the gun's
        gun_quantities = {item.quantity for item in of_gun}
        return (
            *of_gun,
            *(x for x in of_contact if same.get(x.quantity, x.quantity) not in gun_quantities),
        )

    def _sample_draws(self, count: int, rng: np.random.Generator) -> tuple[Floats, _Members]:
        """Normals of gun and contact (count, normals of both), and a plate of the ensemble for each
        draw (count,)."""
        z = stratified_normals(count, self._gun_normals + self.contact.normals, rng)
        members = self.plate.members if self.calibration is None else 0
        return z, rng.permutation(np.arange(count) % members + 1) if members else np.full(
            count, _NOMINAL
        )

    def _factors(
        self,
        settings: Sequence[Setting],
        velocity: Floats,
        sensors: tuple[str, ...],
        draws: int,
        rng: np.random.Generator | None,
    ) -> Floats:
        """Of the calibration, (draws, n, sensors, 1 + lines); one row of nominal ones without
        draws."""
        if self.calibration is None or not sensors:
            return np.ones((max(draws, 1), len(settings), len(sensors), 1 + self.frequency_hz.size))
        z = (
            None
            if not draws or rng is None
            else stratified_normals(draws, self.calibration.normals, rng)
        )
        factors = self.calibration.factors(at_velocities(settings, velocity), sensors, z)
        return factors if z is not None else factors[None]

    def _stays(self, setting: Setting) -> str:
        pressure = (setting.tank_pressure_pa or 0.0) / 1e5
        leaves = 0.0 if self.gun is None else float(self.gun.leaving([setting], self.sensors)[0])
        chance = f" (it leaves with a probability of {leaves:.0%})" if leaves else ""
        return (
            f"the bullet does not leave the barrel at {pressure:g} bar{chance}: "
            f"raise the tank pressure"
        )

    @property
    def _gun_normals(self) -> int:
        return 0 if self.gun is None else self.gun.normals

    def _velocity_draws(self, settings: Sequence[Setting], z: Floats) -> Floats:
        """True velocities (count, n) of the normals of `_sample_draws`."""
        if self.gun is None:
            return np.tile(self.velocities(settings), (len(z), 1))
        return self.gun.velocity_draws(settings, self.sensors, z[:, : self.gun.normals])

    # --- many shots ---

    def _maximax(
        self,
        settings: Sequence[Setting],
        velocity: Floats,
        normals: Floats | None,
        member: _Members,
        sensor: str | None,
    ) -> Floats:
        """(n, f) at one sensor; rows without a velocity stay 0."""
        sensors = self._selected_sensors(sensor)[:1]
        if not sensors:
            raise ValueError("this twin has no plate: give its modes, or what they follow from")
        out = np.zeros((len(settings), self.frequency_hz.size))
        for rows in self._chunks(velocity):
            some = [settings[row] for row in rows]
            z = normals[rows] if normals is not None and normals.shape[1] else None
            strikes = ImpactBatch(some, velocity[rows])
            pulses = self._on_plate(strikes, z, self.contact.pulses(strikes, z))
            felt = self._measured_accelerations(some, pulses, member[rows], sensors)
            out[rows] = self._spectra_of(felt, pulses)[:, 0]
        return out

    def _chunks(self, velocity: Floats) -> Iterator[_Members]:
        moving = np.flatnonzero(velocity > 0)
        return (moving[i : i + _CHUNK] for i in range(0, moving.size, _CHUNK))

    def _selected_sensors(self, sensor: str | None) -> tuple[str, ...]:
        if sensor is not None and sensor not in self.sensor_names:
            raise LookupError(
                f"no sensor {sensor!r}; there are: {', '.join(self.sensor_names) or 'none'}"
            )
        return self.sensor_names if sensor is None else (sensor,)

    def _measured_accelerations(
        self,
        settings: Sequence[Setting],
        pulses: ForcePulses,
        member: _Members,
        sensors: tuple[str, ...],
    ) -> Floats:
        """Measured accelerations (n, sensors, samples), each of its own plate."""
        if not sensors:
            return np.zeros((len(settings), 0, self.samples))
        force = sampled(pulses, self._step_s, self.samples)
        keys = [
            (s.plate.name, s.impact_position, int(m)) for s, m in zip(settings, member, strict=True)
        ]
        out = np.empty((len(settings), len(sensors), self.samples))
        for key in dict.fromkeys(keys):
            rows = np.array([i for i, other in enumerate(keys) if other == key])
            out[rows] = self._response(*key, sensors).accelerations(force[rows])
        return self.sensors.measured_acceleration_m_s2(out, self._step_s)

    def _response(
        self, plate: str, point: str, member: int, sensors: tuple[str, ...]
    ) -> PlateResponse:
        """Of one plate of the ensemble from one point, made once."""
        key = (plate, point, member, sensors)
        if key not in self._responses:
            of = self.plate.ensemble(plate)[member]
            self._responses[key] = PlateResponse.of(of, point, sensors, self._step_s, self.samples)
        return self._responses[key]

    def _spectra_of(self, accelerations: Floats, pulses: ForcePulses) -> Floats:
        """Maximax (n, sensors, f)."""
        if not accelerations.shape[1]:
            return np.zeros((*accelerations.shape[:2], self.frequency_hz.size))
        longest = float(pulses.contact_time_s.max())
        return ringing_spectra(
            accelerations, self.sampling_rate_hz, self.frequency_hz, self.q, longest
        )

    @property
    def _step_s(self) -> float:
        return 1 / self.sampling_rate_hz
