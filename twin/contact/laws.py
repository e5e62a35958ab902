"""The nominal laws of contact by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from .hertz import hertz
from .hunt_crossley import hunt_crossley
from .hunter import hunter
from .pulse import ContactPulse, Law
from .reed import reed
from .restitution.base import RestitutionLaw
from .restitution.weir_tallon import weir_tallon
from .restitution.zener import zener
from .von_hann import von_hann

#: Laws that lose energy, as much as a law of restitution says.
LOSSY: Mapping[str, Callable[..., ContactPulse]] = {"hann": von_hann, "hunt-crossley": hunt_crossley}
ELASTIC: Mapping[str, Law] = {"hunter": hunter, "reed": reed, "hertz": hertz}
RESTITUTIONS: Mapping[str, RestitutionLaw] = {"zener": zener, "weir-tallon": weir_tallon}

#: Every law, ready to be asked; those that lose energy lose it as Zener says.
LAWS: Mapping[str, Law] = {**ELASTIC, **LOSSY}


def contact_law(name: str, restitution: str | None = None) -> Law:
    """A law by name, with a law of restitution of one's choice. Raises `LookupError` for names there are none of.

    Raises `ValueError` where a law without loss is given a restitution.
    """
    if name not in LAWS:
        raise LookupError(f"no law of contact {name!r}; there are: {', '.join(LAWS)}")
    if restitution is None:
        return LAWS[name]
    if restitution not in RESTITUTIONS:
        raise LookupError(f"no law of restitution {restitution!r}; there are: {', '.join(RESTITUTIONS)}")
    if name not in LOSSY:
        raise ValueError(f"restitution {restitution!r} for {name!r}, a law without loss: expected none")
    return partial(LOSSY[name], restitution=RESTITUTIONS[restitution])
