"""The colours of the roles, on light and on dark.

The page has the same ones as custom properties (`static/style.css`); a test compares them. The
eight categories are Okabe and Ito's without their yellow on white, changed so that each has a
contrast of three to its background and all differ for colour-blind readers.
"""

from __future__ import annotations

from typing import Literal

from .figure import ColourRole

Scheme = Literal["light", "dark"]

_CATEGORIES: dict[Scheme, tuple[str, ...]] = {
    "light": (
        *("#0072b2", "#d55e00", "#00805e", "#b35d96"),
        *("#1c2430", "#2b90c4", "#a67c00", "#6b7480"),
    ),
    "dark": (
        *("#56b4e9", "#ff8c42", "#1fa37c", "#e6a0cd"),
        *("#e7ebef", "#8fa8ff", "#f0e442", "#98a3af"),
    ),
}
#: What stands behind a figure.
CARD: dict[Scheme, str] = {"light": "#ffffff", "dark": "#1b2128"}
_NEUTRAL: dict[Scheme, dict[ColourRole, str]] = {
    "light": {
        ColourRole.INK: "#1c2430",
        ColourRole.QUIET: "#525d6b",
        ColourRole.RULE: "#d3d8df",
        ColourRole.NOISE: "#b9c3cf",
    },
    "dark": {
        ColourRole.INK: "#e7ebef",
        ColourRole.QUIET: "#aab4bf",
        ColourRole.RULE: "#39424d",
        ColourRole.NOISE: "#465361",
    },
}
#: Roles that have the colour of a category or of the words.
ALIASES: dict[ColourRole, ColourRole] = {
    ColourRole.MEASURED: ColourRole.CATEGORY_0,
    ColourRole.MODEL: ColourRole.CATEGORY_1,
    ColourRole.REFERENCE: ColourRole.QUIET,
    ColourRole.TOLERANCE: ColourRole.CATEGORY_7,
    ColourRole.BEFORE: ColourRole.CATEGORY_1,
    ColourRole.AFTER: ColourRole.CATEGORY_0,
    ColourRole.CAUSE: ColourRole.CATEGORY_0,
    ColourRole.OTHER: ColourRole.CATEGORY_7,
}


def colour_of(role: ColourRole, scheme: Scheme = "light") -> str:
    """`#rrggbb` of a role."""
    role = ALIASES.get(role, role)
    if role in _NEUTRAL[scheme]:
        return _NEUTRAL[scheme][role]
    return _CATEGORIES[scheme][int(role.value[1:])]
