"""True forces of many contacts, each on a clock of its own, and what the force channel shows of
them.

Between its samples a recorder knows nothing, so a pulse is sampled at two phases and its features
are averaged: their mean over all phases is within a tenth of a tolerance of that from five samples
in a contact on. What a recorder's anti-alias filter does to a pulse is less than that from six
samples in a contact on, and is left out.

What strikes and what is struck in every run, out of a campaign's record.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats, Rows
from ....twin.contact.bodies import Bodies
from ....twin.contact.impact import impact
from ....twin.contact.impacts import ContactEffect, plate_impedance
from ....twin.contact.pulse import ContactPulse
from ....twin.sensors.chain import SensorChain
from ....twin.setting import ElasticMaterial
from ...record import CampaignRecord, Factor, Run, RunConfiguration, Series
from ..base import at_rows
from .features import NAMES, frame_features, framed, interpolated

#: Of each contact's own time: peak and times are within 1e-6 of the solver's full steps.
_SITE_STEPS = 32
_OF_MATERIAL = ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa")


@dataclass(frozen=True, eq=False)
class Sites:
    """n nominal impacts: the tip on a rigid target of the first layer's material, all but their
    velocity."""

    bodies: Bodies  # at 1 m/s
    insulated: NDArray[np.bool_]
    impedance_n_s_m: Floats  # of the plate below, whatever lies on it

    def __len__(self) -> int:
        return len(self.bodies)

    def take(self, rows: Rows) -> Sites:
        """Some of them, each as often as it is named."""
        quantities = {name: value for name, value in vars(self.bodies).items() if value is not None}
        bodies = replace(self.bodies, **{name: value[rows] for name, value in quantities.items()})
        return Sites(bodies, self.insulated[rows], self.impedance_n_s_m[rows])

    def pulses(self, velocity_m_s: Floats, effects: tuple[ContactEffect, ...] = ()) -> ContactPulse:
        """At these velocities (n,), all above 0. Raises `ArithmeticError` where a contact does not
        end."""
        bodies, place = replace(self.bodies, impact_velocity_m_s=velocity_m_s), self.impedance_n_s_m
        return impact(
            bodies,
            effects,
            insulated=self.insulated,
            plate_impedance_n_s_m=place,
            steps=_SITE_STEPS,
        )


def sites_of(record: CampaignRecord) -> Sites:
    """One for each run. Raises `ValueError` naming configuration and factor for what a record does
    not tell."""
    rows = [_row(record, record.configurations[run.configuration], run) for run in record.runs]
    columns = {name: [row[name] for row in rows] for name in (rows[0] if rows else {})}
    insulated = np.array(columns.pop("insulated"), dtype=np.bool_)
    impedance = np.array(columns.pop("impedance"), dtype=np.float64)
    quantities = {
        name: None if None in values else np.array(values) for name, values in columns.items()
    }
    return Sites(
        Bodies.of(**quantities, impact_velocity_m_s=np.ones(len(rows))), insulated, impedance
    )


def _row(
    record: CampaignRecord, configuration: RunConfiguration, run: Run
) -> dict[str, float | bool | None]:
    tip, plate, anvil = layers(record, configuration)
    elastic = (
        plate.youngs_modulus_pa,
        plate.poisson_ratio,
        plate.density_kg_m3,
        record.plate_thickness_m,
    )
    return {
        **{f"impactor_{name}": getattr(tip, name) for name in _OF_MATERIAL},
        **{f"target_{name}": getattr(anvil or plate, name) for name in _OF_MATERIAL},
        "impactor_radius_m": float(
            _stated(configuration, "tip_radius", configuration.factors.get("tip_radius"))
        ),
        "impactor_mass_kg": impactor_mass_kg(record, run),
        "plate_thickness_m": record.plate_thickness_m,
        "insulated": configuration.factors.get("insulator", "none") != "none",
        "impedance": float(plate_impedance(*(np.array(value) for value in elastic))),
    }


def layers(
    record: CampaignRecord, configuration: RunConfiguration
) -> tuple[ElasticMaterial, ElasticMaterial, ElasticMaterial | None]:
    """Tip, plate and anvil, None without one. Raises `ValueError` as `sites_of`."""
    factors = {**configuration.factors, "plate_material": record.plate_material_of(configuration)}

    def material(name: str) -> ElasticMaterial:
        word = str(_stated(configuration, name, factors.get(name)))
        if word not in record.materials:
            names = ", ".join(record.materials) or "none"
            raise ValueError(
                f"{name} = {word!r}: no such material in the record; there are: {names}"
            )
        return record.materials[word]

    anvil = factors.get("anvil_material", "none") != "none"
    return (
        material("tip_material"),
        material("plate_material"),
        material("anvil_material") if anvil else None,
    )


def impactor_mass_kg(record: CampaignRecord, run: Run) -> float:
    """The hammer's, or the bullet's: the run's own, else its configuration's. Raises `ValueError`
    without any."""
    configuration = record.configurations[run.configuration]
    mass = record.hammer_mass_kg if record.kind == "hammer" else run.bullet_mass_kg
    mass = configuration.factors.get("bullet_mass") if mass is None else mass  # type: ignore[assignment]
    if mass is None:
        raise ValueError(
            f"{record.name}, run {run.run}: no mass; give [bench.hammer] mass_kg or bullet_mass_kg"
        )
    return float(mass)


def _stated(configuration: RunConfiguration, name: str, value: Factor | None) -> Factor:
    if value is None:
        elsewhere = ", or as material in [bench.plate]" if name == "plate_material" else ""
        raise ValueError(
            f"configuration {configuration.label!r} has no {name}: give it as "
            f"a column of the table of runs{elsewhere}"
        )
    return value


#: Times over the compression time; what a contact that hardly ends does later is next to nothing.
_TO_COMPRESSION, _LAST = 40, 7
PLACES = np.arange(_TO_COMPRESSION * _LAST + 1) / _TO_COMPRESSION
#: Steps to a compression; how many compressions a series covers before the contact and from its
#: begin on.
_STEPS, _BEFORE, _AFTER = 24, 0.6, 7.0
#: Where between two of the recorder's samples contacts begin.
_OFFSETS = (0.25, 0.75)
_AT_ONCE = 100  # some 2 MB, which a cache holds


@dataclass(frozen=True, eq=False)
class ForceHistories:
    """n contacts: `force_n` (n, p) at `PLACES` times `compression_time_s` (n,); NaN where there is
    no answer."""

    force_n: Floats
    compression_time_s: Floats

    @classmethod
    def none(cls, count: int) -> Self:
        return cls(np.full((count, len(PLACES)), np.nan), np.full(count, np.nan))

    def at(self, rows: Rows, time_s: Floats) -> Floats:
        """(k, p): of contacts `rows` (k,) at times (p,) from their begin on, 0 before and
        behind."""
        return interpolated(
            self.force_n[rows], time_s / self.compression_time_s[rows, None] * _TO_COMPRESSION
        )

    def series(self, row: int, step_s: float) -> Series | None:
        """One contact in steps of `step_s`, from two before it on until it has ended; the impulse
        is kept."""
        if np.isnan(self.compression_time_s[row]):
            return None
        place_s = self.compression_time_s[row] / _TO_COMPRESSION
        last = int(np.flatnonzero(self.force_n[row] > 0).max(initial=1)) + 1
        time = np.arange(-2, int(np.ceil(last * place_s / step_s)) + 2, dtype=np.float64) * step_s
        values = self.at(np.array([row]), time)[0]
        total, sampled = (
            float(np.trapezoid(self.force_n[row]) * place_s),
            float(values.sum() * step_s),
        )
        return Series(
            values * (total / sampled if sampled > 0 else 1.0), 1 / step_s, float(time[0])
        )

    def measured(self, rows: Rows, time_s: Floats, step_s: float, chain: SensorChain) -> Floats:
        """(k, p): what the sensors show of contacts `rows` (k,) at times (p,), which are even in
        steps of `step_s`."""
        return SensorChain(at_rows(chain.effects, rows)).measured_force_n(
            self.at(rows, time_s), step_s
        )


def law_histories(
    sites: Sites, effects: tuple[ContactEffect, ...], velocity_m_s: Floats
) -> ForceHistories:
    """Hertz' impacts, or as effects change them, at true velocities (n,); NaN where there is no
    velocity above 0.

    Parameters are numbers, or arrays (n,). Contacts that do not come to an end are left out, and
    found by halves.
    """
    histories = ForceHistories.none(len(sites))
    parts = [np.flatnonzero(velocity_m_s > 0)]
    while parts:
        rows = parts.pop()
        if not rows.size:
            continue
        try:
            pulse = sites.take(rows).pulses(velocity_m_s[rows], at_rows(effects, rows))
        except ArithmeticError:
            parts += np.array_split(rows, 2) if rows.size > 1 else []
            continue
        histories.compression_time_s[rows] = pulse.compression_time_s
        # a solved impact's shape takes phases of each contact, (n, p), as well as common ones
        phase = np.minimum(PLACES * (pulse.compression_time_s / pulse.contact_time_s)[:, None], 1.0)
        histories.force_n[rows] = pulse.force_at(phase)
    return histories


def measured_features(histories: ForceHistories, step_s: Floats, chain: SensorChain) -> Floats:
    """(n, d) of n contacts as records in steps of `step_s` (n,) show them; NaN where there is
    none."""
    values = np.full((len(step_s), len(NAMES)), np.nan)
    answered = np.flatnonzero(np.isfinite(histories.compression_time_s))
    if not answered.size:
        return values
    # By octaves, not by the shortest: a contact's features do not depend on which others are asked
    # with it.
    octave = np.floor(np.log2(histories.compression_time_s[answered]))
    rows_of: list[Rows] = []
    frames: list[tuple[Floats, Floats]] = []
    for key in np.unique(np.stack([octave, step_s[answered]]), axis=1).T:
        group = answered[(octave == key[0]) & (step_s[answered] == key[1])]
        for rows in np.array_split(group, -(-len(group) // _AT_ONCE)):
            phases = _framed(histories, rows, float(key[1]), float(2 ** key[0]), chain)
            rows_of += [rows] * len(phases)
            frames += phases
    frame_rows = np.concatenate(rows_of)
    values[answered] = 0.0
    np.add.at(values, frame_rows, frame_features(frames))
    return np.asarray(values / np.bincount(frame_rows, minlength=len(values)).clip(1)[:, None])


def _framed(
    histories: ForceHistories, rows: Rows, step_s: float, shortest_s: float, chain: SensorChain
) -> list[tuple[Floats, Floats]]:
    """By phase of the recorder, `framed` contacts `rows` (k,) whose compressions take `shortest_s`
    to twice that."""
    finer = (
        1 if step_s * _STEPS <= shortest_s else 4 * int(np.ceil(_STEPS * step_s / shortest_s / 4))
    )
    step = shortest_s / _STEPS if finer == 1 else step_s / finer
    longest = float(2 ** np.ceil(np.log2(histories.compression_time_s[rows].max())))
    time = (
        np.arange(-np.ceil(_BEFORE * longest / step), np.ceil(_AFTER * longest / step) + 1) * step
    )
    force = histories.measured(rows, time, step, chain)
    if finer == 1:
        return [framed(force, step, shortest_s)]
    return [
        framed(force[:, int(offset * finer) :: finer], step_s, shortest_s) for offset in _OFFSETS
    ]
