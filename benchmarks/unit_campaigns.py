"""Virtual campaigns whose units are right, and the same campaigns with one unit wrong.

Recorded ones (`simulate`) hold all channels of the bench; withheld ones (`validation.cases`) reach
gaps of 60 tolerances, also by second laws of every effect. Strengths reach from nothing to the ends
of their physical ranges.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyroshock.validation.case_plan import BENCHES
from pyroshock.validation.cases.draw import ALWAYS, BENCH_DEFAULT, OFF, STRONGEST, WEAKEST
from pyroshock.validation.cases.record import record_case
from pyroshock.validation.cases.scale_cause import RANGES, largest
from pyroshock.virtualbench.campaigns import ringing
from pyroshock.virtualbench.effects import CATALOGUE, SIGNED, Effects, EffectSwitch
from pyroshock.virtualbench.recorder import open_seal, write_recording, write_runs
from pyroshock.virtualbench.simulate import simulate

#: In these turns: 120 of 240 campaigns have a gun's force and velocity, 20 a gun's velocity alone,
#: 60 a hammer, 40 forces and accelerations of a plate.
TURNS = (
    *("shots", "chain", "hammer", "shots", "plate", "blows"),
    *("shots", "chain", "gun", "chain", "plate", "blows"),
    *("shots", "chain", "hammer", "shots", "plate", "blows"),
    *("shots", "chain", "gun", "chain", "plate", "hammer"),
)
#: What each kind is.
KINDS: Mapping[str, str] = {
    "shots": "gun, recorded: force, laser, tank pressure",
    "chain": "gun, withheld: force, velocity, plate",
    "gun": "gun, withheld: velocity alone",
    "blows": "hammer, recorded: velocity integrated",
    "hammer": "hammer, withheld: velocity reported",
    "plate": "hammer, withheld: plate, no velocity",
}
#: No check looks at what the plate of a recorded campaign does above this.
_PLATE_HZ = 800.0
#: At full scale so many effects are drawn from this share of their range on.
_LARGE, _LARGE_FROM = 3, 0.5
#: Standard uncertainty of a laser's velocity that stands in runs.csv, relative.
_READING_U = 0.003
_TIPS = (
    ("steel", 30.0),
    ("aluminum", 30.0),
    ("delrin", 30.0),
    ("polyurethane", 15.0),
    ("PLA", 45.0),
)
_LAYERS = (("none", "none"), ("steel", "none"), ("aluminum", "none"), ("steel", "polymeric"))


def write_campaign(number: int, seed: int, folder: Path) -> tuple[str, str]:
    """Write campaign `number` into the new `folder`; its kind (of `KINDS`), and its strengths in
    words."""
    kind = TURNS[number % len(TURNS)]
    rng = np.random.default_rng([seed, number])
    if kind in ("shots", "blows"):
        return kind, _record(kind, number, rng, folder)
    able = [name for name, tier in BENCHES.items() if kind in tier.kinds]
    tier = able[number // 3 % len(able)]
    record_case(BENCHES[tier].draw(kind, rng, "development", number), folder, seed)
    return kind, tier


def _record(kind: str, number: int, rng: np.random.Generator, folder: Path) -> str:
    full_scale = number // 3 % 3 == 0
    effects = _drawn_effects(rng, full_scale=full_scale)
    with _coarse_plates():
        if kind == "blows":
            simulate(
                _blow_rows(rng),
                "hammer",
                folder,
                seed=number,
                effects=effects,
                repetitions=2,
                jobs=1,
            )
        else:
            campaign = simulate(
                _shot_rows(rng), "gun", folder, seed=number, effects=effects, repetitions=1, jobs=1
            )
            if number % 2:  # without, the ingest finds it in the laser's channel
                truths = [
                    run["hits"][0]["muzzle_velocity_m_s"] for run in open_seal(campaign.seal).runs
                ]
                read_m_s = np.array(truths) * (1 + _READING_U * rng.standard_normal(len(truths)))
                _rewrite_rows(
                    folder,
                    lambda _, place: {"measured_velocity_m_s": _velocity_cell(read_m_s[place])},
                )
    return "full scale" if full_scale else "realistic"


def _velocity_cell(velocity_m_s: float) -> str:
    return f"{velocity_m_s:.5g}" if velocity_m_s > 0 else ""


@contextmanager
def _coarse_plates() -> Iterator[None]:
    before, ringing.MAX_FREQUENCY_HZ = ringing.MAX_FREQUENCY_HZ, _PLATE_HZ
    try:
        yield
    finally:
        ringing.MAX_FREQUENCY_HZ = before


def _drawn_effects(rng: np.random.Generator, *, full_scale: bool) -> Effects:
    """Each effect off, or at 0.3 to 3 times its default; at full scale some are drawn up to their
    ends."""
    scaled = [
        name
        for name in CATALOGUE
        if name in RANGES and name != ALWAYS and not name.startswith("sensor.")
    ]
    large = set(rng.choice(scaled, _LARGE, replace=False).tolist()) if full_scale else set()
    switches = []
    for name in CATALOGUE:
        sign = int(rng.choice((1, -1))) if name in SIGNED else 1
        size = math.exp(rng.uniform(math.log(WEAKEST), math.log(STRONGEST)))
        if name in RANGES:
            end = largest(name, sign) * sign / BENCH_DEFAULT.get(name, 1.0)
            size = rng.uniform(_LARGE_FROM, 1.0) * end if name in large else min(size, end)
        acts = name in large or bool(rng.random() >= OFF)
        switches.append(EffectSwitch(name, on=acts, strength=sign * size))
    # Every bench stands in an atmosphere.
    return Effects(tuple(switches)).with_strength(
        ALWAYS, float(rng.uniform(RANGES[ALWAYS].low, RANGES[ALWAYS].high))
    )


def _shot_rows(rng: np.random.Generator) -> list[dict[str, str]]:
    """Eight shots, each with other tips, layers, masses and pressures."""
    masses = rng.choice([0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.0], 3, replace=False)
    pressures = np.geomspace(rng.uniform(0.5, 0.8), rng.uniform(2.0, 4.0), 4).round(2)
    tips, layers = _drawn_pairs(_TIPS, 2, rng), _drawn_pairs(_LAYERS, 2, rng)
    material = str(rng.choice(["steel", "aluminum"]))
    return [
        {
            "run": str(number + 1),
            "plate_material": material,
            **_faces(tips[number % 2], layers[number // 4]),
            "bullet_mass_kg": f"{masses[number % 3]:g}",
            "velocity_level": "low",
            "tank_pressure_bar": f"{pressures[number // 2]:g}",
        }
        for number in range(8)
    ]


def _blow_rows(rng: np.random.Generator) -> list[dict[str, str]]:
    """Six recordings of a hammer."""
    tips, layers = _drawn_pairs(_TIPS[:4], 3, rng), _drawn_pairs(_LAYERS, 2, rng)
    return [
        {
            "run": str(number + 1),
            "impact_position": f"#{1 + number % 3}",
            "hammer_speed": ("low", "high")[number // 3],
            **_faces(tips[number % 3], layers[number % 2]),
            "boundary_conditions": "free",
        }
        for number in range(6)
    ]


def _drawn_pairs(
    pairs: tuple[tuple[str, object], ...], count: int, rng: np.random.Generator
) -> list[tuple[str, object]]:
    return [pairs[place] for place in rng.choice(len(pairs), count, replace=False)]


def _faces(tip: tuple[str, object], layer: tuple[str, object]) -> dict[str, str]:
    return {
        "tip_material": tip[0],
        "tip_radius_mm": str(tip[1]),
        "anvil_material": layer[0],
        "insulator": str(layer[1]),
    }


@dataclass(frozen=True)
class WrongUnit:
    """A unit that is wrong in all of a campaign: `write` changes its folder; `words` must be in
    what is said of it."""

    name: str
    words: str
    write: Callable[[Path], None]


def _rewrite_rows(folder: Path, change: Callable[[dict[str, str], int], Mapping[str, str]]) -> None:
    with (folder / "runs.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    write_runs(folder, [{**row, **change(row, place)} for place, row in enumerate(rows)])


def _column(name: str, factor: float) -> Callable[[Path], None]:
    """Multiplies a column of runs.csv."""

    def change(row: dict[str, str], _: int) -> Mapping[str, str]:
        return {name: f"{float(row[name]) * factor:.6g}"} if row.get(name) else {}

    return lambda folder: _rewrite_rows(folder, change)


def _channels(beginning: str, factor: float) -> Callable[[Path], None]:
    """Multiplies channels of all recordings; `fs` is the sampling rate."""

    def write(folder: Path) -> None:
        for path in sorted((folder / "recordings").iterdir()):
            with np.load(path) as file:
                arrays = {name: file[name] for name in file.files}
            changed = {
                name: x * np.float32(factor) if name.startswith(beginning) else x
                for name, x in arrays.items()
            }
            rate = float(arrays["fs"]) * (factor if beginning == "fs" else 1.0)
            path.unlink()
            write_recording(path, {name: x for name, x in changed.items() if name != "fs"}, rate)

    return write


_LBF, _FOOT, _PSI, _G = 1 / 4.4482216, 1 / 0.3048, 14.503774, 1 / 9.80665
_FORCE = WrongUnit("lbf as N", "values in lbf where N", _channels("force", _LBF))
_CLOCK = WrongUnit("ms as s", "values in kHz where Hz", _channels("fs", 1e-3))
_RADIUS = WrongUnit("mm as m: tip radius", "tip", _column("tip_radius_mm", 1e-3))
_LENGTH = WrongUnit("mm as m: bullet length", "bullet length", _column("bullet_length_mm", 1e-3))
_MUZZLE = WrongUnit(
    "ft/s as m/s", "values in ft/s where m/s", _column("measured_velocity_m_s", _FOOT)
)
_IMPACT = WrongUnit(
    "ft/s as m/s", "values in ft/s where m/s", _column("impact_velocity_m_s", _FOOT)
)
_PSI_BAR = WrongUnit("psi as bar", "values in psi where bar", _column("tank_pressure_bar", _PSI))
_BAR_KPA = WrongUnit("bar as kPa", "values in bar where kPa", _column("tank_pressure_bar", 1e-2))
_PLATE_G = WrongUnit("g as m/s2: plate", "values in g where m/s2", _channels("acceleration_", _G))
_HEAD_G = WrongUnit(
    "g as m/s2: hammer", "values in g where m/s2", _channels("acceleration_hammer", _G)
)
#: The wrong units of each kind of campaign, in turns. A muzzle velocity stands in every second
#: table of shots.
WRONG_UNITS: Mapping[str, tuple[WrongUnit, ...]] = {
    "shots": (_FORCE, _MUZZLE, _PSI_BAR, _BAR_KPA, _CLOCK, _LENGTH),
    "chain": (_FORCE, _MUZZLE, _PSI_BAR, _BAR_KPA, _PLATE_G, _CLOCK, _RADIUS),
    "gun": (_MUZZLE, _PSI_BAR, _BAR_KPA),
    "blows": (_FORCE, _HEAD_G, _CLOCK, _RADIUS),
    "hammer": (_FORCE, _IMPACT, _CLOCK, _RADIUS),
    "plate": (_FORCE, _PLATE_G, _CLOCK),
}


def wrong_unit_of(kind: str, turn: int, folder: Path) -> WrongUnit:
    """The wrong unit of the `turn`-th campaign of its kind: the next one that its `folder` can
    have."""
    wrong = WRONG_UNITS[kind][turn % len(WRONG_UNITS[kind])]
    head = (folder / "runs.csv").read_text(encoding="utf-8").split("\n", 1)[0]
    reported = "measured_velocity_m_s" in head
    if kind == "shots" and wrong is (
        _LENGTH if reported else _MUZZLE
    ):  # the length of the bullet is in the laser's
        return _MUZZLE if reported else _LENGTH
    return wrong
