"""A twin's configuration is data that reads back, and tells where each number is from."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.configuration import UNSTATED, Source, TwinConfiguration, configuration_of
from pyroshock.twin.contact.prior import PriorContact
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.nominal import muzzle_velocity
from pyroshock.twin.launch import GunStage
from pyroshock.twin.plates import PlateSpread, PlateStage
from pyroshock.twin.sensors.chain import SensorChain
from support.records.twin_parts import BENCH, HalfSine, ringing_plate, setting

SOURCES = {
    "gun.travel_m": Source("fitted", "Table 5.1"),
    "gun.velocity_spread": Source("measured", "campaign first-shots, 5 shots"),
    "plate.damping.factor": Source("fitted", "campaign spring"),
}
CONFIGURATION = TwinConfiguration(
    gun=BENCH,
    velocity_spread=0.046,
    contact="half-sine",
    plate="drawing 12",
    effects=(
        effect("gun.back_pressure"),
        effect("plate.damping", factor=1.7),
        effect("sensor.zero_shift", share=0.02),
    ),
    plate_spread=PlateSpread(0.01, 0.2, 4),
    sources=SOURCES,
)
TOML = """
format = 1
velocity_spread = 0.046
contact = "hertz"
plate = "drawing 12"

[gun]
tank_volume_m3 = 0.0095
bore_diameter_m = 0.049
projectile_diameter_m = 0.048
travel_m = 0.9
friction_coefficient = 1.464
heat_capacity_ratio = 1.4
efficiency = 0.5

[[effects]]
id = "plate.damping"
factor = 1.7

[sources."plate.damping.factor"]
kind = "fitted"
where = "campaign spring"
"""


def test_reads_back_from_json():
    assert TwinConfiguration.from_json(json.loads(json.dumps(CONFIGURATION.as_json()))) == CONFIGURATION


def test_reads_toml():
    found = TwinConfiguration.from_json(tomllib.loads(TOML))
    assert found.effects == (effect("plate.damping", factor=1.7),)
    assert found.gun == BENCH
    assert found.sources["plate.damping.factor"].where == "campaign spring"


def test_twin_made_of_it_gives_it_back():
    twin = CONFIGURATION.twin(HalfSine(), {"aluminum": ringing_plate()})
    assert configuration_of(twin, SOURCES) == CONFIGURATION


def test_twin_made_of_it_predicts_as_the_one_it_is_of():
    twin = Twin(
        HalfSine(),
        GunStage(BENCH, 0.05, (effect("gun.back_pressure"),)),  # of the gun
        PlateStage({"aluminum": ringing_plate()}, (effect("plate.stiffness"),)),
        SensorChain.of([effect("sensor.acceleration_gain")]),
    )
    again = TwinConfiguration.from_json(configuration_of(twin).as_json()).twin(
        HalfSine(), {"aluminum": ringing_plate()}
    )
    one = [setting(tank_pressure_pa=5e5)]
    np.testing.assert_array_equal(again.spectra(one), twin.spectra(one))


def test_measured_shots_of_a_gun_read_back():
    pressure, mass = np.array([2e5, 4e5, 6e5, 8e5]), np.full(4, 0.5)
    predicted = muzzle_velocity(BENCH, pressure, mass)
    learned = GunStage(BENCH, 0.05).updated(pressure, mass, [0.9, 0.91, 0.92, 0.9] * predicted)
    twin = Twin(HalfSine(), learned)
    data = json.loads(json.dumps(configuration_of(twin).as_json()))
    again = TwinConfiguration.from_json(data).twin(HalfSine(), {})
    shots = [setting(tank_pressure_pa=3e5), setting(tank_pressure_pa=9e5)]
    np.testing.assert_array_equal(again.velocities(shots), twin.velocities(shots))


def test_every_number_has_a_row_with_its_source():
    rows = {row["number"]: row for row in CONFIGURATION.source_rows()}
    assert rows["gun.travel_m"] == {"number": "gun.travel_m", "value": 0.9, "is": "fitted", "from": "Table 5.1"}
    assert rows["sensor.zero_shift.share"]["value"] == 0.02
    assert rows["gun.bore_diameter_m"]["is"] == UNSTATED.kind
    assert rows.keys() == CONFIGURATION.numbers().keys()


def test_source_of_no_number_is_refused():
    with pytest.raises(ValueError, match=r"a source of 'gun\.magic', which is no number of this twin: gun\."):
        replace(CONFIGURATION, sources={"gun.magic": Source("assumed", "a dream")})


def test_kind_of_source_is_one_of_three():
    with pytest.raises(ValueError, match="'guessed'; expected one of measured, fitted, assumed"):
        Source("guessed", "a dream")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"magic": 1}, "unknown key 'magic'; known: format"),
        ({"format": 9}, "format is 9; expected 1"),
        ({"gun": {}}, "tank_volume_m3"),
        ({"lines": {"magic": 1}}, "magic"),
        ({"effects": [{"id": "plate.damping", "factor": 1e9}]}, r"plate\.damping: factor = 1000000000"),
    ],
)
def test_damaged_data_is_refused_by_name(change, message):
    with pytest.raises(ValueError, match=message):
        TwinConfiguration.from_json(CONFIGURATION.as_json() | change)


def test_what_is_missing_is_named():
    data = CONFIGURATION.as_json()
    del data["contact"]
    with pytest.raises(ValueError, match="key 'contact' is missing"):
        TwinConfiguration.from_json(data)


def test_lines_in_no_order_have_no_configuration():
    twin = Twin(HalfSine(), GunStage(BENCH, 0.05), frequency_hz=np.array([100.0, 130.0, 1000.0]))
    with pytest.raises(ValueError, match="not so many to an octave"):
        configuration_of(twin)


def test_a_twin_with_the_contacts_prior_reads_back_with_what_is_fixed_of_it():
    """The contact itself is given by whoever has its measured shots; its label and its fixed effects are data."""
    fixed = (effect("contact.plastic_yield", pressure_over_yield_strength=3.0),)
    twin = Twin(PriorContact(fixed), GunStage(BENCH, 0.046), PlateStage({"aluminum": ringing_plate()}))
    again = TwinConfiguration.from_json(json.loads(json.dumps(configuration_of(twin).as_json())))
    assert again == configuration_of(twin)
    assert again.contact == "prior of 3 effects + contact.plastic_yield" and again.effects == fixed
    assert configuration_of(again.twin(PriorContact(fixed), twin.plate.plates)).as_json() == again.as_json()
