"""Small valid files of everything that is fuzzed: what the mutations start from."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzzing.mutations import folders
from numpy.typing import NDArray
from pyroshock.doe.space import shipped_factors
from support.records.campaigns import GUN_TOML, HAMMER_TOML
from support.records.instruments import GDS, MDO3014, MSO58, PICO, PICO_ROWS, TDS500, TDS2014
from support.records.recipes import RECIPES, Truth, base_truth

_REPOSITORY = Path(__file__).resolve().parents[2]
RATE_HZ = 10_000.0


@cache
def recordings(*names: str) -> tuple[bytes, ...]:
    """The files of these recipes."""
    return tuple(_written(name, base_truth()) for name in names)


def _written(recipe: str, truth: Truth) -> bytes:
    suffix, write = RECIPES[recipe]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"seed{suffix}"
        write(path, truth)
        return path.read_bytes()


@cache
def oscilloscopes() -> tuple[bytes, ...]:
    texts = (MDO3014, MSO58, TDS2014, TDS500, PICO.format(PICO_ROWS), GDS)
    return tuple(text.encode() for text in texts)


@cache
def bare_lvm() -> tuple[bytes, ...]:
    """Numbers alone, between tabs and between commas."""
    table, texts = (
        np.column_stack([*base_truth().channels.values()]),
        (io.StringIO(), io.StringIO()),
    )
    for text, delimiter in zip(texts, "\t,", strict=True):
        np.savetxt(text, table, "%.6f", delimiter)
    return tuple(text.getvalue().encode() for text in texts)


@cache
def wavs() -> tuple[bytes, ...]:
    """Of every kind of sample, with as many channels as the names that are given."""
    from scipy.io import wavfile

    values = np.random.default_rng(4).integers(-128, 128, (96, 3))
    files = []
    for dtype in ("u1", "i2", "i4", "f4", "f8"):
        out = io.BytesIO()
        wavfile.write(out, 51200, (values + 128 * (dtype == "u1")).astype(dtype))
        files.append(out.getvalue())
    return tuple(files)


@cache
def mat_structures() -> tuple[bytes, ...]:
    from scipy.io import savemat

    channels = base_truth().channels
    shot = {
        "fs": RATE_HZ,
        "operator": "Ana",
        **channels,
        "bench": {"y": np.column_stack([*channels.values()])},
    }
    files = []
    for packed in (False, True):
        out = io.BytesIO()
        savemat(
            out,
            {"shot": shot, "again": {"time": np.arange(96) / RATE_HZ, **channels}},
            do_compression=packed,
        )
        files.append(out.getvalue())
    return tuple(files)


def shipped(*paths: str) -> tuple[bytes, ...]:
    """Files of the repository."""
    return tuple((_REPOSITORY / path).read_bytes() for path in paths)


HAMMER = (
    HAMMER_TOML.format(name="hammer")
    + """\
[channels.acceleration_1]
quantity = "acceleration"
unit = "m/s2"
position = "hammer"
axis = "z"
"""
)
PLATE = (
    HAMMER.replace('position = "hammer"', 'position = "plate"')
    + """\
[bench.plate]
modes = "plate_modes.csv"
material = "aluminum"
thickness_m = 0.01
outline_m = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.6], [0.0, 0.6]]

[recordings]
columns = ["time [ms]", "force", "acceleration_1"]
sampling_rate_hz = 10000
delimiter = "tab"
decimal = "."
"""
)
GUN = (
    GUN_TOML.format(name="gun")
    + """\
[channels.laser]
quantity = "voltage"
unit = "V"
position = "muzzle"
[channels.tank]
quantity = "pressure"
unit = "bar"
sensitivity = 0.5621
offset_v = 0.3624
"""
)
HAMMER_RUNS = """\
run,repetition,tip_material,tip_radius_mm,plate_material,anvil_material,insulator,\
boundary_conditions,impact_position,hammer_speed,operator_name,\
impact_velocity_m_s,impact_velocity_u_m_s,recording
1,1,steel,15,aluminum,none,none,free,center,low,Ana,1.5,0.1,{0}
"""
GUN_RUNS = """\
run;repetition;bullet_mass_kg;tank_pressure_bar;tip_material;measured_velocity_m_s;\
measured_velocity_u_m_s;bullet_length_mm;bullet_length_u_mm;recording
1;1;0,1428;0,25;PLA;11,5;0,1;40;0,1;{0}
2;1;0,1428;0,30;PLA;12,5;;;;
"""
MODES = """\
mode,frequency_hz,damping_ratio,shape_impact,shape_acceleration_1
1,310.5,0.012,0.61,-0.40
2,722,0.02,-0.35,0.28
"""
FACTORS = """\
name = "own"
kind = "hammer"

