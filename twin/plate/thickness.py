"""Thick plates: Mindlin's dispersion in the place of Kirchhoff's.

Glossary: k wavenumber, D rigidity, m mass and J rotary inertia per area, S shear stiffness kappa^2 G h.
"""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats
from .build import PlateBuild

#: kappa^2 of Mindlin, J. Appl. Mech. 18 (1951) 31: the first thickness-shear mode comes out exact.
_SHEAR_COEFFICIENT = math.pi**2 / 12


def mindlin_hz(build: PlateBuild, kirchhoff_hz: Floats) -> Floats:
    """Frequencies (m,) of Mindlin's plate at the wavenumbers of Kirchhoff's frequencies (m,).

    Of Mindlin's two branches the flexural one. Exact for simply supported polygons, where both plates have the shapes
    of a membrane (Conway, Can. Aeronaut. J. 6, 1960, 263; Wang, J. Vib. Acoust. 116, 1994, 536). An approximation where
    edges are free or clamped: the near field there is sheared otherwise than the waves are.
    """
    m, rotary, shear = _inertia_and_shear(build)
    squares = (2 * np.pi * kirchhoff_hz) ** 2
    k2 = np.sqrt(m / build.rigidity_n_m * squares)
    # (J/S) x^2 - b x + omega_K^2 = 0 for x = omega^2; its smaller root, written so that nothing cancels.
    b = 1 + (build.rigidity_n_m / shear + rotary / m) * k2
    return np.sqrt(2 * squares / (b + np.sqrt(b**2 - 4 * rotary / shear * squares))) / (2 * np.pi)


def kirchhoff_hz(build: PlateBuild, mindlin_hz: float) -> float:
    """The inverse of `mindlin_hz`."""
    m, rotary, shear = _inertia_and_shear(build)
    d, x = build.rigidity_n_m, (2 * math.pi * mindlin_hz) ** 2
    half = x * (d * m + rotary * shear) / 2
    k2 = (half + math.sqrt(half**2 - d * shear * m * x * (rotary * x - shear))) / (d * shear)
    return float(k2 * math.sqrt(d / m) / (2 * math.pi))


def flexural_wavelength_m(build: PlateBuild, kirchhoff_hz: float) -> float:
    """Of Kirchhoff's plate."""
    k4 = build.mass_per_area_kg_m2 / build.rigidity_n_m * (2 * math.pi * kirchhoff_hz) ** 2
    return float(2 * math.pi / k4**0.25)


def edge_layer_m(build: PlateBuild) -> float:
    """How deep the layer along a free edge is that does not resist twisting: h / sqrt(12 kappa^2) = h / pi.

    Kirchhoff's plate lets twisting moments end at a free edge in a jump of shear; Mindlin's lets them fade over h / pi.
    To first order in h the twisting energy of that layer is missing: a strip of width b twists with a stiffness of
    G h^3 b / 3 (1 - 2 h / (pi b)), where Saint-Venant has 0.630 for 2 / pi (Timoshenko and Goodier, Theory of
    Elasticity, on torsion of a rectangular bar).
    """
    return build.thickness_m / math.sqrt(12 * _SHEAR_COEFFICIENT)


def _inertia_and_shear(build: PlateBuild) -> tuple[float, float, float]:
    """m, J and S."""
    material, h = build.material, build.thickness_m
    modulus = material.youngs_modulus_pa / (2 * (1 + material.poisson_ratio))
    return build.mass_per_area_kg_m2, material.density_kg_m3 * h**3 / 12, _SHEAR_COEFFICIENT * modulus * h
