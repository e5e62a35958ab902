"""The modes of a plate as it hangs on the bench, with the effects that act on it.

Strength 1 of `plate.damping` raises the damping ratio of a mode at 2 kHz by 10 %, of others with
the power 0.3 of their frequency: the loss of an attachment that is described by a fractional
derivative (Bagley and Torvik, J. Rheol. 27 (1983) 201). Strength 1 of `plate.stiffness` is a
modulus that is 2 % too high in the mean and grows evenly along the plate: frequencies are 1 %
higher, of a mode that bends more at one end by more, and of its opposite by less (Rayleigh, Theory
of Sound I, section 88). Of `plate.sensor_mass` and `plate.boundary` it is the sensors and supports
as they were built.

The lowest modes of a sparse pair of stiffness and mass, by Lanczos's method on the inverse about a
shift below zero.

The modal table that a laboratory would hand over with its plate: `plate_modes.csv` of a campaign
folder.

Stiffness and mass of a whole plate, and what points add to them.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effects
from .build import BenchPlate, PlateMaterial, Point
from .mesh import (
    SHEAR_CORRECTION,
    UNKNOWNS,
    Mesh,
    basis,
    bilinear,
    mass_matrices,
    stiffness_matrices,
)

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

    Matrix = csc_array[np.float64]


def assemble(
    mesh: Mesh, material: PlateMaterial, thickness_m: float, stiffer: float = 0.0
) -> tuple[Matrix, Matrix]:
    """Stiffness (N/m, N, N m) and mass of the bare plate without supports; both `(size, size)`,
    symmetric.

    Parameters:
        mesh: The elements of the plate.
        material: What the plate is made of.
        thickness_m: The thickness of the plate, everywhere the same.
        stiffer: By what share the modulus is higher than the material's in the mean over the plate;
            0 by default. The excess grows evenly along x; at the end that is farther from the
            centroid it is 0 or twice the mean.
    """
    values, gradients, weights, x = _quadrature(mesh)
    centre = float(np.sum(weights * x) / np.sum(weights))
    ends = mesh.corners_m[:, 0] - centre
    uneven = 1 + stiffer * (1 + (x - centre) / np.abs(ends).max())
    stiffness = stiffness_matrices(values, gradients, weights * uneven, material, thickness_m)
    mass = mass_matrices(values, weights, material.density_kg_m3, thickness_m)
    return _gathered(mesh, stiffness), _gathered(mesh, mass)


def deflection_rows(mesh: Mesh, points_m: Sequence[Point]) -> Matrix:
    """The matrix `(points, size)` that takes the deflection at some points.

    Parameters:
        mesh: The elements of the plate, with `size` unknowns.
        points_m: The points (x, y).

    Raises:
        ValueError: For a point off the plate.
    """
    from scipy.sparse import csc_array

    if not points_m:
        return csc_array((0, mesh.size))
    unknowns, weights = zip(*map(mesh.deflection_at, points_m), strict=True)
    rows = np.repeat(np.arange(len(points_m)), (mesh.degree + 1) ** 2)
    entries = (np.concatenate(weights), (rows, np.concatenate(unknowns)))
    return csc_array(entries, shape=(len(points_m), mesh.size))


def at_points(rows: Matrix, amounts: Floats) -> Matrix:
    """Point springs or masses as a matrix `(size, size)` to add to stiffness or mass.

    Parameters:
        rows: What takes the deflection at the points, of shape `(points, size)`.
        amounts: Stiffness of the springs in N/m, or masses in kg, of shape `(points,)`.
    """
    from scipy.sparse import csc_array, diags_array

    return csc_array(rows.T @ diags_array(amounts) @ rows)


def clamped_unknowns(nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Every unknown of some nodes.

    Parameters:
        nodes: Numbers of the nodes, of shape `(nodes,)`.
    """
    return np.unique(UNKNOWNS * nodes[:, None] + np.arange(UNKNOWNS))


