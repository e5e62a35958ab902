"""The colours of the roles, on light and on dark.

The page has the same ones as custom properties (`static/style.css`); a test compares them. The
eight categories begin at Okabe and Ito's and were changed until each has a contrast of three to its
background and every two of them are 17 apart in CIE L*a*b* (2.3 is just noticeable) for readers
with normal vision, protanopia, deuteranopia and tritanopia.
"""

from __future__ import annotations

from typing import Literal

from .figure import ColourRole

Scheme = Literal["light", "dark"]

_CATEGORIES: dict[Scheme, tuple[str, ...]] = {
    "light": (
        *("#0072b2", "#d66001", "#689f6f", "#cb71aa"),
        *("#1c2430", "#7b2882", "#775001", "#626b77"),
    ),
    "dark": (
        *("#56b4e9", "#f58239", "#81c291", "#ae70ae"),
        *("#e7ebef", "#6984e3", "#f8eb4e", "#9ea9b5"),
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
        ColourRole.BAD: "#a32640",
        ColourRole.WARN: "#85570a",
    },
    "dark": {
        ColourRole.INK: "#e7ebef",
        ColourRole.QUIET: "#aab4bf",
        ColourRole.RULE: "#39424d",
        ColourRole.NOISE: "#465361",
        ColourRole.BAD: "#f58fa1",
        ColourRole.WARN: "#e3b45c",
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
