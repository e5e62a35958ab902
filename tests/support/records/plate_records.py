"""A hammer campaign on a plate of ten modes, played by the twin: what a diagnosis of the plate is
held against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from pyroshock.twin.effects import Effect
from pyroshock.twin.plate.modal import ModalPlate, PlateEffect, with_effects
from pyroshock.twin.plate.response import respond
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effect import SensorEffect

RATE_HZ, SECONDS, BEFORE_S = 51_200.0, 0.08, 1e-3
#: Contact times and peak forces of the configurations; runs of each are some per cent apart.
CONTACTS = ((0.3e-3, 800.0), (0.5e-3, 1500.0), (0.3e-3, 2500.0))
#: The twin plays on a grid so many times finer than the recorder's.
_FINER = 8

Floats = NDArray[np.float64]


def plate() -> ModalPlate:
    """Ten modes from 240 Hz to 5.3 kHz, two sensors, one impact point."""
    rng = np.random.default_rng(5)
    frequency = np.array([240.0, 410, 660, 905, 1290, 1730, 2400, 3100, 4100, 5300])
    shape = rng.uniform(0.25, 0.7, (3, 10)) * rng.choice([-1.0, 1.0], (3, 10))
    ratio = rng.uniform(0.004, 0.007, 10)
    return ModalPlate(
        frequency, ratio, shape[:1], shape[1:], ("#1",), ("acceleration_1", "acceleration_2")
    )


def half_sine(
    contact_s: float, peak_n: float, rate_hz: float, first_s: float, samples: int, skew: float = 1.0
) -> Floats:
    """A versed sine, which begins and ends smoothly; above 1 its `skew` puts the peak later."""
    time = first_s + np.arange(samples) / rate_hz
    inside = (time >= 0) & (time <= contact_s)
    share = np.clip(time / contact_s, 0, 1) ** skew
    return np.where(inside, 0.5 * peak_n * (1 - np.cos(2 * np.pi * share)), 0.0)


def played(
    effects: Sequence[Effect] = (),
    *,
    noise: float = 0.0,
    repetitions: int = 2,
    bench: ModalPlate | None = None,
    rate_hz: float = RATE_HZ,
    seed: int = 1,
    contacts: Sequence[tuple[float, float]] = CONTACTS,
    skew: float = 1.0,
) -> CampaignRecord:
    """What the bench shows with these effects; `noise` in shares of each record's peak."""
    rng = np.random.default_rng(seed)
    table = plate() if bench is None else bench
    runs: list[Run] = []
    for c, (contact_s, peak_n) in enumerate(contacts):
        for repetition in range(repetitions):
            size = peak_n * (1 + 0.04 * repetition)
            runs.append(
                _run(
                    table,
                    effects,
                    (contact_s, size, skew),
                    (c, repetition, len(runs)),
                    noise,
                    rate_hz,
                    rng,
                )
            )
    configurations = tuple(
        RunConfiguration(f"{peak:g} N", {"impact_position": "#1", "hammer_speed": peak})
        for _, peak in contacts
    )
    return CampaignRecord("played", "hammer", configurations, tuple(runs), plate=table)


def _run(
    table: ModalPlate,
    effects: Sequence[Effect],
    blow: tuple[float, float, float],
    place: tuple[int, int, int],
    noise: float,
    rate_hz: float,
    rng: np.random.Generator,
) -> Run:
    chain = SensorChain.of(each for each in effects if isinstance(each, SensorEffect))
    struck = with_effects(table, [each for each in effects if isinstance(each, PlateEffect)])
    fine = rate_hz * _FINER
    samples = round((SECONDS + BEFORE_S) * fine)
    force = half_sine(blow[0], blow[1], fine, -BEFORE_S, samples, blow[2])
    felt = chain.measured_acceleration_m_s2(respond(struck, force, 1 / fine), 1 / fine)[:, ::_FINER]
    read = chain.measured_force_n(force, 1 / fine)[::_FINER]
    felt = felt + noise * np.abs(felt).max(axis=1, keepdims=True) * rng.standard_normal(felt.shape)
    read = read + noise * read.max() * rng.standard_normal(read.shape)
    configuration, repetition, order = place
    window = round((BEFORE_S + 2e-3) * rate_hz)
    return Run(
        configuration,
        order + 1,
        repetition + 1,
        order,
        force=Series(read[:window], rate_hz, -BEFORE_S),
        accelerations={
            name: Series(row, rate_hz, -BEFORE_S)
            for name, row in zip(table.sensors, felt, strict=True)
        },
    )