def _quadrature(mesh: Mesh) -> tuple[Floats, Floats, Floats, Floats]:
    """By Gauss's rule: shape functions (q, n), gradients (elements, q, 2, n), weights in m^2 and x
    (elements, q)."""
    points, weights = legendre.leggauss(mesh.degree + 1)
    values, slopes = basis(mesh.degree, points)
    along_u, along_v = _products(slopes, values), _products(values, slopes)
    u, du = _spread(mesh.u, points)
    v, dv = _spread(mesh.v, points)
    elements = (u.shape[0], v.shape[0], points.size, points.size)
    grid_u = np.broadcast_to(u[:, None, :, None], elements).reshape(-1)
    grid_v = np.broadcast_to(v[None, :, None, :], elements).reshape(-1)
    position, jacobian = bilinear(mesh.corners_m, grid_u, grid_v)
    jacobian = jacobian.reshape(elements[0], elements[1], -1, 2, 2) / 2
    jacobian = (
        jacobian
        * np.stack(np.broadcast_arrays(du[:, None], dv[None, :]), axis=-1)[:, :, None, :, None]
    )
    jacobian = jacobian.reshape(-1, points.size**2, 2, 2)
    gradients = np.linalg.inv(jacobian) @ np.stack([along_u, along_v], axis=1)
    areas = np.linalg.det(jacobian) * np.outer(weights, weights).ravel()
    return _products(values, values), gradients, areas, position[:, 0].reshape(areas.shape)


def _products(first: Floats, second: Floats) -> Floats:
    points, nodes = first.shape
    return np.asarray(np.einsum("qa,rb->qrab", first, second).reshape(points**2, nodes**2))


def _spread(lines: Floats, points: Floats) -> tuple[Floats, Floats]:
    width = np.diff(lines)
    return lines[:-1, None] + width[:, None] * (points + 1) / 2, width


def _gathered(mesh: Mesh, parts: Floats) -> Matrix:
    from scipy.sparse import csc_array

    unknowns = mesh.element_unknowns()
    rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
    return csc_array((parts.ravel(), (rows.ravel(), columns.ravel())), shape=(mesh.size, mesh.size))


#: By how much more modes are asked for when the last guess fell short of the limit.
_MORE = 1.25
#: With fewer unknowns for each mode the whole matrices are solved at once.
_LEAST_SIZE = 6
_BLOCK = 8
#: Vectors that Lanczos's method needs for each mode, and from how many on it looks at what has
#: converged.
_LANCZOS_VECTORS, _FIRST_LOOK = 2.8, 2.2
#: Residual of an eigenvector over its eigenvalue.
_CONVERGED = 1e-13


def lowest_modes(
    stiffness: Matrix, mass: Matrix, count: int, *, shift_hz: float
) -> tuple[Floats, Floats]:
    """Frequencies `(count,)` in Hz, rising, and mass-normalised shapes `(size, count)`.

    Parameters:
        stiffness: The stiffness, of shape `(size, size)`, symmetric.
        mass: The mass, of shape `(size, size)`, symmetric.
        count: The number of modes.
        shift_hz: A frequency of the order of the lowest elastic mode. By rounding, a mode without
            stiffness comes out within some 1e-3 of it, or at 0.
    """
    from scipy.linalg import eigh
    from scipy.sparse.linalg import splu

    size = stiffness.shape[0]
    if size < _LEAST_SIZE * count:
        squares, shapes = eigh(stiffness.toarray(), mass.toarray(), subset_by_index=[0, count - 1])
    else:
        shift = (2 * np.pi * shift_hz) ** 2
        # Positive definite: no pivoting, and an ordering that keeps the symmetry, solve some times
        # faster.
        factors = splu(
            (stiffness + shift * mass).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        inverses, shapes = _largest_pairs(factors.solve, mass.tocsr(), count)
        squares = 1 / inverses - shift
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi), shapes


