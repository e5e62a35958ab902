"""Frequencies against closed forms and published values, and how fast they converge."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import (
    OUTLINE_M,
    BenchPlate,
    Clamp,
    PlateMaterial,
    resonant_plate,
)
from pyroshock.virtualbench.plate.mesh import Mesh
from pyroshock.virtualbench.plate.modes import assemble, flexural_wavenumber, lowest_modes, modes

STEEL = PlateMaterial(200e9, 0.30, 7800.0)
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
THIN_M = 1e-3
#: Leissa, The free vibration of rectangular plates, J. Sound Vib. 31 (1973): omega a^2 sqrt(rho h /
#: D), nu = 0.3, by Ritz's method, so that the truth lies a little below.
LEISSA_FREE = [13.489, 19.789, 24.432, 35.024, 35.024]
LEISSA_CANTILEVER = [3.4917, 8.5246, 21.429, 27.331, 31.111]
LEISSA_CLAMPED = [35.992, 73.413, 73.413, 108.27, 131.64]
#: The same free plate by Argyris elements, converged.
ARGYRIS_FREE = [13.468, 19.596, 24.270, 34.801, 34.801]
#: The bench's outline, free, thin, nu = 0.3: omega sqrt(rho h / D) in 1/m^2 by 162 Argyris
#: triangles of scikit-fem
#: 12.0.2, which know neither shear nor rotary inertia.
ARGYRIS_BENCH = [
    31.4554,
    52.5370,
    74.2571,
    86.0827,
    115.5963,
    136.5988,
    159.5517,
    196.9055,
    216.8646,
    226.7019,
]


def _plate(
    thickness_m: float, clamps: tuple[Clamp, ...] = (), outline: tuple = SQUARE
) -> BenchPlate:
    return BenchPlate(STEEL, thickness_m, outline, ((0.5, 0.5),), (), (0.005,) * 200, clamps)


def _parameters(plate: BenchPlate, limit: float) -> np.ndarray:
    """omega sqrt(rho h / D), in 1/m^2, of the modes up to that parameter."""
    unit = math.sqrt(plate.rigidity_n_m / (plate.material.density_kg_m3 * plate.thickness_m)) / (
        2 * math.pi
    )
    return modes(plate, Effects.none(), max_frequency_hz=limit * unit).frequencies_hz / unit


def test_square_free_clamped_and_clamped_along_one_edge() -> None:
    free = _parameters(_plate(THIN_M), 70)
    assert free[:3].tolist() == [0.0, 0.0, 0.0]
    assert free[3:8] == pytest.approx(ARGYRIS_FREE, rel=2e-4)
    assert np.all(free[3:8] < LEISSA_FREE)
    assert free[3:8] == pytest.approx(LEISSA_FREE, rel=0.011)
    clamped = _parameters(_plate(THIN_M, tuple(Clamp(edge) for edge in range(4))), 140)
    assert clamped[:5] == pytest.approx(LEISSA_CLAMPED, rel=1e-3)
    cantilever = _parameters(_plate(THIN_M, (Clamp(3),)), 35)
    assert np.all(cantilever[:5] < LEISSA_CANTILEVER)
    assert cantilever[:5] == pytest.approx(LEISSA_CANTILEVER, rel=0.011)
    lowest = [
        _parameters(_plate(THIN_M, (Clamp(3, 0.5 - half, 0.5 + half),)), 30)[0]
        for half in (0.5, 0.3, 0.15)
    ]
    assert all(shorter < longer for longer, shorter in pairwise(lowest))


def test_bench_plate_against_another_element_and_however_it_lies() -> None:
    plate = BenchPlate(STEEL, THIN_M, OUTLINE_M, (), (), (0.005,) * 200)
    assert _parameters(plate, 260)[3:13] == pytest.approx(ARGYRIS_BENCH, rel=2e-4)
    turn = np.array([[math.cos(0.7), math.sin(0.7)], [-math.sin(0.7), math.cos(0.7)]])
    turned = tuple((x, y) for x, y in (np.array(OUTLINE_M) @ turn + [0.3, 0.4]).tolist())
    lying, rolled = (_plate(0.01, outline=o) for o in (OUTLINE_M, turned[1:] + turned[:1]))
    points = [
        BenchPlate(STEEL, 0.01, p.outline_m, (), (), p.damping_ratios) for p in (lying, rolled)
    ]
    first, second = (modes(p, Effects.none(), max_frequency_hz=1000).frequencies_hz for p in points)
    assert first[3:] == pytest.approx(second[3:], rel=1e-3)


def _simply_supported(thickness_m: float, elements: int, degree: int, count: int) -> np.ndarray:
    """Edges held in deflection and in the rotation along them: Navier's conditions."""
    mesh = Mesh.regular(SQUARE, elements, elements, degree)
    stiffness, mass = assemble(mesh, STEEL, thickness_m)
    held = [3 * mesh.edge_nodes(Clamp(edge)) for edge in range(4)]
    along = [held[edge] + (1 if edge % 2 == 0 else 2) for edge in range(4)]
    free = np.setdiff1d(np.arange(mesh.size), np.concatenate([*held, *along]))
    scale = 5e3 * thickness_m
    return lowest_modes(stiffness[free][:, free], mass[free][:, free], count, shift_hz=scale)[0]


