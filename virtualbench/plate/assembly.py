"""Stiffness and mass of a whole plate, and what points add to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from .build import PlateMaterial, Point
from .mesh import UNKNOWNS, Mesh, basis, bilinear, mass_matrices, stiffness_matrices

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    Matrix = csc_array[np.float64]

__all__ = ["assemble", "at_points", "clamped_unknowns", "deflection_rows"]


def assemble(mesh: Mesh, material: PlateMaterial, thickness_m: float, stiffer: float = 0.0) -> tuple[Matrix, Matrix]:
    """Stiffness (N/m, N, N m) and mass of the bare plate without supports; both (size, size), symmetric.

    `stiffer`: by what share the modulus is higher than the material's in the mean over the plate. It grows evenly along
    x, and is the material's where x is farther from the centroid.
    """
    values, gradients, weights, x = _quadrature(mesh)
    centre = float(np.sum(weights * x) / np.sum(weights))
    ends = mesh.corners_m[:, 0] - centre
    uneven = 1 + stiffer * (1 + (x - centre) / np.abs(ends).max())
    stiffness = stiffness_matrices(values, gradients, weights * uneven, material, thickness_m)
    mass = mass_matrices(values, weights, material.density_kg_m3, thickness_m)
    return _gathered(mesh, stiffness), _gathered(mesh, mass)


def deflection_rows(mesh: Mesh, points_m: Sequence[Point]) -> Matrix:
    """The matrix (points, size) that takes the deflection at some points. Raises `ValueError` off the plate."""
    from scipy.sparse import csc_array

    interpolations = [mesh.deflection_at(point) for point in points_m]
    rows = np.repeat(np.arange(len(interpolations)), (mesh.degree + 1) ** 2)
    columns = (
        np.concatenate([unknowns for unknowns, _ in interpolations]) if interpolations else np.empty(0, dtype=np.intp)
    )
    values = np.concatenate([weights for _, weights in interpolations]) if interpolations else np.empty(0)
    return csc_array((values, (rows, columns)), shape=(len(interpolations), mesh.size))


def at_points(rows: Matrix, amounts: NDArray[np.float64]) -> Matrix:
    """Point springs (N/m) or masses (kg), `amounts` (points,), as a matrix (size, size) to add."""
    from scipy.sparse import csc_array, diags_array

    return csc_array(rows.T @ diags_array(amounts) @ rows)


def clamped_unknowns(nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Every unknown of these nodes."""
    return np.unique(UNKNOWNS * nodes[:, None] + np.arange(UNKNOWNS))


def _quadrature(
    mesh: Mesh,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """By Gauss's rule: shape functions (q, n), gradients (elements, q, 2, n), weights in m^2 and x (elements, q)."""
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
    jacobian = jacobian * np.stack(np.broadcast_arrays(du[:, None], dv[None, :]), axis=-1)[:, :, None, :, None]
    jacobian = jacobian.reshape(-1, points.size**2, 2, 2)
    gradients = np.linalg.inv(jacobian) @ np.stack([along_u, along_v], axis=1)
    areas = np.linalg.det(jacobian) * np.outer(weights, weights).ravel()
    return _products(values, values), gradients, areas, position[:, 0].reshape(areas.shape)


def _products(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    points, nodes = first.shape
    return np.asarray(np.einsum("qa,rb->qrab", first, second).reshape(points**2, nodes**2))


def _spread(lines: NDArray[np.float64], points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    width = np.diff(lines)
    return lines[:-1, None] + width[:, None] * (points + 1) / 2, width


def _gathered(mesh: Mesh, parts: NDArray[np.float64]) -> Matrix:
    from scipy.sparse import csc_array

    unknowns = mesh.element_unknowns()
    rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
    return csc_array((parts.ravel(), (rows.ravel(), columns.ravel())), shape=(mesh.size, mesh.size))