[[factors]]
name = "tip_material"
kind = "categorical"
levels = ["steel", "aluminum", "PLA"]
change = 1

[[factors]]
name = "tip_radius"
column = "tip_radius_mm"
kind = "numeric"
unit = "mm"
levels = [5, 10, 15]

[[factors]]
name = "speed"
kind = "ordered"
levels = ["low", "high"]
unit = "m/s"
values = [1, 3]

[[requires]]
factor = "tip_material"
level = "PLA"
needs = "speed"
levels = ["low"]

[[tied]]
factors = ["tip_material", "tip_radius"]
combinations = [["steel", 5], ["aluminum", 10], ["PLA", 15]]

[bench]
pressure_bar = [0.1, 3.0]
"""
PLAN = "run,tip_material,tip_radius_mm,speed\n1,steel,5,low\n2,aluminum,10,high\n3,PLA,15,low\n"
BENCH = """\
[gun]
tank_volume_m3 = 0.0095
bore_diameter_m = 0.049
projectile_diameter_m = 0.048
travel_m = 0.9
friction_coefficient = 1.4
heat_capacity_ratio = 1.4
efficiency = 0.5

[plate]
material = "steel"
thickness_m = 0.01
outline_m = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.6], [0.0, 0.6]]
damping_ratio = 0.01

[plate.impact_points]
center = [0.5, 0.3]

[plate.sensors]
acceleration_1 = [0.25, 0.2]
"""
TARGETS = (
    "frequency_hz,level_g,upper_db,lower_db\n100,30,6,-6\n1000,1000,6,-6\n10000,1000,9,-6\n",
    "# of a standard\nFrequency (Hz);Level "
    "(m/s2);slope_db_per_octave\n100;300,5;\n1000;;6\n2000;9000;\n",
    "f_hz\tmaximax_m_s2\ttolerance_db\n100\t3e2\t3\n2000\t1e4\tinf\n",
)


def space_texts() -> tuple[bytes, ...]:
    return (FACTORS.encode(), shipped_factors("hammer").encode(), shipped_factors("gun").encode())


def hit() -> Truth:
    """Force and acceleration of one hit, 0.06 s."""
    time_s = np.arange(600) / RATE_HZ
    phase = np.clip((time_s - 0.02) / 2e-3, 0, 1)
    noise = np.random.default_rng(7).normal(size=(2, 600))
    force = 1500 * np.sin(np.pi * phase) ** 1.5 + 0.2 * noise[0]
    channels = {"force": force.astype(np.float32), "acceleration_1": -2 * force + 3 * noise[1]}
    return Truth(channels, {"force": "N", "acceleration_1": "m/s2"}, RATE_HZ)


@cache
def hammer_folders(*recipes: str) -> tuple[bytes, ...]:
    """One campaign for each recipe, with a recording of one hit in that format."""
    return tuple(_hammer_folder(recipe) for recipe in recipes)


def _hammer_folder(recipe: str) -> bytes:
    name = f"recordings/a{RECIPES[recipe][0]}"
    toml, modes = (PLATE, {"plate_modes.csv": MODES.encode()}) if len(recipe) % 2 else (HAMMER, {})
    runs = HAMMER_RUNS.format(name)
    return folders.pack(
        {
            "campaign.toml": toml.encode(),
            "runs.csv": runs.encode(),
            **modes,
            name: _written(recipe, hit()),
        }
    )


@cache
def gun_folder() -> bytes:
    time_s = np.arange(600) / RATE_HZ
    laser = np.where((time_s > 0.02) & (time_s < 0.024), 0.5, 4.5)
    recorded: Mapping[str, NDArray[Any]] = {"laser": laser, "tank": np.full(600, 0.5)}
    content = io.BytesIO()
    np.savez(content, fs=RATE_HZ, **recorded)
    runs = GUN_RUNS.format("a.npz")
    return folders.pack(
        {"campaign.toml": GUN.encode(), "runs.csv": runs.encode(), "a.npz": content.getvalue()}
    )


@cache
def zipped_folder() -> bytes:
    """The hammer's folder as a browser sends it."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in folders.unpack(hammer_folders("npz")[0]).items():
            archive.writestr(f"campaign/{name}", content)
    return out.getvalue()
