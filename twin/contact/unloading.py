"""Unloading with a permanent indentation, eq. 1.17.

Glossary: F force, delta indentation, max at the deepest, p what stays, n exponent.
"""

from __future__ import annotations

import numpy as np

from ...array_types import Floats


def unloading_force(
    indentation_m: Floats, peak_force_n: Floats, deepest_m: Floats, permanent_m: Floats, exponent: Floats | float = 1.5
) -> Floats:
    """F = F_max ((delta - delta_p) / (delta_max - delta_p))^n, 0 below delta_p; arguments broadcast.

    Raises `ValueError` unless 0 <= delta_p < delta_max.
    """
    if np.any((permanent_m < 0) | (permanent_m >= deepest_m)):
        raise ValueError("permanent_m: expected 0 or more, and less than deepest_m")
    share = np.clip((indentation_m - permanent_m) / (deepest_m - permanent_m), 0.0, None)
    return np.asarray(peak_force_n * share**exponent)


def returned_work(
    peak_force_n: Floats, deepest_m: Floats, permanent_m: Floats, exponent: Floats | float = 1.5
) -> Floats:
    """Area below eq. 1.17 (J): F_max (delta_max - delta_p) / (n + 1)."""
    return np.asarray(peak_force_n * (deepest_m - permanent_m) / (exponent + 1))


def restitution_of_loop(
    loading_work_j: Floats,
    peak_force_n: Floats,
    deepest_m: Floats,
    permanent_m: Floats,
    exponent: Floats | float = 1.5,
) -> Floats:
    """e = sqrt(W_r / W_c) of a loading of known work and its unloading after eq. 1.17 (eq. 1.11)."""
    return np.sqrt(returned_work(peak_force_n, deepest_m, permanent_m, exponent) / loading_work_j)
