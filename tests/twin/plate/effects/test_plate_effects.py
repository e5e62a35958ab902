"""Effects of the plate against the finite element model, closed forms and their own limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyroshock.twin.effects import catalogue, effect
from pyroshock.twin.plate.build import PlateBuild, PointMass, PointSpring, named_points
from pyroshock.twin.plate.modal import ModalPlate, PlateEffect, with_effects
from pyroshock.twin.plate.modes import solve_plate
from pyroshock.twin.setting import THESIS

PLATE_EFFECTS = ["plate.boundary", "plate.damping", "plate.sensor_mass", "plate.stiffness"]
OUTLINE = ((0.0, 0.1), (0.62, 0.0), (1.0, 0.38), (0.3, 0.6))
SPOTS = {"a": (0.22, 0.2), "b": (0.73, 0.37)}
BUILD = PlateBuild(
    OUTLINE, 0.01, THESIS["aluminum"], named_points({"#1": (0.47, 0.28)}), named_points(SPOTS)
)


@pytest.fixture(scope="module")
def plate():
    return solve_plate(BUILD, 5000.0)


def of_plate(identity, **parameters) -> PlateEffect:
    found = effect(identity, **parameters)
    assert isinstance(found, PlateEffect)
    return found


def off(identity) -> Any:
    kind = catalogue()[identity]
    return kind(**{item.name: item.off for item in kind.parameters()})


@pytest.mark.parametrize("identity", PLATE_EFFECTS)
def test_off_leaves_the_plate_as_it_is_and_the_default_does_not(identity, plate):
    assert off(identity).apply(plate) is plate
    changed = of_plate(identity).apply(plate)
    assert np.any(changed.frequency_hz != plate.frequency_hz) or np.any(
        changed.damping_ratio != plate.damping_ratio
    )


def test_the_catalogue_has_the_effects_of_the_plate_and_others_are_refused(plate):
    assert [
        name for name, kind in catalogue().items() if issubclass(kind, PlateEffect)
    ] == PLATE_EFFECTS
    other = next(kind for name, kind in catalogue().items() if not name.startswith("plate."))
    with pytest.raises(TypeError, match="does not act here"):
        with_effects(plate, [other()])
    with pytest.raises(ValueError, match="given twice"):
        with_effects(plate, [effect("plate.damping"), effect("plate.damping")])


BY_PART = {"plate.damping": "modes", "plate.sensor_mass": "sensors"}


@pytest.mark.parametrize("identity", PLATE_EFFECTS)
def test_values_by_part_are_as_many_as_the_parts(identity, plate):
    """The same value for each part is the value for all; another number of values is refused with
    both numbers, and so is an array where there are no parts: a plate is no batch."""
    name = catalogue()[identity].parameters()[0].name
    if identity not in BY_PART:
        with pytest.raises(ValueError, match=f"{identity}: {name} is an array"):
            effect(identity, **{name: np.array([1.0, 1.0])})
        return
    count = {"modes": plate.frequency_hz.size, "sensors": len(plate.shapes)}[BY_PART[identity]]
    common = of_plate(identity, **{name: 0.5}).apply(plate)
    by_part = of_plate(identity, **{name: np.full(count, 0.5)}).apply(plate)
    np.testing.assert_array_equal(by_part.damping_ratio, common.damping_ratio)
    np.testing.assert_array_equal(by_part.frequency_hz, common.frequency_hz)
    wrong = of_plate(identity, **{name: np.full(count + 1, 0.5)})
    with pytest.raises(ValueError, match=f"{count + 1} values.*the {count} {BY_PART[identity]}"):
        wrong.apply(plate)


def test_damping_is_scaled_then_added_and_supports_lift_the_low_modes_most(plate):
    supported = of_plate("plate.damping", factor=2.0, added_ratio=0.003).apply(plate)
    np.testing.assert_allclose(supported.damping_ratio, 0.013)
    most = of_plate("plate.damping", factor=20.0, added_ratio=0.5)
    np.testing.assert_allclose(most.apply(supported).damping_ratio, 20 * 0.013 + 0.5)
    assert most.apply(most.apply(supported)).damping_ratio.max() < 1
    supported = of_plate("plate.boundary", support_frequency_hz=20.0).apply(plate)
    rise = supported.frequency_hz - plate.frequency_hz
    np.testing.assert_allclose(rise[:3], 20.0)
    assert np.all(np.diff(rise) <= 1e-9)


@pytest.mark.slow
def test_stiffness_of_a_thicker_plate_of_the_same_mass():
    # D grows with the cube of the thickness; the density falls so that the mass stays.
    light = replace(BUILD.material, density_kg_m3=BUILD.material.density_kg_m3 / 1.04)
    one, other = (
        solve_plate(given, 1000.0, thickness_correction=False)
        for given in (BUILD, replace(BUILD, thickness_m=0.0104, material=light))
    )
    found = (
        of_plate("plate.stiffness", frequency_factor=1.04**1.5)
        .apply(one)
        .frequency_hz[: other.frequency_hz.size]
    )
    np.testing.assert_allclose(found, other.frequency_hz, rtol=1e-6)


def test_sensor_mass_agrees_with_masses_in_the_elements():
    masses = tuple(PointMass(spot, 0.027) for spot in SPOTS.values())
    plate, loaded = (
        solve_plate(given, 5000.0, thickness_correction=False)
        for given in (BUILD, replace(BUILD, masses=masses))
    )
    elastic = slice(3, 25)
    found = of_plate("plate.sensor_mass", mass_kg=0.027).apply(plate)
    shift = loaded.frequency_hz[elastic] - plate.frequency_hz[elastic]
    error = found.frequency_hz[elastic] - loaded.frequency_hz[elastic]
    assert np.all(shift < 0)
    # Modes beyond 5 kHz are missing: the shift comes out too small, never too large.
    assert np.all(error > -1e-6)
    assert np.max(error) < 0.05 * np.max(-shift)
    np.testing.assert_allclose(
        np.abs(found.shapes[:, elastic]),
        np.abs(loaded.shapes[:, elastic]),
        atol=0.02 * np.abs(loaded.shapes).max(),
    )


def test_sensor_mass_lowers_every_mode_and_a_small_one_by_rayleighs_quotient(plate):
    found = of_plate("plate.sensor_mass", mass_kg=0.1).apply(plate)
    assert np.all(found.frequency_hz <= plate.frequency_hz * (1 + 1e-12))
    assert np.all(found.frequency_hz[:3] == 0)
    # A constant ratio stays about the same: it is the plate's material that loses, not the sensor.
    np.testing.assert_allclose(found.damping_ratio, 0.005, rtol=0.1)
    mass = 1e-5
    found = of_plate("plate.sensor_mass", mass_kg=mass).apply(plate)
    expected = 1 - mass * np.sum(plate.shapes[:, 3:] ** 2, axis=0) / 2
    np.testing.assert_allclose(found.frequency_hz[3:] / plate.frequency_hz[3:], expected, atol=1e-7)


@pytest.mark.parametrize("frequency_hz", [0.02, 300.0])
def test_one_mode_under_one_sensor_is_a_heavier_oscillator(frequency_hz):
    # q'' + 2 zeta omega q' + omega^2 q with 1 + m phi^2 before q''.
    shape = np.array([[3.0]])
    bare = ModalPlate(
        np.array([frequency_hz]), np.array([0.04]), np.ones((1, 1)), shape, ("#1",), ("a",)
    )
    root = (1 + 0.5 * 3.0**2) ** 0.5
    found = of_plate("plate.sensor_mass", mass_kg=0.5).apply(bare)
    assert found.frequency_hz[0] == pytest.approx(frequency_hz / root, rel=1e-12)
    assert found.damping_ratio[0] == pytest.approx(0.04 / root, rel=1e-12)
    assert abs(found.shapes[0, 0]) == pytest.approx(3.0 / root, rel=1e-12)
    assert abs(found.shape_impact[0, 0]) == pytest.approx(1 / root, rel=1e-12)


@pytest.mark.slow
def test_supports_agree_with_many_springs():
    # Springs over the whole plate are an elastic foundation: as many as there are weights in a rule
    # of quadrature.
    from pyroshock.twin.plate.fem import elements_of

    elements = elements_of(BUILD, 0.3)
    basis, unit = elements.basis, elements.frame.unit_m
    spots = basis.mapping.F(basis.X).reshape(2, -1).T * unit + elements.frame.origin_m
    stiffness = (2 * np.pi * 30.0) ** 2 * BUILD.mass_per_area_kg_m2 * basis.dx.ravel() * unit**2
    springs = tuple(
        PointSpring((x, y), k) for (x, y), k in zip(spots.tolist(), stiffness.tolist(), strict=True)
    )
    free = solve_plate(BUILD, 300.0, thickness_correction=False)
    held = solve_plate(replace(BUILD, springs=springs), 300.0, thickness_correction=False)
    found = (
        of_plate("plate.boundary", support_frequency_hz=30.0)
        .apply(free)
        .frequency_hz[: held.frequency_hz.size]
    )
    np.testing.assert_allclose(found, held.frequency_hz, rtol=1e-5)