def _navier(thickness_m: float, m: int, n: int) -> float:
    """Mindlin's plate, m by n half waves: the lower frequency (Hz) of deflection and rotation
    coupled."""
    k = math.pi * math.hypot(m, n)
    shear = 5 / 6 * STEEL.shear_modulus_pa * thickness_m
    rigidity = STEEL.young_modulus_pa * thickness_m**3 / (12 * (1 - 0.3**2))
    stiffness = np.array([[shear * k**2, shear * k], [shear * k, rigidity * k**2 + shear]])
    mass = STEEL.density_kg_m3 * np.array([thickness_m, thickness_m**3 / 12])
    return math.sqrt(np.linalg.eigvals(stiffness / mass[:, None]).min()) / (2 * math.pi)


@pytest.mark.parametrize("thickness_m", [0.001, 0.01, 0.1])
def test_simply_supported_square_is_navier_s(thickness_m: float) -> None:
    """And Kirchhoff's where it is thin; the wavenumber of a mode is that of its half waves."""
    expected = sorted(_navier(thickness_m, m, n) for m in range(1, 5) for n in range(1, 5))[:6]
    frequencies = _simply_supported(thickness_m, 3, 8, 6)
    assert frequencies == pytest.approx(expected, rel=2e-5)
    if thickness_m == THIN_M:
        rigidity = STEEL.young_modulus_pa * thickness_m**3 / (12 * (1 - 0.3**2))
        unit = math.pi / 2 * math.sqrt(rigidity / (STEEL.density_kg_m3 * thickness_m))
        assert frequencies[:4] == pytest.approx([2 * unit, 5 * unit, 5 * unit, 8 * unit], rel=2e-5)
    wavenumber = flexural_wavenumber(_plate(0.1), _navier(0.1, 2, 3))
    assert wavenumber == pytest.approx(math.pi * math.hypot(2, 3), rel=1e-12)


@pytest.mark.parametrize(("degree", "elements"), [(2, (4, 8, 16)), (3, (3, 6, 12)), (4, (2, 4, 8))])
def test_frequencies_converge_from_above_with_twice_the_degree(
    degree: int, elements: tuple[int, ...]
) -> None:
    exact = _navier(0.1, 1, 2)
    errors = [_simply_supported(0.1, n, degree, 3)[1] / exact - 1 for n in elements]
    assert min(errors) > 0
    orders = [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]
    assert orders[-1] == pytest.approx(2 * degree, abs=0.35)


def test_the_mesh_is_fine_enough_at_its_limit() -> None:
    plate = BenchPlate(STEEL, 0.01, _plate(0.01).outline_m, (), (), (0.005,) * 400)
    coarse = modes(plate, Effects.none(), max_frequency_hz=1000).frequencies_hz
    fine = modes(plate, Effects.none(), max_frequency_hz=2000).frequencies_hz[: coarse.size]
    assert coarse.size > 8
    assert coarse[3:] == pytest.approx(fine[3:], rel=3e-3)
    assert np.all(coarse[3:] > fine[3:] * (1 - 1e-6))


@pytest.mark.slow
def test_the_bench_s_plate_up_to_20_khz() -> None:
    plate = resonant_plate("steel", "free", np.random.default_rng(1))
    coarse = modes(plate, Effects.none()).frequencies_hz
    fine = modes(plate, Effects.none(), max_frequency_hz=25e3).frequencies_hz[: coarse.size]
    assert coarse.size == 294
    assert coarse[3:] == pytest.approx(fine[3:], rel=1e-3)
