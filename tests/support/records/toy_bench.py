"""A bench in closed form, linear in logarithms: a gun, a half-sine contact and a plate whose
spectrum is known.

Everything that a diagnosis asks of a stage at almost no cost, with effects of its own that can be
planted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pyroshock.diagnosis.observables.base import Observable, Stage, Upstream
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from pyroshock.twin.effects import Effect, Value, parameter

SAMPLES = 32
LINES = 100 * 2.0 ** np.arange(8)
_DB = 20 / np.log(10)


@dataclass(frozen=True)
class ToyLoss(Effect):
    id = "gun.toy_loss"
    law = "ln v - loss"
    source = "toy"
    # A field().
    loss: Value = parameter("of ln v", "", default=0.1, low=-5, high=5, off=0.0, likely=(-0.4, 0.4))  # noqa: RUF009


@dataclass(frozen=True)
class ToyLeak(Effect):
    """Grows with pressure."""

    id = "gun.toy_leak"
    law = "ln v - share p / 5 bar"
    source = "toy"
    share: Value = parameter(  # noqa: RUF009
        "of ln v at 5 bar", "", default=0.1, low=0, high=5, off=0.0, likely=(0.0, 0.5)
    )


@dataclass(frozen=True)
class ToyMass(Effect):
    id = "contact.toy_mass"
    law = "m factor: peak ^0.6, impulse ^1, width ^0.4"
    source = "toy"
    factor: Value = parameter(  # noqa: RUF009
        "of the mass", "", default=1.1, low=0.1, high=10, off=1.0, likely=(0.6, 1.8)
    )


@dataclass(frozen=True)
class ToyLayer(Effect):
    """Acts where there is a layer only."""

    id = "contact.toy_layer"
    law = "ln peak - softness, ln width + softness, where insulator is polymeric"
    source = "toy"
    softness: Value = parameter(  # noqa: RUF009
        "of ln width", "", default=0.1, low=0, high=5, off=0.0, likely=(0.0, 0.6)
    )


@dataclass(frozen=True)
class ToyDamping(Effect):
    id = "plate.toy_damping"
    law = "lines - loss (1 + k / 8)"
    source = "toy"
    loss_db: Value = parameter(  # noqa: RUF009
        "of the first line", "dB", default=2.0, low=-50, high=50, off=0.0, likely=(-10.0, 10.0)
    )


@dataclass(frozen=True)
class ToyForceGain(Effect):
    id = "sensor.toy_force_gain"
    law = "reading = gain F"
    source = "toy"
    gain: Value = parameter(  # noqa: RUF009
        "reading over true", "", default=1.1, low=0.1, high=10, off=1.0, likely=(0.7, 1.4)
    )


@dataclass(frozen=True)
class ToyVelocityGain(Effect):
    id = "sensor.toy_velocity_gain"
    law = "reading = gain v"
    source = "toy"
    gain: Value = parameter(  # noqa: RUF009
        "reading over true", "", default=1.1, low=0.1, high=10, off=1.0, likely=(0.7, 1.4)
    )


def pulse(peak: float, width: float) -> Series:
    """A half-sine of so many samples, whatever its width."""
    shape = np.sin(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    return Series(peak * shape, SAMPLES / width, 0.0)


def features(series: Series | None) -> np.ndarray:
    """ln peak, ln impulse, ln width."""
    if series is None:
        return np.full(3, np.nan)
    width = series.values.size / series.sampling_rate_hz
    return np.log([series.values.max(), series.values.sum() / series.sampling_rate_hz, width])


def _gain(effects: Sequence[Effect], kind: type[ToyForceGain | ToyVelocityGain]) -> float:
    return float(np.prod([e.gain for e in effects if isinstance(e, kind)]))


class ToyGun(Stage):
    name: ClassVar[str] = "gun"
    simulator = "gun:toy"
    observables = (Observable("ln_velocity", "gun", "velocity", "1", 0.01, 0.008),)
    shows = ("gun.toy_loss", "gun.toy_leak", "sensor.toy_velocity_gain")

    def measured(self) -> np.ndarray:
        return np.log(np.array([[run.velocity_m_s or np.nan] for run in self.record.runs]))

    def simulated(
        self, effects: Sequence[Effect] = (), upstream: Upstream | None = None
    ) -> np.ndarray:
        return np.log(self.output(effects, upstream))[:, None] + np.log(
            _gain(effects, ToyVelocityGain)
        )

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        pressure = np.array([run.tank_pressure_pa for run in self.record.runs], dtype=float)
        mass = np.array([run.bullet_mass_kg for run in self.record.runs], dtype=float)
        ln_v = np.log(15.0) + 0.5 * np.log(pressure / 1e5 / mass)
        for each in effects:
            ln_v = ln_v - each.loss if isinstance(each, ToyLoss) else ln_v
            ln_v = ln_v - each.share * pressure / 5e5 if isinstance(each, ToyLeak) else ln_v
        return list(np.exp(ln_v))

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        return changes_of(self, sets)


class ToyContact(Stage):
    name: ClassVar[str] = "contact"
    simulator = "contact:toy"
    observables = tuple(
        Observable(n, "contact", "force", "1", 0.03, 0.02)
        for n in ("ln_peak", "ln_impulse", "ln_width")
    )
    shows = (
        "contact.toy_mass",
        "contact.toy_layer",
        "sensor.toy_force_gain",
        "sensor.toy_velocity_gain",
    )

    def measured(self) -> np.ndarray:
        return np.array([features(run.force) for run in self.record.runs])

    def _ln(
        self, effects: Sequence[Effect], upstream: Upstream | None
    ) -> tuple[np.ndarray, np.ndarray]:
        runs = self.record.runs
        recorded = np.array([run.velocity_m_s or np.nan for run in runs]) / _gain(
            effects, ToyVelocityGain
        )
        ln_v = np.log(recorded if upstream is None else np.array(upstream, dtype=float))
        ln_m = np.log(np.array([run.bullet_mass_kg for run in runs], dtype=float))
        soft = np.zeros(len(runs))
        for each in effects:
            ln_m = ln_m + np.log(each.factor) if isinstance(each, ToyMass) else ln_m
            if isinstance(each, ToyLayer):
                layer = [
                    self.record.configurations[run.configuration].factors["insulator"]
                    for run in runs
                ]
                soft = soft + each.softness * (np.array(layer) == "polymeric")
        return np.log(2e3) + 1.2 * ln_v + 0.6 * ln_m - soft, np.log(
            8e-4
        ) - 0.2 * ln_v + 0.4 * ln_m + soft

    def simulated(
        self, effects: Sequence[Effect] = (), upstream: Upstream | None = None
    ) -> np.ndarray:
        values = np.array([features(each) for each in self.output(effects, upstream)])
        return values + np.log(_gain(effects, ToyForceGain)) * np.array([1.0, 1.0, 0.0])

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        peak, width = self._ln(effects, upstream)
        return [
            pulse(*np.exp(each)) if np.isfinite(each).all() else None
            for each in zip(peak, width, strict=True)
        ]

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        return changes_of(self, sets)


class ToyPlate(Stage):
    name: ClassVar[str] = "plate"
    simulator = "plate:toy"
    observables = tuple(
        Observable(
            f"acceleration_1 at {f:g} Hz", "plate", "acceleration_1", "dB", 0.5, 0.3, frequency_hz=f
        )
        for f in LINES
    )
    shows = ("plate.toy_damping", "sensor.toy_force_gain")

    def measured(self) -> np.ndarray:
        nothing = np.full(LINES.size, np.nan)
        return np.array(
            [
                each.values if (each := run.accelerations.get("acceleration_1")) else nothing
                for run in self.record.runs
            ]
        )

    def simulated(
        self, effects: Sequence[Effect] = (), upstream: Upstream | None = None
    ) -> np.ndarray:
        forces = [run.force for run in self.record.runs] if upstream is None else upstream
        ln = np.array([features(each) for each in forces])
        ln = ln - (np.log(_gain(effects, ToyForceGain)) if upstream is None else 0.0) * np.array(
            [1.0, 1.0, 0.0]
        )
        share = np.linspace(0, 1, LINES.size)
        lines = _DB * (ln[:, 1:2] - 1.5 * share * ln[:, 2:3])
        for each in effects:
            lines = (
                lines - each.loss_db * (1 + np.arange(LINES.size) / 8)
                if isinstance(each, ToyDamping)
                else lines
            )
        return np.asarray(lines)

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        raise ValueError("nothing follows the plate")

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        return changes_of(self, sets)


def changes_of(stage: Stage, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
    """(k, C, d), at the first run of each configuration."""
    first = np.unique(stage.record.configuration_of, return_index=True)[1]
    nominal = stage.simulated()[first]
    return np.array([stage.simulated(each)[first] - nominal for each in sets])


@dataclass(frozen=True)
class Design:
    pressures_bar: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0)
    masses_kg: tuple[float, ...] = (0.25, 0.5, 1.0)
    insulators: tuple[str, ...] = ("none", "polymeric")
    repetitions: int = 4

    def configurations(self) -> tuple[RunConfiguration, ...]:
        return tuple(
            RunConfiguration(
                f"{p:g} bar {m:g} kg {i}",
                {"tank_pressure": p * 1e5, "bullet_mass": m, "insulator": i},
            )
            for p in self.pressures_bar
            for m in self.masses_kg
            for i in self.insulators
        )


@dataclass(frozen=True)
class Scatter:
    """Of one run, and `background` of a configuration; in ln v, in each ln of the pulse, in dB of
    each line."""

    run: tuple[float, float, float] = (0.01, 0.03, 0.4)
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drift: float = 0.0  # of ln v from the first to the last run
    more: Mapping[str, Any] = field(default_factory=dict)


def campaign(
    effects: Sequence[Effect],
    rng: np.random.Generator,
    design: Design = Design(),
    scatter: Scatter = Scatter(),
    kind: str = "gun",
) -> CampaignRecord:
    """A campaign in which these effects act. `kind` "hammer": impacts with a recorded velocity and
    no gun."""
    configurations = design.configurations()
    order = rng.permutation(len(configurations) * design.repetitions)
    runs = tuple(
        Run(
            configuration=int(row % len(configurations)),
            run=position + 1,
            repetition=int(row // len(configurations)) + 1,
            order=position,
            tank_pressure_pa=float(
                configurations[row % len(configurations)].factors["tank_pressure"]
            ),
            bullet_mass_kg=float(configurations[row % len(configurations)].factors["bullet_mass"]),
        )
        for position, row in enumerate(order)
    )
    return played(CampaignRecord("toy", kind, configurations, runs), effects, rng, scatter)


def played(
    record: CampaignRecord, effects: Sequence[Effect], rng: np.random.Generator, scatter: Scatter
) -> CampaignRecord:
    """The record with what its channels show."""
    from dataclasses import replace

    count, cells = len(record.runs), len(record.configurations)
    where = record.configuration_of
    away = [
        b * rng.standard_normal((cells, d))[where] + s * rng.standard_normal((count, d))
        for s, b, d in zip(scatter.run, scatter.background, (1, 3, LINES.size), strict=True)
    ]
    drift = scatter.drift * np.array([run.order / max(count - 1, 1) for run in record.runs])
    true_v = np.array(ToyGun(record).output(effects)) * np.exp(away[0][:, 0] + drift)
    ideal = [features(each) for each in ToyContact(record).output(effects, list(true_v))]
    true_f = [pulse(*np.exp((f + a)[[0, 2]])) for f, a in zip(ideal, away[1], strict=True)]
    lines = ToyPlate(record).simulated(effects, true_f) + away[2]
    gain_f, gain_v = _gain(effects, ToyForceGain), _gain(effects, ToyVelocityGain)
    runs = tuple(
        replace(
            run,
            velocity_m_s=float(true_v[i] * gain_v),
            force=Series(true_f[i].values * gain_f, true_f[i].sampling_rate_hz, 0.0),
            accelerations={"acceleration_1": Series(lines[i], 1.0, 0.0)},
        )
        for i, run in enumerate(record.runs)
    )
    return replace(record, runs=runs)


def stages_of(record: CampaignRecord) -> tuple[Stage, ...]:
    """All that the record has."""
    chain = (ToyGun, ToyContact, ToyPlate) if record.kind == "gun" else (ToyContact, ToyPlate)
    return tuple(each(record) for each in chain)
