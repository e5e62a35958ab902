"""The spectral element: Lagrange polynomials of high degree on Gauss-Lobatto nodes.

A high degree keeps a Mindlin element from locking when the plate is thin, and converges so fast that a plate's
first hundreds of modes need some thousands of unknowns (Karniadakis and Sherwin, Spectral/hp Element Methods, 2005).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from .build import PlateMaterial

__all__ = ["SHEAR_CORRECTION", "UNKNOWNS", "basis", "lobatto_nodes", "mass_matrices", "stiffness_matrices"]

#: Unknowns of a node: the deflection w, and rotations such that the shear is their sum with the slopes of w.
UNKNOWNS = 3
#: Reissner's value for a parabolic shear stress.
SHEAR_CORRECTION = 5 / 6


@cache
def lobatto_nodes(degree: int) -> NDArray[np.float64]:
    """The (degree + 1,) points from -1 to 1: the ends, and the extrema of the Legendre polynomial between them."""
    extrema = legendre.legroots(legendre.legder(np.eye(degree + 1)[degree]))
    return np.concatenate([[-1.0], np.sort(extrema.real), [1.0]])


def basis(degree: int, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values and slopes (n, degree + 1) of the Lagrange polynomials of `lobatto_nodes` at `x` (n,)."""
    to_legendre = np.linalg.inv(legendre.legvander(lobatto_nodes(degree), degree))
    slopes = legendre.legder(np.eye(degree + 1), axis=0)
    return legendre.legvander(x, degree) @ to_legendre, legendre.legvander(x, degree - 1) @ slopes @ to_legendre


def stiffness_matrices(
    values: NDArray[np.float64],
    gradients: NDArray[np.float64],
    weights: NDArray[np.float64],
    material: PlateMaterial,
    thickness_m: float,
) -> NDArray[np.float64]:
    """Stiffness (elements, 3n, 3n) of Mindlin's plate (1951): bending by the rotations, shear by them and the slope.

    Shape functions `values` (q, n), `gradients` (elements, q, 2, n) and quadrature `weights` (elements, q), in m^2.
    """
    elements, points, _, nodes = gradients.shape
    x, y = gradients[:, :, 0], gradients[:, :, 1]
    curvature = np.zeros((elements, points, 3, nodes, 3))
    curvature[:, :, 0, :, 1], curvature[:, :, 1, :, 2] = x, y
    curvature[:, :, 2, :, 1], curvature[:, :, 2, :, 2] = y, x
    shear = np.zeros((elements, points, 2, nodes, 3))
    shear[:, :, 0, :, 0], shear[:, :, 1, :, 0] = x, y
    shear[:, :, 0, :, 1], shear[:, :, 1, :, 2] = values, values
    bending, shearing = _rigidities(material, thickness_m)
    return _quadratic(curvature, bending, weights) + _quadratic(shear, shearing, weights)


def mass_matrices(
    values: NDArray[np.float64], weights: NDArray[np.float64], density_kg_m3: float, thickness_m: float
) -> NDArray[np.float64]:
    """Mass (elements, 3n, 3n): translation, and rotary inertia h^3 / 12."""
    inertia = density_kg_m3 * np.array([thickness_m, thickness_m**3 / 12, thickness_m**3 / 12])
    scalar = np.einsum("qa,eq,qb->eab", values, weights, values, optimize=True)
    size = UNKNOWNS * values.shape[1]
    return np.asarray(np.einsum("eab,cd->eacbd", scalar, np.diag(inertia)).reshape(-1, size, size))


def _rigidities(material: PlateMaterial, thickness_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    nu = material.poisson_ratio
    bending = material.young_modulus_pa * thickness_m**3 / (12 * (1 - nu**2))
    plane = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    return bending * plane, SHEAR_CORRECTION * material.shear_modulus_pa * thickness_m * np.eye(2)


def _quadratic(
    strain: NDArray[np.float64], rigidity: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Sum over quadrature points of strain^T rigidity strain."""
    elements, points, kinds = strain.shape[:3]
    strain = strain.reshape(elements, points, kinds, -1)
    stress = np.einsum("kl,eqln->eqkn", rigidity, strain) * weights[:, :, None, None]
    flat = (elements, points * kinds, strain.shape[-1])
    return np.asarray(strain.reshape(flat).transpose(0, 2, 1) @ stress.reshape(flat))
