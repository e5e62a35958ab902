"""The gun: from the tank's pressure and the projectile's mass, as read, to the velocity that the
bench shows, and to the pressure that the tank still has then, where its record was kept."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import cast

import numpy as np

from ....array_types import Floats
from ....signals.valve_profile import ValveProfile
from ....twin.effects import Effect
from ....twin.gun.bench import GunBench
from ....twin.gun.effects.back_pressure import BackPressure
from ....twin.gun.effects.valve_flow import ValveFlow
from ....twin.gun.shot import GunEffect
from ....twin.gun.shots import gun_velocity
from ....twin.sensors.chain import SensorChain
from ...record import CampaignRecord, RunConfiguration
from ..base import (
    Observable,
    PossibleObservables,
    Stage,
    Upstream,
    at_rows,
    batched_changes,
    sensor_chain,
)
from .tank_pressure import (
    AFTER_COLUMN,
    ASSUMED_NOISE_PA,
    CHANNEL,
    EXIT_COLUMN,
    LAG_S,
    LASER_M,
    PressureWindows,
    measured_pressures,
    pressure_observables,
    reading_noise_pa,
)

#: 1 % of velocity counts as agreement; the scatter where no run states its uncertainty.
TOLERANCE, ASSUMED_FLOOR = 0.01, 0.01
#: Standard uncertainty of what a regulator with a gauge of class 1 is set to, as a share;
#: agreement, too.
REGULATOR_U = 0.01
#: Velocities that are compared within a hundredth need no more than five digits.
_COARSER = 30.0
#: Moments at which the tank's pressure is compared, two before the exit and one after it.
_MOMENTS = ("before_exit_s_0", "before_exit_s_1", "before_exit_s_2")
#: The outlet's area of flow is looked for between these shares of the bore's, and known to this
#: share (standard deviation).
_OUTLETS, _OUTLET_SHARE = np.geomspace(0.1, 1.5, 25), 0.3
#: What each shot is read off with.
READINGS = ("tank_pressure_pa", "bullet_mass_kg")
#: Of a standard deviation: small enough for a derivative, large enough for its digits.
_STEP = 1e-3


class GunObservables(Stage):
    """Eq. 2.16 with gauge pressure and the campaign's own friction and efficiency, which stays as
    effects come in.

    The travel is that of each run where the record has it, else the gun's. Where the record of the
    tank's pressure was kept from before the shot until after the exit, three readings of it are
    compared too (`tank_pressure`); the middle of the projectile's passage through the laser stands
    for the exit.

    `uncertain`: standard deviations of the gun's settings by their names in `GunBench`, and of
    "tank_pressure_pa" and "bullet_mass_kg", each the same in all runs. Raises `ValueError` for a
    record without a gun, and for a name or a value of `uncertain` that cannot be.
    """

    name = "gun"
    simulator = "gun:adiabatic"
    effect_kind = GunEffect
    sensor_hooks = ("true_pressure_pa", "measured_velocity_m_s")

    def __init__(
        self, record: CampaignRecord, uncertain: Mapping[str, float] | None = None
    ) -> None:
        super().__init__(record)
        if record.gun is None:
            raise ValueError(
                f"campaign {record.name!r} has no gun: its settings stand in [bench.gun]"
            )
        self.bench: GunBench = record.gun
        self.uncertain = dict(uncertain or {})
        self._nominal: Floats | None = None
        self._velocity_m_s = record.run_values("velocity_m_s")
        self._shots = {
            **{name: record.run_values(name) for name in READINGS},
            "travel_m": np.array(
                [run.travel_m or self.bench.travel_m for run in record.runs], dtype=np.float64
            ),
            # The row of the configuration, which has the profile: a number, to be tiled and thinned
            # as the others.
            "valve_profile": np.array([run.configuration for run in record.runs], dtype=np.float64),
        }
        self._profiles = [_profile(configuration) for configuration in record.configurations]
        self._traces = [run.tank_pressure for run in record.runs]
        self._noise_pa = reading_noise_pa(self._traces)
        self._medians = {name: self._median(values) for name, values in self._shots.items()}
        self._bore_m2 = float(np.pi / 4 * self.bench.bore_diameter_m**2)
        self._outlet_m2 = self._bore_m2 / 2
        self._windows = (
            self._pressure_windows() if any(trace is not None for trace in self._traces) else None
        )
        if self._windows is not None:
            self._ask(self._windows.before_exit_s, self._windows.scale_pa)
            shots = sum(trace is not None for trace in self._traces)
            self.assumptions = (
                f"tank pressure: its record is compared in {shots} of {len(self._traces)} shots, "
                "just before the exit, half a nominal transit before it, once the tank is empty, "
                "and, where it empties, after the exit through an outlet whose area the records "
                "tell; the exit is the middle of the passage through the laser",
            )
        self._set_pa = record.run_values("set_pressure_pa")
        self._has_regulator = bool(np.isfinite(self._set_pa).any())
        if self._has_regulator:
            self.assumptions = (
                *self.assumptions,
                f"tank pressure: what was set is compared with what was "
                f"recorded in {np.isfinite(self._set_pa).sum()} "
                f"shots; the regulator is taken to be right within {REGULATOR_U:.0%}",
            )
        outlet = self._outlet()  # first: it sets the area for what follows
        self._nuisances = {**self._derivatives(), **self._timing(), **self._regulator(), **outlet}

    @property
    def observables(self) -> tuple[Observable, ...]:
        stated = np.exp(
            _logarithms(self.record.run_values("velocity_u_m_s")) - _logarithms(self._velocity_m_s)
        )
        good = stated[np.isfinite(stated)]
        floor = float(np.median(good)) if good.size else ASSUMED_FLOOR
        velocity = Observable("ln_velocity", "gun", "velocity", "1", TOLERANCE, floor)
        regulator = Observable(
            "ln_set_pressure", "gun", "set_pressure", "1", REGULATOR_U, REGULATOR_U / 2
        )
        return (
            velocity,
            *(pressure_observables(self._windows, self._noise_pa) if self._windows else ()),
            *((regulator,) if self._has_regulator else ()),
        )

    @property
    def shows(self) -> tuple[str, ...]:
        return super().shows if np.isfinite(self.residuals()).any() else ()

    def measured(self) -> Floats:
        columns = [_logarithms(self._velocity_m_s)[:, None]]
        if self._windows is not None:
            before_pa = self._shots["tank_pressure_pa"]
            columns.append(
                measured_pressures(
                    self._traces, before_pa, self.record.configuration_of, self._windows
                )
            )
        if self._has_regulator:
            columns.append(_logarithms(self._set_pa)[:, None])
        return np.hstack(columns)

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """Observables (R, d) that the records would show; NaN for a shot that stays in the barrel.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each
                shot (R,).
            upstream: The true pressure of the tank before each shot, Pa gauge; by default the
                pressures as read.
        """
        return self._shown(effects, self._shots, upstream)

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        """True velocities of the shots, m/s; NaN for a shot that stays in the barrel.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each
                shot (R,).
            upstream: The true pressure of the tank before each shot, Pa gauge; by default the
                pressures as read.
        """
        return cast(Sequence[float], self._fired(effects, self._shots, upstream)[0].tolist())

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        """(k, C, d): by how much each of k sets of effects moves the nominal observables, at the
        median pressure, mass and travel of each configuration.

        Parameters:
            sets: The k sets of effects; effects of other stages in a set do nothing here. A
                parameter is one value or one for each configuration (C,).
        """

        def observed(effects: Sequence[Effect], count: int) -> Floats:
            shots = {name: np.tile(values, count) for name, values in self._medians.items()}
            return self._shown(effects, shots)

        if self._nominal is None:
            self._nominal = self._shown((), self._medians)
        return batched_changes(self._nominal, [self.acting(effects) for effects in sets], observed)

    @property
    def possible_channels(self) -> tuple[str, ...]:
        """The record of the tank's pressure, where no shot has one."""
        return () if self._windows else (CHANNEL,)

    def possible_observables(
        self, channel: str, sets: Sequence[Sequence[Effect]]
    ) -> PossibleObservables:
        """What a transducer would have shown whose readings scatter by `ASSUMED_NOISE_PA`; as much
        as the tolerance is added, since no simulator is better.

        Parameters:
            channel: The record of the tank's pressure, where `possible_channels` has it.
            sets: The k sets of effects. A parameter is one value for all configurations or one for
                each (C,).

        Raises:
            LookupError: For another channel.
        """
        if channel not in self.possible_channels:
            return super().possible_observables(channel, sets)
        recorded = copy.copy(self)
        recorded._nominal = None
        recorded._noise_pa, recorded._medians, recorded._shots = (
            ASSUMED_NOISE_PA,
            {**self._medians},
            {**self._shots},
        )
        recorded._windows = recorded._pressure_windows()
        recorded._ask(recorded._windows.before_exit_s, recorded._windows.scale_pa)
        # After the exit an area comes in that only a record tells.
        items = pressure_observables(recorded._windows, ASSUMED_NOISE_PA)[:-1]
        variance = [item.floor**2 + item.tolerance**2 for item in items]
        return PossibleObservables(
            recorded.changes(sets)[:, :, 1 : 1 + len(items)], np.diag(variance)
        )

    def _pressure_windows(self) -> PressureWindows:
        transit_s = np.full(len(self.record.configurations), np.nan)
        pressure_pa, mass_kg = (self._medians[name] for name in READINGS)
        rows = np.flatnonzero((pressure_pa > 0) & (mass_kg > 0) & (self._medians["travel_m"] > 0))
        if rows.size:
            travel_m = self._medians["travel_m"][rows]
            transit_s[rows] = gun_velocity(
                self.bench, pressure_pa[rows], mass_kg[rows], travel_m=travel_m
            ).exit_time_s
        tank_over_bore_m = self.bench.tank_volume_m3 / self._bore_m2
        return PressureWindows.of(transit_s, pressure_pa, self._noise_pa, tank_over_bore_m)

    def _ask(self, before_exit_s: Floats, scale_pa: Floats) -> None:
        """Moments (C, 2) before the exit and scales (C,), for configurations and for their runs."""
        columns = {name: before_exit_s[:, place] for place, name in enumerate(_MOMENTS)}
        for name, values in {**columns, "scale_pa": scale_pa}.items():
            self._medians[name] = values
            self._shots[name] = values[self.record.configuration_of]

    def _median(self, values: Floats) -> Floats:
        """(C,): medians over the runs of each configuration; NaN without any."""
        rows = self.record.configuration_of
        groups = [
            values[(rows == c) & np.isfinite(values)]
            for c in range(len(self.record.configurations))
        ]
        return np.array([float(np.median(group)) if group.size else np.nan for group in groups])

    def _shown(
        self,
        effects: Sequence[Effect],
        shots: Mapping[str, Floats],
        upstream: Upstream | None = None,
        bench: GunBench | None = None,
    ) -> Floats:
        """(n, d): ln of what the velocity measurement shows of true velocities, and what the
        transducer shows."""
        sensors = sensor_chain(effects)
        velocity_m_s, pressure_pa = self._fired(effects, shots, upstream, bench)
        columns = [_logarithms(sensors.measured_velocity_m_s(velocity_m_s))[:, None]]
        if self._windows is not None:
            columns.append(self._transducer(sensors, shots, velocity_m_s, pressure_pa))
        if self._has_regulator:
            columns.append(
                _logarithms(sensors.true_pressure_pa(shots["tank_pressure_pa"]))[:, None]
            )
        return np.hstack(columns)

    def _transducer(
        self,
        sensors: SensorChain,
        shots: Mapping[str, Floats],
        velocity_m_s: Floats,
        pressure_pa: Floats,
    ) -> Floats:
        """(n, 4): what it reads of true pressures (n, 3) before the exit and after it, and of an
        empty tank."""
        readings_pa = np.stack(
            [sensors.measured_pressure_pa(column) for column in pressure_pa.T], axis=1
        )
        empty_pa = sensors.measured_pressure_pa(np.zeros(len(velocity_m_s)))
        empty = np.where(np.isfinite(velocity_m_s), empty_pa / 1e5, np.nan)
        readings = readings_pa / shots["scale_pa"][:, None]
        return np.hstack([readings[:, :2], empty[:, None], readings[:, 2:]])

    def _fired(
        self,
        effects: Sequence[Effect],
        shots: Mapping[str, Floats],
        upstream: Upstream | None = None,
        bench: GunBench | None = None,
    ) -> tuple[Floats, Floats]:
        """True velocities (n,) and tank pressures (n, 3) about the exit, Pa, where they are
        compared; NaN for a shot that stays in the barrel, or of which pressure or mass is not
        known.

        `upstream` is the true pressure of each, where it is known, `bench` another than the
        stage's.
        """
        read_pa, mass_kg, travel_m = (
            shots["tank_pressure_pa"],
            shots["bullet_mass_kg"],
            shots["travel_m"],
        )
        given = sensor_chain(effects).true_pressure_pa(read_pa) if upstream is None else upstream
        pressure_pa = np.asarray(given, dtype=np.float64)
        velocity_m_s = np.full(pressure_pa.shape, np.nan)
        compared = [shots[name] for name in _MOMENTS if self._windows is not None]
        before_exit_s = np.array(compared).reshape(len(compared), pressure_pa.size).T
        before_exit_pa = np.full(before_exit_s.shape, np.nan)
        good = (
            (pressure_pa >= 0)
            & np.isfinite(pressure_pa)
            & (mass_kg > 0)
            & np.isfinite(mass_kg)
            & (travel_m > 0)
        )
        if (rows := np.flatnonzero(good)).size:
            gun = at_rows([effect for effect in effects if isinstance(effect, GunEffect)], rows)
            bench = bench or self.bench
            fired = gun_velocity(
                bench,
                pressure_pa[rows],
                mass_kg[rows],
                gun,
                _COARSER,
                travel_m=travel_m[rows],
                valve_profiles=self._stated_profiles(gun, shots["valve_profile"][rows]),
                before_exit_s=before_exit_s[rows],
                outlet_area_m2=self._outlet_m2,
            )
            velocity_m_s[rows] = np.where(fired.left, fired.velocity_m_s, np.nan)
            before_exit_pa[rows] = fired.tank_pressure_pa
        return velocity_m_s, before_exit_pa

    def _stated_profiles(
        self, effects: Sequence[GunEffect], configurations: Floats
    ) -> list[ValveProfile | None] | None:
        """Of shots (n,) by the rows of their configurations: where a valve acts. The nominal law
        has none."""
        valve = next((effect for effect in effects if isinstance(effect, ValveFlow)), None)
        if valve is None or not any(self._profiles):
            return None
        acts = np.broadcast_to(np.asarray(valve.loss_coefficient) > 0, configurations.shape)
        return [
            self._profiles[int(row)] if on else None
            for row, on in zip(configurations, acts, strict=True)
        ]

    def _derivatives(self) -> dict[str, Floats]:
        """(C, d) by name: the derivative times one standard deviation, at the medians of
        configurations.

        Central differences; one-sided where the other side is no gun, as above an efficiency of
        one. NaN where the nominal shot stays in the barrel.
        """
        names = (*(item.name for item in fields(GunBench)), *READINGS)
        derivatives = {}
        for name, sd in self.uncertain.items():
            if name not in names:
                raise ValueError(
                    f"no uncertain setting {name!r} of the gun; there are: {', '.join(names)}"
                )
            if not (np.isfinite(sd) and sd >= 0):
                raise ValueError(
                    f"uncertain {name} = {sd!r}: expected a standard deviation, not negative"
                )
            if sd > 0:
                sides = [(sign, self._beside(name, sign * _STEP * sd)) for sign in (1.0, -1.0, 0.0)]
                (a, high), (b, low), *_ = [
                    (sign, values) for sign, values in sides if values is not None
                ]
                derivatives[name] = np.asarray((high - low) / ((a - b) * _STEP))
        return derivatives

    def _beside(self, name: str, step: float) -> Floats | None:
        """What is observed (C, d) with one setting moved; None where that is no gun."""
        if name in self._medians:
            return self._shown((), {**self._medians, name: self._medians[name] + step})
        try:
            bench = replace(self.bench, **{name: getattr(self.bench, name) + step})
        except ValueError:
            return None
        return self._shown((), self._medians, bench=bench)

    def _regulator(self) -> dict[str, Floats]:
        """(C, d): an error of the regulator that all settings have in common."""
        if not self._has_regulator:
            return {}
        table = np.zeros((len(self.record.configurations), len(self.observables)))
        table[:, -1] = REGULATOR_U
        return {"regulator": table}

    def _outlet(self) -> dict[str, Floats]:
        """(C, d) by name: the area through which the gas leaves, which no campaign states, about
        that with which the fall after the exit is nearest to the records, in air or in a vacuum;
        and how it opens. Sets that area."""
        if self._windows is None:
            return {}
        measured = self.measured()
        fall = self._median(measured[:, AFTER_COLUMN] / measured[:, EXIT_COLUMN])
        if not np.isfinite(fall).any():
            return {}
        least_misfit, acting, outlet_m2 = np.inf, cast(tuple[Effect, ...], ()), self._outlet_m2
        for surroundings in ((), (BackPressure(),)):
            for share in _OUTLETS:
                self._outlet_m2 = float(share) * self._bore_m2
                shown = self._shown(surroundings, self._medians)
                misfit = float(
                    np.nansum((fall - shown[:, AFTER_COLUMN] / shown[:, EXIT_COLUMN]) ** 2)
                )
                if misfit < least_misfit:
                    least_misfit, acting, outlet_m2 = misfit, surroundings, self._outlet_m2
        sides = []
        for factor in (np.exp(_OUTLET_SHARE), np.exp(-_OUTLET_SHARE)):
            self._outlet_m2 = outlet_m2 * float(factor)
            sides.append(self._shown(acting, self._medians))
        self._outlet_m2 = outlet_m2
        by_area = np.asarray((sides[0] - sides[1]) / 2)
        velocity_m_s = self._fired(acting, self._medians)[0]
        # Vent holes and muzzle are uncovered the sooner the faster the projectile is.
        faster = np.nan_to_num(velocity_m_s / np.nanmedian(velocity_m_s) - 1)
        return {"outlet": by_area, "muzzle": by_area * faster[:, None]}

    def _timing(self) -> dict[str, Floats]:
        """(C, d) by name: what the moment of the exit leaves of the pressures, by the transducer's
        lag and by where the laser stands, one standard deviation each and the same in all shots."""
        if self._windows is None:
            return {}
        nominal = self._shown((), self._medians)
        velocity_m_s = self._fired((), self._medians)[0]
        timing = {}
        for name, late_s in (
            ("pressure_lag_s", np.full(len(nominal), LAG_S)),
            ("laser_m", LASER_M / velocity_m_s),
        ):
            moments = {moment: self._medians[moment] + late_s for moment in _MOMENTS}
            timing[name] = np.asarray(self._shown((), {**self._medians, **moments}) - nominal)
        return timing


def _logarithms(velocity_m_s: Floats) -> Floats:
    """NaN where there is no velocity."""
    return np.log(np.where(velocity_m_s > 0, velocity_m_s, np.nan))


def _profile(configuration: RunConfiguration) -> ValveProfile | None:
    text = configuration.factors.get("valve_profile")
    return None if text is None else ValveProfile.parse(str(text))
