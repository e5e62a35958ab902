"""Every feasible treatment once: nothing is confounded, where the campaign can afford it (Montgomery, chapter 5)."""

from __future__ import annotations

from ..space import Space
from .base import Design


def factorial(space: Space) -> Design:
    """All treatments, the last axis fastest: an order to run them in is another function's work.

    Raises `ValueError` for a space of more than a million treatments.
    """
    return Design(space, space.all_treatments(), "factorial", None)
