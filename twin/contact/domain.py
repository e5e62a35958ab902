"""What of a strike lies outside of what the laws of contact were made for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..contact_interface import OutOfDomain, Strikes
from .bodies import MissingQuantityError
from .pulse import ContactPulse
from .restitution.base import LEAST
from .strikes_to_bodies import bodies_of, insulated
from .yielding import yield_velocity


def outside(strikes: Strikes, pulse: ContactPulse, effects: frozenset[str]) -> list[tuple[OutOfDomain, ...]]:
    """For each strike; what one of the effects (by id) takes into account is not told."""
    checks = [
        _restitution(pulse),
        _yield(strikes) if "contact.plastic_yield" not in effects else {},
        _insulator(strikes) if "contact.layer_compliance" not in effects else {},
    ]
    return [tuple(check[row] for check in checks if row in check) for row in range(len(strikes))]


def _restitution(pulse: ContactPulse) -> dict[int, OutOfDomain]:
    restitution = pulse.restitution
    return {
        row: OutOfDomain("restitution", float(restitution.value[row]), f"{LEAST:g} to 1; clipped")
        for row in _rows(restitution.clipped)
    }


def _yield(strikes: Strikes) -> dict[int, OutOfDomain]:
    """Impacts fast enough to leave a mark; nothing where a yield strength is not known."""
    try:
        fastest = yield_velocity(bodies_of(strikes))
    except MissingQuantityError:
        return {}
    velocity = strikes.impact_velocity_m_s
    return {
        row: OutOfDomain("impact_velocity_m_s", float(velocity[row]), f"up to {fastest[row]:.3g}; faster impacts yield")
        for row in _rows(velocity > fastest)
    }


def _insulator(strikes: Strikes) -> dict[int, OutOfDomain]:
    valid_range = "none; the law knows no layer"
    return {
        row: OutOfDomain("insulator", strikes.settings[row].insulator, valid_range) for row in _rows(insulated(strikes))
    }


def _rows(chosen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Iterator[int]:
    return (int(row) for row in np.flatnonzero(chosen))