def _largest_pairs(
    solve: Callable[[Floats], Floats], mass: csr_array[np.float64], count: int
) -> tuple[Floats, Floats]:
    """The `count` largest eigenvalues, falling, of what `solve` does to the mass times a vector,
    and its vectors (size, count), by Lanczos's method in blocks (Golub and Underwood, 1977): the
    vectors of a block share what is read of factors and earlier blocks."""
    from scipy.linalg import eigh

    # A fixed start keeps the modes the same from call to call, and from process to process.
    start = np.random.default_rng(0).standard_normal((mass.shape[0], _BLOCK))
    block, weighted, _ = _orthonormal(start, mass)
    space = np.empty((mass.shape[0], int(_LANCZOS_VECTORS * count) + 4 * _BLOCK), order="F")
    projected = np.zeros((space.shape[1], space.shape[1]))
    coupling, former_block = np.zeros((_BLOCK, _BLOCK)), np.zeros_like(block)
    used, look = 0, int(_FIRST_LOOK * count)
    while True:
        if used + _BLOCK > space.shape[1]:
            space = np.concatenate([space, np.empty_like(space)], axis=1)
            projected = np.pad(projected, (0, projected.shape[0]))
        block_columns = slice(used, used + _BLOCK)
        space[:, block_columns] = block
        used += _BLOCK
        following = solve(weighted) - former_block @ coupling.T
        projected[block_columns, block_columns] = weighted.T @ following
        following -= block @ projected[block_columns, block_columns]
        # Rounding brings back what is in the space already, the stiffest modes first.
        within = space[:, :used].T @ np.asarray(mass @ following)
        following -= space[:, :used] @ within
        former_block = block
        block, weighted, coupling = _orthonormal(following, mass)
        if used >= look:
            values, vectors = eigh(
                projected[:used, :used], subset_by_index=[used - count, used - 1]
            )
            residuals = np.linalg.norm(coupling @ vectors[-_BLOCK:], axis=0)
            if np.all(residuals < _CONVERGED * values):
                return values[::-1], space[:, :used] @ vectors[:, ::-1]
            look = used + 4 * _BLOCK
        if used + _BLOCK <= projected.shape[0]:
            projected[used : used + _BLOCK, block_columns] = coupling


def _orthonormal(block: Floats, mass: csr_array[np.float64]) -> tuple[Floats, Floats, Floats]:
    """An orthonormal base, in the mass's product, of a block (size, b); the mass times it; and the
    block in that base (b, b). By Cholesky's factor, twice, since once leaves rounding."""
    from scipy.linalg import solve_triangular

    within = np.eye(block.shape[1])
    for _ in range(2):
        factor = np.linalg.cholesky(block.T @ np.asarray(mass @ block))
        block = solve_triangular(factor, block.T, lower=True).T
        within = factor.T @ within
    return block, np.asarray(mass @ block), within


