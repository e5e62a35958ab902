"""The modes of a plate from its outline.

Thick plates: Mindlin's dispersion in the place of Kirchhoff's.

Glossary: k wavenumber, D rigidity, m mass and J rotary inertia per area, S shear stiffness kappa^2
G h.

Solved plates on disk: a solution takes seconds, a look at it milliseconds.
"""

from __future__ import annotations

import hashlib
import math
import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ...array_types import Floats
from .build import PlateBuild
from .fem import Elements, elements_of
from .mesh import stretch
from .modal import ModalPlate

#: kappa^2 of Mindlin, J. Appl. Mech. 18 (1951) 31: the first thickness-shear mode comes out exact.
_SHEAR_COEFFICIENT = math.pi**2 / 12


def mindlin_hz(build: PlateBuild, kirchhoff_hz: Floats) -> Floats:
    """Frequencies (m,) of Mindlin's plate at the wavenumbers of Kirchhoff's plate.

    Of Mindlin's two branches the flexural one. Exact for simply supported polygons, where both
    plates have the shapes of a membrane. An approximation where edges are free or clamped: the near
    field there is sheared otherwise than the waves are.

    Parameters:
        build: Thickness and material of the plate.
        kirchhoff_hz: Frequencies of Kirchhoff's plate (m,).

    Source:
        Conway, Can. Aeronaut. J. 6, 1960, 263; Wang, J. Vib. Acoust. 116, 1994, 536.
    """
    m, rotary, shear = _inertia_and_shear(build)
    squares = (2 * np.pi * kirchhoff_hz) ** 2
    k2 = np.sqrt(m / build.rigidity_n_m * squares)
    # (J/S) x^2 - b x + omega_K^2 = 0 for x = omega^2; its smaller root, written so that nothing
    # cancels.
    b = 1 + (build.rigidity_n_m / shear + rotary / m) * k2
    return np.sqrt(2 * squares / (b + np.sqrt(b**2 - 4 * rotary / shear * squares))) / (2 * np.pi)


def kirchhoff_hz(build: PlateBuild, mindlin_hz: float) -> float:
    """The inverse of `mindlin_hz`.

    Parameters:
        build: Thickness and material of the plate.
        mindlin_hz: A frequency of Mindlin's plate.
    """
    m, rotary, shear = _inertia_and_shear(build)
    d, x = build.rigidity_n_m, (2 * math.pi * mindlin_hz) ** 2
    half = x * (d * m + rotary * shear) / 2
    k2 = (half + math.sqrt(half**2 - d * shear * m * x * (rotary * x - shear))) / (d * shear)
    return float(k2 * math.sqrt(d / m) / (2 * math.pi))


def flexural_wavelength_m(build: PlateBuild, kirchhoff_hz: float) -> float:
    """The length of a flexural wave of Kirchhoff's plate.

    Parameters:
        build: Thickness and material of the plate.
        kirchhoff_hz: A frequency of that plate.
    """
    k4 = build.mass_per_area_kg_m2 / build.rigidity_n_m * (2 * math.pi * kirchhoff_hz) ** 2
    return float(2 * math.pi / k4**0.25)


def edge_layer_m(build: PlateBuild) -> float:
    """How deep the layer along a free edge is that does not resist twisting: h / sqrt(12 kappa^2) =
    h / pi.

    Kirchhoff's plate lets twisting moments end at a free edge in a jump of shear; Mindlin's lets
    them fade over h / pi. To first order in h the twisting energy of that layer is missing: a strip
    of width b twists with a stiffness of G h^3 b / 3 (1 - 2 h / (pi b)), where Saint-Venant has
    0.630 for 2 / pi.

    Parameters:
        build: The plate, of which the thickness counts.

    Source:
        Timoshenko and Goodier, Theory of Elasticity, on torsion of a rectangular bar.
    """
    return build.thickness_m / math.sqrt(12 * _SHEAR_COEFFICIENT)


def _inertia_and_shear(build: PlateBuild) -> tuple[float, float, float]:
    """m, J and S."""
    material, h = build.material, build.thickness_m
    modulus = material.youngs_modulus_pa / (2 * (1 + material.poisson_ratio))
    return (
        build.mass_per_area_kg_m2,
        material.density_kg_m3 * h**3 / 12,
        _SHEAR_COEFFICIENT * modulus * h,
    )


#: Triangles in a wavelength of the highest frequency, at least: the highest ones come out some 0.1
#: % too high.
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

    Rigid modes of what nothing holds are at exactly 0 Hz. Motion in the plane of the plate has no
    part.

    Parameters:
        build: The plate.
        max_frequency_hz: The highest frequency of a mode.
        thickness_correction: Whether frequencies are those of Mindlin's plate of the same
            wavenumber (`mindlin_hz`), and free edges twist as his do (`edge_layer_m`); by default
            they are.
        elements_per_wavelength: Least number of triangles in a wavelength of the highest frequency;
            0.9 by default.

    Raises:
        ValueError: For a frequency that is not positive and for points off the plate.
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
    """The lowest squares of omega and their vectors; the shift is below 0, where a free plate is
    not singular."""
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
    """Weyl's count with the edge term of free edges (Bogomolny and Hugues, Phys. Rev. E 57, 1998)
    and a few."""
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


#: Grows with every change of the solution, so that what an older one has left is not taken for
#: ours.
_VERSION = 1
_ARRAYS = ("frequency_hz", "damping_ratio", "shape_impact", "shapes")


def cached_plate(
    build: PlateBuild, max_frequency_hz: float, folder: Path, *, thickness_correction: bool = True
) -> ModalPlate:
    """As `solve_plate`, from a file where it has been solved before; a file that cannot be read is
    solved anew.

    Parameters:
        build: The plate.
        max_frequency_hz: The highest frequency of a mode.
        folder: Where solved plates are kept; it is made where it is missing.
        thickness_correction: Whether frequencies are those of Mindlin's plate; by default they are.

    Raises:
        ValueError: As `solve_plate`.
    """
    path = folder / f"{_key(build, max_frequency_hz, thickness_correction)}.npz"
    try:
        return _load(path)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        plate = solve_plate(build, max_frequency_hz, thickness_correction=thickness_correction)
    _save(plate, path)
    return plate


def _key(build: PlateBuild, max_frequency_hz: float, thickness_correction: bool) -> str:
    """A record's `repr` has all of its numbers, to the last digit."""
    text = repr((_VERSION, build, float(max_frequency_hz), thickness_correction))
    return hashlib.sha256(text.encode()).hexdigest()


def _load(path: Path) -> ModalPlate:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return ModalPlate(
            **{name: stored[name] for name in _ARRAYS},
            impact_points=tuple(stored["impact_points"].tolist()),
            sensors=tuple(stored["sensors"].tolist()),
        )


def _save(plate: ModalPlate, path: Path) -> None:
    """Whole or not at all: another process may read at any time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(
                file,
                allow_pickle=False,
                **{name: np.asarray(value) for name, value in vars(plate).items()},
            )
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
