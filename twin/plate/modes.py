"""The modes of a plate from its outline."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...array_types import Floats
from .build import PlateBuild
from .fem import Elements, elements_of
from .mesh import stretch
from .modal import ModalPlate
from .thickness import edge_layer_m, flexural_wavelength_m, kirchhoff_hz, mindlin_hz

#: Triangles in a wavelength of the highest frequency, at least: the highest ones come out some 0.1 % too high.
ELEMENTS_PER_WAVELENGTH = 0.9
#: Triangles across a plate whose highest mode is a low one.
_LEAST_ACROSS = 4
_RIGID = 3
_SEED = 5


def solve_plate(
    build: PlateBuild,
    max_frequency_hz: float,
    *,
    thickness_correction: bool = True,
    elements_per_wavelength: float = ELEMENTS_PER_WAVELENGTH,
) -> ModalPlate:
    """All modes from 0 Hz up to a frequency, of Kirchhoff's plate by Argyris' triangles.

    With the correction frequencies are those of Mindlin's plate of the same wavenumber (`mindlin_hz`), and free edges
    twist as his do (`edge_layer_m`). Rigid modes of what nothing holds are at exactly 0 Hz. Motion in the plane of the
    plate has no part. Raises `ValueError` for a frequency that is not positive and for points off the plate.
    """
    if not (math.isfinite(max_frequency_hz) and max_frequency_hz > 0):
        raise ValueError(f"max_frequency_hz = {max_frequency_hz!r}: expected a positive number")
    highest = kirchhoff_hz(build, max_frequency_hz) if thickness_correction else max_frequency_hz
    wavelength = flexural_wavelength_m(build, highest)
    length = min(wavelength / elements_per_wavelength, math.sqrt(build.area_m2) / _LEAST_ACROSS)
    elements = elements_of(build, length, edge_layer_m(build) if thickness_correction else 0.0)
    frequency, vectors = _modes_below(elements, build, highest)
    frequency[: _rigid_modes(build)] = 0.0
    if thickness_correction:
        frequency = mindlin_hz(build, frequency)
    return ModalPlate(
        frequency_hz=frequency,
        damping_ratio=build.damping.ratios(frequency),
        shape_impact=elements.rows([place.position_m for place in build.impact_points]) @ vectors,
        shapes=elements.rows([place.position_m for place in build.sensors]) @ vectors,
        impact_points=tuple(place.name for place in build.impact_points),
        sensors=tuple(place.name for place in build.sensors),
    )


def _modes_below(elements: Elements, build: PlateBuild, highest_hz: float) -> tuple[Floats, Floats]:
    """Frequencies (m,) and mass-normalised vectors (u, m), in rising order."""
    stiffness = (elements.free.T @ elements.stiffness @ elements.free).tocsc()
    mass = (elements.free.T @ elements.mass @ elements.free).tocsc()
    count = min(_expected(build, highest_hz), stiffness.shape[0])
    while True:
        squares, vectors = _lowest(stiffness, mass, count, build)
        frequency = np.sqrt(np.maximum(squares, 0)) / (2 * math.pi)
        if frequency[-1] > highest_hz or count == stiffness.shape[0]:
            kept = frequency <= highest_hz
            return frequency[kept], np.asarray(elements.free @ vectors[:, kept])
        count = min(math.ceil(1.2 * count) + 10, stiffness.shape[0])


def _lowest(stiffness: Any, mass: Any, count: int, build: PlateBuild) -> tuple[Floats, Floats]:
    """The lowest squares of omega and their vectors; the shift is below 0, where a free plate is not singular."""
    from scipy.linalg import eigh
    from scipy.sparse.linalg import eigsh

    if 3 * count > stiffness.shape[0]:
        squares, vectors = eigh(stiffness.toarray(), mass.toarray())
        return squares[:count], vectors[:, :count]
    shift = -build.rigidity_n_m / build.mass_per_area_kg_m2 / build.area_m2**2
    start = np.random.default_rng(_SEED).standard_normal(stiffness.shape[0])
    squares, vectors = eigsh(stiffness, k=count, M=mass, sigma=shift, v0=start)
    order = np.argsort(squares)
    return squares[order], vectors[:, order]


def _expected(build: PlateBuild, highest_hz: float) -> int:
    """Weyl's count with the edge term of free edges (Bogomolny and Hugues, Phys. Rev. E 57, 1998) and a few."""
    k = 2 * math.pi / flexural_wavelength_m(build, highest_hz)
    corners = np.array(build.outline_m, dtype=np.float64)
    around = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum())
    return math.ceil((build.area_m2 * k**2 + 1.8 * around * k) / (4 * math.pi)) + 8


def _rigid_modes(build: PlateBuild) -> int:
    """How many ways of moving as a whole (up, and two tilts) nothing holds."""
    rows = [(1.0, *spring.position_m) for spring in build.springs if spring.stiffness_n_m > 0]
    for edge in build.edges:
        begin, end = stretch(build, edge)
        rows += [(1.0, *begin), (1.0, *end)]
        rows += [(0.0, *(end - begin)[::-1] * (-1, 1))] if edge.holds_slope else []
    return _RIGID - (int(np.linalg.matrix_rank(np.array(rows))) if rows else 0)
