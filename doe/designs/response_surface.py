"""Designs for a quadratic surface over factors with an order: central composite and Box-Behnken.

A continuous factor takes every place of these designs, rounded to its step. A factor of levels is
taken by rank, so that it needs three levels for the faced design and for Box-Behnken's, and cannot
take the others.
"""

from __future__ import annotations

from ..space import Space
from . import pydoe
from .base import Design, SurfaceWords, from_surface, ordered_axes

_MOST_CENTRE_POINTS = 1000


def central_composite(
    space: Space,
    *,
    face: pydoe.Face = "ccf",
    alpha: pydoe.Alpha = "orthogonal",
    centre: int = 4,
    cube: float = 0.5,
    categorical: SurfaceWords = "refuse",
) -> Design:
    """The corners of a cube, stars on its axes, and twice `centre` runs in its centre.

    `face`: "ccf" has the stars on the faces of the cube, which is the range of the factors; "cci"
    has the stars at the ends of the range and the cube within them; "ccc" has a cube of the share
    `cube` of the range and the stars at `alpha` times it. Raises `ValueError` where stars lie
    beyond the range, and as `coded.ordered_axes` and `coded.from_surface` do.
    """
    _check_centre(centre)
    if not 0 < cube <= 1:
        raise ValueError(f"cube is {cube:g}; expected a share of the range, above 0 and at most 1")
    ordered = ordered_axes(space, categorical)
    coded = pydoe.central_composite(len(ordered), (centre, centre), alpha, face)
    scaled = coded * cube if face == "ccc" else coded
    return Design(space, from_surface(space, scaled, ordered), "central-composite", None)


def box_behnken(
    space: Space, *, centre: int | None = None, categorical: SurfaceWords = "refuse"
) -> Design:
    """The midpoints of the edges of the range, and `centre` runs in its centre (as many as are
    usual, if None).

    No run has all factors at their ends. Raises `ValueError` for fewer than three factors with an
    order, and as `coded.ordered_axes` and `coded.from_surface` do.
    """
    _check_centre(centre or 0)
    ordered = ordered_axes(space, categorical)
    coded = pydoe.box_behnken(len(ordered), centre)
    return Design(space, from_surface(space, coded, ordered), "box-behnken", None)


def _check_centre(count: int) -> None:
    if not 0 <= count <= _MOST_CENTRE_POINTS:
        raise ValueError(f"centre is {count}; expected 0 to {_MOST_CENTRE_POINTS} centre points")
