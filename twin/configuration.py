"""A twin's configuration as plain data: what it is made of, and where each number is from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Self

import numpy as np

from ..signals.srs.grid import octave_grid
from .chain import Twin
from .contact_interface import ContactStage
from .effects import Effect, checked_effects, effect_from_json
from .gun.bench import GunBench
from .gun.calibration import VelocityShots
from .gun.effect import GunEffect
from .launch import GunStage
from .plate.modal import ModalPlate
from .plates import PlateSpread, PlateStage
from .sensors.chain import SensorChain

FORMAT = 1
KINDS = ("measured", "fitted", "assumed")


@dataclass(frozen=True)
class Source:
    """Where a number is from: `kind` is one of `KINDS`, `where` a table, a record, a page."""

    kind: str
    where: str

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"source is {self.kind!r}; expected one of {', '.join(KINDS)}")


_KEYS = ("format", "gun", "velocity_spread", "contact", "plate", "effects", "plate_spread", "lines", "sources")
_OPTIONAL = ("unknown_effects", "velocity_shots")
#: Of a number of which nobody has said where it is from.
UNSTATED = Source("assumed", "not stated")


@dataclass(frozen=True)
class Lines:
    """Lines of the spectra, Q, and the records that they are made of."""

    low_hz: float = 100.0
    high_hz: float = 10_000.0
    per_octave: int = 6
    q: float = 10.0
    sampling_rate_hz: float = 100_000.0
    samples: int = 10_000


@dataclass(frozen=True)
class TwinConfiguration:
    """Everything that makes a twin but the plate's modes and a registered model, which are named only.

    `contact` is a law's name or a model's ("models:/coregional-gp@champion"). `sources` goes by the names that
    `numbers` has. Raises `ValueError` for a source of a number that there is not.
    """

    gun: GunBench
    velocity_spread: float
    contact: str
    plate: str
    effects: tuple[Effect, ...] = ()
    plate_spread: PlateSpread = field(default_factory=PlateSpread)
    lines: Lines = field(default_factory=Lines)
    sources: Mapping[str, Source] = field(default_factory=dict, hash=False)
    unknown_effects: bool = False
    velocity_shots: VelocityShots | None = field(default=None, compare=False)  # arrays: compared as JSON

    def __post_init__(self) -> None:
        if unknown := sorted(set(self.sources) - set(self.numbers())):
            raise ValueError(
                f"a source of {unknown[0]!r}, which is no number of this twin: {', '.join(self.numbers())}"
            )

    def numbers(self) -> dict[str, Any]:
        """Every number by its name: "gun.travel_m", "gun.blow_by.clearance_m"."""
        numbers = {f"gun.{name}": value for name, value in asdict(self.gun).items()}
        numbers |= {"gun.velocity_spread": self.velocity_spread}
        numbers |= {f"plate.spread.{name}": value for name, value in asdict(self.plate_spread).items()}
        numbers |= {f"lines.{name}": value for name, value in asdict(self.lines).items()}
        for effect in self.effects:
            numbers |= {f"{effect.id}.{name}": value for name, value in effect.as_json().items() if name != "id"}
        return numbers

    def source_rows(self) -> Iterator[dict[str, Any]]:
        """A row for each number: what a run prints of its sources."""
        for name, value in self.numbers().items():
            source = self.sources.get(name, UNSTATED)
            yield {"number": name, "value": value, "is": source.kind, "from": source.where}

    def twin(self, contact: ContactStage, plates: Mapping[str, ModalPlate]) -> Twin:
        """The twin of this configuration on modes of plates by material. `contact` is what `self.contact` names."""
        stages = {stage: tuple(e for e in self.effects if e.stage() == stage) for stage in ("gun", "plate", "sensor")}
        lines = self.lines
        return Twin(
            contact=contact,
            gun=GunStage(
                self.gun,
                self.velocity_spread,
                checked_effects(stages["gun"], GunEffect),
                unknown_effects=self.unknown_effects,
                shots=self.velocity_shots,
            ),
            plate=PlateStage(plates, stages["plate"], self.plate_spread, self.plate),
            sensors=SensorChain.of(stages["sensor"]),
            frequency_hz=octave_grid(lines.low_hz, lines.high_hz, lines.per_octave),
            q=lines.q,
            sampling_rate_hz=lines.sampling_rate_hz,
            samples=lines.samples,
        )

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back."""
        return {
            "format": FORMAT,
            "gun": asdict(self.gun),
            "velocity_spread": self.velocity_spread,
            "contact": self.contact,
            "plate": self.plate,
            "effects": [effect.as_json() for effect in self.effects],
            "plate_spread": asdict(self.plate_spread),
            "lines": asdict(self.lines),
            "sources": {name: asdict(source) for name, source in self.sources.items()},
            "unknown_effects": self.unknown_effects,
            "velocity_shots": None if self.velocity_shots is None else _plain(self.velocity_shots),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Raises `ValueError` naming what is missing, unknown or out of range, `LookupError` for an unknown effect."""
        known_keys = (*_KEYS, *_OPTIONAL)
        if unknown := sorted(set(data) - set(known_keys)):
            raise ValueError(f"unknown key {unknown[0]!r}; known: {', '.join(known_keys)}")
        if data.get("format") != FORMAT:
            raise ValueError(f"format is {data.get('format')!r}; expected {FORMAT}")
        try:
            return cls(
                gun=GunBench(**data["gun"]),
                velocity_spread=float(data["velocity_spread"]),
                contact=str(data["contact"]),
                plate=str(data["plate"]),
                effects=tuple(effect_from_json(table) for table in data.get("effects", [])),
                plate_spread=PlateSpread(**data.get("plate_spread", {})),
                lines=Lines(**data.get("lines", {})),
                sources={name: Source(**source) for name, source in data.get("sources", {}).items()},
                unknown_effects=bool(data.get("unknown_effects", False)),
                velocity_shots=_velocity_shots(data.get("velocity_shots")),
            )
        except KeyError as error:
            raise ValueError(f"key {error} is missing; known: {', '.join(known_keys)}") from error
        except TypeError as error:  # a keyword that a record has not
            raise ValueError(str(error)) from error


def configuration_of(twin: Twin, sources: Mapping[str, Source] | None = None) -> TwinConfiguration:
    """Of a twin with a gun, its lines in equal ratios. Raises `ValueError` for a twin that none can describe."""
    if twin.gun is None:
        raise ValueError("a twin without a gun has no configuration")
    lines = _lines(twin)
    of_contact = getattr(twin.contact, "effects", ())  # a registered model has none
    return TwinConfiguration(
        gun=twin.gun.bench,
        velocity_spread=twin.gun.velocity_spread,
        contact=twin.contact.label,
        plate=twin.plate.label,
        effects=(*twin.gun.effects, *of_contact, *twin.plate.effects, *twin.sensors.effects),
        plate_spread=twin.plate.spread,
        lines=lines,
        sources=sources or {},
        unknown_effects=twin.gun.unknown_effects,
        velocity_shots=twin.gun.shots,
    )


def _lines(twin: Twin) -> Lines:
    given = twin.frequency_hz
    low, high = float(given[0]), float(given[-1])
    per_octave = round(1 / float(np.log2(given[1] / given[0]))) if given.size > 1 else 1
    grid = octave_grid(low, high, max(per_octave, 1))
    if grid.shape != given.shape or not np.allclose(grid, given):
        raise ValueError(f"lines from {low:g} to {high:g} Hz are not so many to an octave")
    return Lines(low, high, max(per_octave, 1), twin.q, twin.sampling_rate_hz, twin.samples)


def _plain(shots: VelocityShots) -> dict[str, list[float]]:
    return {name: values.tolist() for name, values in vars(shots).items()}


def _velocity_shots(table: Mapping[str, Any] | None) -> VelocityShots | None:
    return None if table is None else VelocityShots(**{name: np.array(values) for name, values in table.items()})
