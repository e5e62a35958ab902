"""`campaign.toml`: who, what, with which bench and channels, refused where it is not understood."""

from __future__ import annotations

import datetime as dt
import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ...files.toml_text import key_problems, read_toml_text, toml_table
from ...schema.known_factors import MAX_REGULATED_PRESSURE_PA
from ...schema.known_facts import KnownFact, facts_to_json
from ...signals.channel import Sensor
from ...signals.units import SI_UNITS, UnitError
from ..errors import LONGEST_NAME, Faults, IngestError, parse_date, printable
from ..readers import ReadingOptions
from .calibration_points import stated_calibration
from .known_facts import read_known_facts
from .recording_options import ForceSource, force_source, reading_options

FILE = "campaign.toml"
KINDS = ("hammer", "gun")


@dataclass(frozen=True)
class GunPart:
    """`[bench.gun]`: the constants of equation 2.16, SI."""

    tank_volume_m3: float
    bore_diameter_m: float
    projectile_diameter_m: float
    travel_m: float
    friction_coefficient: float
    heat_capacity_ratio: float
    efficiency: float


@dataclass(frozen=True)
class HammerPart:
    """`[bench.hammer]`."""

    mass_kg: float


@dataclass(frozen=True)
class PlatePart:
    """`[bench.plate]`: a modal table's file name, or material, thickness (m) and outline (corners
    in m)."""

    modes: str | None = None
    material: str | None = None
    thickness_m: float | None = None
    outline_m: tuple[tuple[float, float], ...] | None = None


@dataclass(frozen=True)
class CampaignFile:
    """A `campaign.toml` that was understood whole."""

    folder: Path
    name: str
    kind: str
    date: dt.date
    description: str | None
    operator: str | None
    gun: GunPart | None
    hammer: HammerPart | None
    plate: PlatePart | None
    sensors: Mapping[str, Sensor]
    factors: Mapping[
        str, str
    ]  # `[factors]`: columns of runs.csv that are free factors, and what they are
    confirmed: tuple[
        str, ...
    ]  # `confirmed` of `[bench]`: rules of `bench_rules` that this bench breaks rightly
    max_regulated_pressure_pa: (
        float  # of `[bench.gun]`: gauge; a limit for rows, not a property of the gun
    )
    reading: ReadingOptions  # `[recordings]`: what the recordings do not say themselves
    force: ForceSource | None = None  # `[force]`: the contact force is derived from accelerations
    known_facts: tuple[
        KnownFact, ...
    ] = ()  # `[known]`: what the laboratory measured of its own bench

    @property
    def fingerprint(self) -> str:
        """SHA-256 of what two parts of one campaign must share: kind, date, bench and known
        facts."""
        return campaign_fingerprint(self.kind, self.date, self.bench, self.known_facts)

    @property
    def bench(self) -> BenchParts:
        return {"gun": self.gun, "hammer": self.hammer, "plate": self.plate}


#: The parts of a bench by the names of their tables; None of one that there is not.
BenchParts = Mapping[str, GunPart | HammerPart | PlatePart | None]