def modes_below(
    stiffness: Matrix, mass: Matrix, limit_hz: float, *, expected: int, shift_hz: float
) -> tuple[Floats, Floats]:
    """Frequencies `(modes,)` in Hz, rising, and mass-normalised shapes `(size, modes)` up to a
    frequency.

    Parameters:
        stiffness: The stiffness, of shape `(size, size)`, symmetric.
        mass: The mass, of shape `(size, size)`, symmetric.
        limit_hz: The highest frequency.
        expected: About how many modes are thought to be there.
        shift_hz: A frequency of the order of the lowest elastic mode, as `lowest_modes` takes it.
    """
    count = min(expected, stiffness.shape[0] // 2)
    frequencies, shapes = lowest_modes(stiffness, mass, count, shift_hz=shift_hz)
    while frequencies[-1] <= limit_hz and count < stiffness.shape[0] // 2:
        count = min(int(_MORE * count) + 1, stiffness.shape[0] // 2)
        frequencies, shapes = lowest_modes(stiffness, mass, count, shift_hz=shift_hz)
    inside = frequencies <= limit_hz
    return frequencies[inside], shapes[:, inside]


DAMPING_STEP = 0.10
FREQUENCY_STEP = 0.01
#: Where a change of damping is the stated one, and how it goes with frequency.
DAMPING_HZ, DAMPING_POWER = 2000.0, 0.3
DEGREE = 8
#: Wavelengths an element of degree 8 may span at the highest frequency. The bench's plates up to 20
#: kHz: frequencies are less than 0.1 % too high.
_WAVES_PER_ELEMENT = 1.7
_RIGID_MODES = 3
_LEAST_STRETCH = math.sqrt(0.5)  # the modulus falls to nothing at one end


@dataclass(frozen=True)
class PlateModes:
    """Modes in rising order of frequency; rigid ones of a plate without supports come first, at 0
    Hz.

    Shapes are mass-normalised, in 1/sqrt(kg), and mean the deflection along the normal.
    """

    frequencies_hz: Floats  # (modes,)
    damping: Floats  # (modes,) ratios
    shape_impact: Floats  # (impact points, modes)
    shapes: Floats  # (sensors, modes)
    sensor_names: tuple[str, ...]


def modes(plate: BenchPlate, effects: Effects, *, max_frequency_hz: float = 20e3) -> PlateModes:
    """All modes up to a frequency.

    The same plate under the same effects is solved once (some seconds for 300 modes).

    Parameters:
        plate: The plate as it was built.
        effects: Which effects act, and how strongly.
        max_frequency_hz: The highest frequency; 20 kHz by default.

    Raises:
        ValueError: For points off the plate, for a support that pushes (`plate.boundary` below 0),
            for effects that leave no stiffness or damping, and where the plate was given fewer
            damping ratios than it has modes.
    """
    stretch = 1 + FREQUENCY_STEP * effects["plate.stiffness"]
    _checked(effects, stretch, max_frequency_hz)
    # Damping has no part in the solution: plates that differ by it share one.
    bare = replace(plate, damping_ratios=())
    solved = _solved(
        bare, stretch, effects["plate.sensor_mass"], effects["plate.boundary"], max_frequency_hz
    )
    count = solved.frequencies_hz.size
    if len(plate.damping_ratios) < count:
        raise ValueError(
            f"damping_ratios has {len(plate.damping_ratios)} values: expected "
            f"one for each of {count} modes"
        )
    step = DAMPING_STEP * effects["plate.damping"]
    share = 1 + step * (solved.frequencies_hz / DAMPING_HZ) ** DAMPING_POWER
    if np.any(share <= 0):
        raise ValueError(
            f"plate.damping at {effects['plate.damping']!r}: expected what "
            f"leaves every mode some damping"
        )
    damping = share * np.array(plate.damping_ratios[:count])
    if np.any(damping >= 1):
        raise ValueError(f"damping ratio {damping.max():.3g} under plate.damping: expected below 1")
    return replace(solved, damping=damping)


def flexural_wavenumber(plate: BenchPlate, frequency_hz: float) -> float:
    """Wavenumber (rad/m) of Mindlin's flexural wave.

    Parameters:
        plate: The plate, of which material and thickness count.
        frequency_hz: The frequency of the wave.

    Source:
        Mindlin, J. Appl. Mech. 18, 1951.
    """
    rho, h = plate.material.density_kg_m3, plate.thickness_m
    omega = 2 * math.pi * frequency_hz
    shear = rho / (SHEAR_CORRECTION * plate.material.shear_modulus_pa)
    rotary = rho * h**3 / (12 * plate.rigidity_n_m)
    static = rho * h / plate.rigidity_n_m
    mean, half = omega**2 * (shear + rotary) / 2, omega**2 * (shear - rotary) / 2
    return math.sqrt(mean + math.sqrt(half**2 + omega**2 * static))


@lru_cache(maxsize=16)
def _solved(
    plate: BenchPlate, stretch: float, loading: float, support: float, max_hz: float
) -> PlateModes:
    mesh = _mesh(plate, max_hz / stretch)
    stiffness, mass = assemble(mesh, plate.material, plate.thickness_m, stretch**2 - 1)
    springs = deflection_rows(mesh, [spring.position_m for spring in plate.springs])
    sensors = deflection_rows(mesh, [sensor.position_m for sensor in plate.sensors])
    hits = deflection_rows(mesh, plate.impact_points_m)
    held = at_points(
        springs, support * np.array([spring.stiffness_n_m for spring in plate.springs])
    )
    stiffness = stiffness + held
    mass = mass + at_points(
        sensors, loading * np.array([sensor.mass_kg for sensor in plate.sensors])
    )
    clamped = [clamped_unknowns(mesh.edge_nodes(clamp)) for clamp in plate.clamps]
    free = (
        np.setdiff1d(np.arange(mesh.size), np.concatenate(clamped))
        if clamped
        else np.arange(mesh.size)
    )
    frequencies, shapes = modes_below(
        stiffness[free][:, free],
        mass[free][:, free],
        max_hz,
        expected=_expected(plate, max_hz / stretch),
        shift_hz=_lowest_scale_hz(plate),
    )
    if not plate.clamps and not (support > 0 and plate.springs):
        frequencies[:_RIGID_MODES] = 0.0
    names = tuple(sensor.name for sensor in plate.sensors)
    at_hits, at_sensors = (np.asarray(rows[:, free] @ shapes) for rows in (hits, sensors))
    arrays = (frequencies, np.zeros_like(frequencies), at_hits, at_sensors)
    for array in arrays:
        array.setflags(write=False)  # the cache hands out the same ones again
    return PlateModes(*arrays, names)


def _mesh(plate: BenchPlate, max_hz: float) -> Mesh:
    length = _WAVES_PER_ELEMENT * 2 * math.pi / flexural_wavenumber(plate, max_hz)
    corners = np.array(plate.outline_m)
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    columns, rows = (max(2, math.ceil(max(pair) / length)) for pair in (sides[::2], sides[1::2]))
    return Mesh.regular(plate.outline_m, columns, rows, DEGREE, plate.clamps)


def _expected(plate: BenchPlate, max_hz: float) -> int:
    """Weyl's count with its edge term for free edges, and some to spare."""
    k = flexural_wavenumber(plate, max_hz)
    corners = np.array(plate.outline_m)
    length = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum())
    return math.ceil(plate.area_m2 * k**2 / (4 * math.pi) + 1.8 * length * k / (4 * math.pi)) + 6


def _lowest_scale_hz(plate: BenchPlate) -> float:
    """A frequency of the order of the first elastic mode: sqrt(D / rho h) over the area."""
    per_area = plate.material.density_kg_m3 * plate.thickness_m
    return math.sqrt(plate.rigidity_n_m / per_area) / plate.area_m2


def _checked(effects: Effects, stretch: float, max_hz: float) -> None:
    if not (math.isfinite(max_hz) and max_hz > 0):
        raise ValueError(f"max_frequency_hz = {max_hz!r}: expected a number above 0")
    if stretch <= _LEAST_STRETCH:
        least = (_LEAST_STRETCH - 1) / FREQUENCY_STEP
        raise ValueError(
            f"plate.stiffness at {effects['plate.stiffness']!r}: expected above {least:.3g}"
        )
    if effects["plate.boundary"] < 0:
        raise ValueError(
            f"plate.boundary at {effects['plate.boundary']!r}: expected 0 or "
            f"more, a support cannot push"
        )


def modal_table(modes: PlateModes, point: int) -> str:
    """CSV text: mode, frequency_hz, damping_ratio, shape_impact and shape_SENSOR in 1/sqrt(kg), a
    row for each mode.

    Parameters:
        modes: The modes of the plate. For a plate that the bench then treats otherwise, give those
            without effects: the table is what the laboratory believes.
        point: Index of the impact point.

    Raises:
        ValueError: For an impact point the modes do not have.
    """
    if point not in range(modes.shape_impact.shape[0]):
        raise ValueError(f"point = {point!r}: expected 0 to {modes.shape_impact.shape[0] - 1}")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    shapes = [f"shape_{name}" for name in modes.sensor_names]
    writer.writerow(["mode", "frequency_hz", "damping_ratio", "shape_impact", *shapes])
    columns = [modes.frequencies_hz, modes.damping, modes.shape_impact[point], *modes.shapes]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    writer.writerows([number, *row] for number, row in enumerate(rows, start=1))
    return text.getvalue()