def campaign_fingerprint(
    kind: str, date: dt.date, bench: BenchParts, known_facts: Iterable[KnownFact]
) -> str:
    """SHA-256 of what two parts of one campaign must share.

    Parameters:
        kind: The kind of the campaign.
        date: Its date.
        bench: The parts of its bench, with gun, hammer and plate.
        known_facts: What the laboratory measured of its bench.
    """
    parts = {key: asdict(part) if part else None for key, part in bench.items()}
    facts = facts_to_json(known_facts)
    text = json.dumps([kind, date.isoformat(), parts, *([facts] if facts else [])], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def read_bench(bench: Mapping[str, Any]) -> BenchParts:
    """The parts of a bench as `[bench]` of campaign.toml states them.

    Parameters:
        bench: The tables gun, hammer and plate, each with its keys; one that is missing is no part
            of the bench.

    Raises:
        IngestError: For what is not understood, with key, value and what was expected.
    """
    faults = Faults()
    parts = {
        "gun": faults.of(_gun, bench),
        "hammer": faults.of(_hammer, bench),
        "plate": faults.of(_plate, bench),
    }
    faults.refuse()
    return parts


def read_campaign_file(folder: Path) -> CampaignFile:
    """Read and check the campaign.toml of a folder.

    Parameters:
        folder: The campaign folder.

    Raises:
        IngestError: For a folder or a file that is missing, and for what is not understood, with
            file, key, value and what was expected.
    """
    if not folder.is_dir():
        raise IngestError(
            f"{folder}: no such folder; expected a campaign folder with {FILE} and runs.csv"
        )
    data = _load(folder / FILE)
    faults = Faults()
    faults.of(
        _known_keys,
        data,
        ("campaign", "bench", "channels", "factors", "force", "known", "recordings"),
        "",
    )
    campaign = faults.of(_table, data, "campaign", required=True) or {}
    bench = faults.of(_table, data, "bench") or {}
    faults.of(
        _known_keys, campaign, ("name", "kind", "date", "description", "operator"), "campaign"
    )
    faults.of(_known_keys, bench, ("gun", "hammer", "plate", "confirmed"), "bench")
    keys = (
        faults if campaign else Faults()
    )  # a table that is missing is one fault, not one for each of its keys
    file = CampaignFile(
        folder=folder,
        name=keys.of(_text, campaign, "name", "campaign", required=True) or "",
        kind=keys.of(_choice, campaign, "kind", "campaign", KINDS),
        date=keys.of(_date, campaign),
        description=faults.of(_text, campaign, "description", "campaign"),
        operator=faults.of(_text, campaign, "operator", "campaign"),
        gun=faults.of(_gun, bench),
        hammer=faults.of(_hammer, bench),
        plate=faults.of(_plate, bench),
        sensors=(
            sensors := faults.attempt(_sensors, faults.of(_table, data, "channels") or {}, folder)
        )
        or {},
        factors=faults.of(_factors, faults.of(_table, data, "factors") or {}),
        confirmed=faults.of(_confirmed, bench),
        max_regulated_pressure_pa=faults.of(_regulator, bench),
        reading=faults.of(reading_options, data),
        force=None
        if sensors is None
        else faults.of(force_source, faults.of(_table, data, "force") or {}, sensors),
        known_facts=faults.of(read_known_facts, faults.of(_table, data, "known") or {}),
    )
    faults.refuse()
    return file


def stated_kind_and_factors(folder: Path) -> tuple[str | None, Mapping[str, str]]:
    """What a `campaign.toml` with faults says of `runs.csv`, so that the table's faults can be told
    as well.

    Parameters:
        folder: The campaign folder.

    Returns:
        The campaign's kind (None where it is not one) and the factors that it declares, with what
        they are.
    """
    try:
        data = _load(folder / FILE)
    except IngestError:
        return None, {}
    campaign, factors = data.get("campaign"), data.get("factors")
    kind = campaign.get("kind") if isinstance(campaign, dict) else None
    declared = factors if isinstance(factors, dict) else {}
    return kind if kind in KINDS else None, {
        c: text for c, text in declared.items() if isinstance(text, str)
    }


def _load(path: Path) -> dict[str, Any]:
    try:
        return toml_table(read_toml_text(path))
    except FileNotFoundError as error:
        raise IngestError(
            f"{path.parent}: no {FILE}; a campaign folder needs one (docs/reference/campaigns.md)"
        ) from error
    except ValueError as error:
        raise IngestError(f"{FILE}: {error}") from error
    except OSError as error:
        raise IngestError(f"{path}: cannot be read: {error.strerror}") from error


def _known_keys(table: Mapping[str, Any], expected: tuple[str, ...], where: str) -> None:
    if problems := key_problems(table, expected, f"{where}." if where else ""):
        raise IngestError(*(f"{FILE}: {problem}" for problem in problems))


def _table(data: Mapping[str, Any], key: str, *, required: bool = False) -> Mapping[str, Any]:
    value = data.get(key, {})
    if not isinstance(value, dict):
        raise IngestError(f"{FILE}: {key!r} is {printable(value)}; expected a table [{key}]")
    if required and not value:
        raise IngestError(f"{FILE}: no table [{key}]; expected name, kind and date there")
    return value


def _text(table: Mapping[str, Any], key: str, where: str, *, required: bool = False) -> str | None:
    value = table.get(key)
    if value is None:
        if required:
            raise IngestError(f"{FILE}: {where}.{key} is missing; expected a text")
        return None
    if not isinstance(value, str) or (required and not value.strip()):
        raise IngestError(f"{FILE}: {where}.{key} is {printable(value)}; expected a text")
    if "\x00" in value:
        raise IngestError(f"{FILE}: {where}.{key} holds a NUL character")
    return _name(value.strip(), f"{where}.{key}") if required else value


def _name(text: str, where: str) -> str:
    if len(text) > LONGEST_NAME or not text.isprintable():
        raise IngestError(
            f"{FILE}: {where} is {printable(text)} ({len(text)} characters); "
            f"expected one line of at most {LONGEST_NAME}"
        )
    return text


def _choice(table: Mapping[str, Any], key: str, where: str, expected: tuple[str, ...]) -> str:
    value = _text(table, key, where, required=True)
    if value not in expected:
        raise IngestError(
            f"{FILE}: {where}.{key} is {printable(value)}; expected one of {', '.join(expected)}"
        )
    return value


def _date(campaign: Mapping[str, Any]) -> dt.date:
    try:
        return parse_date(campaign.get("date"), "an ISO date such as 2026-11-01")
    except ValueError as error:
        raise IngestError(f"{FILE}: campaign.date is {error}") from error


Rule = tuple[str, Callable[[float], bool]]
ABOVE_ZERO: Rule = ("a number above zero", lambda x: x > 0)
NOT_NEGATIVE: Rule = ("a number of zero or more", lambda x: x >= 0)
SHARE: Rule = ("a number above 0, at most 1", lambda x: 0 < x <= 1)
AT_LEAST_ONE: Rule = ("a number of at least 1", lambda x: x >= 1)
NOT_ZERO: Rule = ("a number other than zero", lambda x: x != 0)
ANY: Rule = ("a finite number", lambda _: True)

_GUN: dict[str, Rule] = {
    "tank_volume_m3": ABOVE_ZERO,
    "bore_diameter_m": ABOVE_ZERO,
    "projectile_diameter_m": ABOVE_ZERO,
    "travel_m": ABOVE_ZERO,
    "friction_coefficient": NOT_NEGATIVE,
    "heat_capacity_ratio": AT_LEAST_ONE,
    "efficiency": SHARE,
}
_REGULATOR = "max_regulated_pressure_pa"


def _number(table: Mapping[str, Any], key: str, where: str, rule: Rule) -> float:
    if key not in table:
        raise IngestError(f"{FILE}: {where}.{key} is missing; expected {rule[0]}")
    value = _float(table[key])
    if value is None or not rule[1](value):
        raise IngestError(f"{FILE}: {where}.{key} is {printable(table[key])}; expected {rule[0]}")
    return value


def _optional_number(table: Mapping[str, Any], key: str, where: str, rule: Rule) -> float | None:
    return _number(table, key, where, rule) if key in table else None


def _float(value: object) -> float | None:
    """A finite TOML number; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _gun(bench: Mapping[str, Any]) -> GunPart | None:
    if "gun" not in bench:
        return None
    table = _table(bench, "gun")
    faults = Faults()
    faults.of(_known_keys, table, (*_GUN, _REGULATOR), "bench.gun")
    gun = GunPart(
        **{key: faults.of(_number, table, key, "bench.gun", rule) for key, rule in _GUN.items()}
    )
    faults.refuse()
    if gun.projectile_diameter_m > gun.bore_diameter_m:
        raise IngestError(
            f"{FILE}: bench.gun.projectile_diameter_m is {gun.projectile_diameter_m}; "
            f"expected at most the bore, {gun.bore_diameter_m}"
        )
    return gun


def _regulator(bench: Mapping[str, Any]) -> float:
    table = _table(bench, "gun")
    if _REGULATOR not in table:
        return MAX_REGULATED_PRESSURE_PA
    return _number(table, _REGULATOR, "bench.gun", ABOVE_ZERO)


def _confirmed(bench: Mapping[str, Any]) -> tuple[str, ...]:
    value = bench.get("confirmed", [])
    if not isinstance(value, list) or not all(isinstance(rule, str) for rule in value):
        raise IngestError(
            f"{FILE}: bench.confirmed is {printable(value)}; expected a list "
            f'such as ["negative-size"]'
        )
    return tuple(value)


def _hammer(bench: Mapping[str, Any]) -> HammerPart | None:
    if "hammer" not in bench:
        return None
    table = _table(bench, "hammer")
    faults = Faults()
    faults.of(_known_keys, table, ("mass_kg",), "bench.hammer")
    hammer = HammerPart(mass_kg=faults.of(_number, table, "mass_kg", "bench.hammer", ABOVE_ZERO))
    faults.refuse()
    return hammer


def _plate(bench: Mapping[str, Any]) -> PlatePart | None:
    if "plate" not in bench:
        return None
    table = _table(bench, "plate")
    faults = Faults()
    faults.of(_known_keys, table, ("modes", "material", "thickness_m", "outline_m"), "bench.plate")
    plate = PlatePart(
        modes=faults.of(_text, table, "modes", "bench.plate"),
        material=faults.of(_text, table, "material", "bench.plate"),
        thickness_m=faults.of(_optional_number, table, "thickness_m", "bench.plate", ABOVE_ZERO),
        outline_m=faults.of(_outline, table),
    )
    if "modes" not in table and not {"material", "thickness_m"} <= table.keys():
        faults.add(
            [
                f'{FILE}: [bench.plate] needs modes = "FILE.csv", or material and thickness_m '
                "(with outline_m for the finite element model)"
            ]
        )
    faults.refuse()
    return plate


def _outline(table: Mapping[str, Any]) -> tuple[tuple[float, float], ...] | None:
    value = table.get("outline_m")
    if value is None:
        return None
    corners = [_corner(corner) for corner in value] if isinstance(value, list) else []
    corners_given = tuple(corner for corner in corners if corner is not None)
    if len(corners_given) < max(3, len(corners)):
        raise IngestError(
            f"{FILE}: bench.plate.outline_m is {printable(value)}; "
            "expected at least three corners [[x, y], …] in metres"
        )
    return corners_given


def _corner(value: object) -> tuple[float, float] | None:
    x, y = (
        (_float(value[0]), _float(value[1]))
        if isinstance(value, list) and len(value) == 2
        else (None, None)
    )
    return None if x is None or y is None else (x, y)


def _factors(table: Mapping[str, Any]) -> dict[str, str]:
    faults = Faults()
    factors = {
        column: faults.of(_text, table, column, "factors", required=True) or "" for column in table
    }
    faults.refuse()
    return factors


def _sensors(channels: Mapping[str, Any], folder: Path) -> dict[str, Sensor]:
    faults = Faults()
    sensors = {name: faults.of(_sensor, name, channels, folder) for name in channels}
    faults.refuse()
    return sensors


_OF_CHANNEL = (
    "quantity",
    "unit",
    "sensitivity",
    "offset_v",
    "position",
    "axis",
    "range",
    "calibration",
)


def _sensor(name: str, channels: Mapping[str, Any], folder: Path) -> Sensor:
    table = _table(channels, name)
    where = f"channels.{_name(name, 'the name of a channel')}"
    faults = Faults()
    faults.of(_known_keys, table, _OF_CHANNEL, where)
    sensor = Sensor(
        name=name,
        quantity=faults.of(_choice, table, "quantity", where, tuple(SI_UNITS)),
        unit=faults.of(_text, table, "unit", where, required=True) or "",
        sensitivity=faults.of(_optional_number, table, "sensitivity", where, NOT_ZERO),
        offset_v=faults.of(_optional_number, table, "offset_v", where, ANY) or 0.0,
        position=faults.of(_text, table, "position", where),
        axis=faults.of(_text, table, "axis", where),
        range=faults.of(_optional_number, table, "range", where, ABOVE_ZERO),
    )
    calibration = faults.of(stated_calibration, table, where, folder)
    faults.refuse()
    if calibration is not None:
        line = calibration.line
        sensor = replace(
            sensor, sensitivity=line.sensitivity, offset_v=line.offset, calibration=calibration
        )
    if sensor.sensitivity is None and sensor.offset_v:
        raise IngestError(
            f"{FILE}: {where}.offset_v is {sensor.offset_v}; expected a sensitivity beside it"
        )
    try:
        gain, offset = sensor.conversion
    except UnitError as error:
        raise IngestError(f"{FILE}: {where}: {error}") from error
    if not (math.isfinite(gain) and math.isfinite(offset)) or gain == 0:
        raise IngestError(
            f"{FILE}: {where}.sensitivity is {sensor.sensitivity}; its "
            f"conversion to SI is not a number"
        )
    return sensor
