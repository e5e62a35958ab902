"""The colours of charts: told apart by readers with each kind of colour blindness, and from the
card behind them."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.figures.figure import CATEGORIES, DASHES, ColourRole, curve_style
from pyroshock.app.figures.palette import ALIASES, CARD, colour_of

COLOURS = tuple(role.value for role in CATEGORIES)

CSS = (Path(__file__).resolve().parents[3] / "app" / "web" / "static" / "style.css").read_text(
    encoding="utf-8"
)
#: Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protanopia": np.array([
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116,
        1.051998],
    ]),
    "deuteranopia": np.array([
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940,
        0.968881],
    ]),
    "tritanopia": np.array([
        [1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367,
        0.303900],
    ]),
}  # fmt: skip
_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def schemes() -> dict[str, dict[str, str]]:
    """Colours by name, light and dark."""
    light, dark = (block for block in re.findall(r":root \{(.*?)\}", CSS, re.DOTALL)[:2])
    return {
        name: dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", block))
        for name, block in (("light", light), ("dark", dark))
    }


def linear(colour: str) -> np.ndarray:
    values = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of linear sRGB, D65."""
    xyz = _TO_XYZ @ np.clip(rgb, 0, 1) / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("kind", BLINDNESS)
def test_all_eight_colours_are_told_apart(scheme: str, kind: str) -> None:
    colours = schemes()[scheme]
    perceived_colours = {name: lab(BLINDNESS[kind] @ linear(colours[name])) for name in COLOURS}
    nearest = min(
        (float(np.linalg.norm(perceived_colours[a] - perceived_colours[b])), a, b)
        for a, b in combinations(perceived_colours, 2)
    )
    assert nearest[0] > 15, nearest  # 2.3 is just noticeable


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_colour_stands_out_from_the_card(scheme: str) -> None:
    """WCAG 2.1, 1.4.11: graphics have a contrast of 3 to 1."""
    colours = schemes()[scheme]

    def luminance(name: str) -> float:
        return float(_TO_XYZ[1] @ linear(colours[name]))

    for name in COLOURS:
        high, low = sorted((luminance(name), luminance("card")), reverse=True)
        assert (high + 0.05) / (low + 0.05) >= 3, name


def test_colours_and_dashes_together_tell_forty_curves_apart() -> None:
    assert len({curve_style(i) for i in range(len(COLOURS) * len(DASHES))}) == 40


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_files_and_pages_have_the_same_colours(scheme: str) -> None:
    colours = schemes()[scheme]
    assert colours["card"] == CARD[scheme]
    aliases = dict(re.findall(r"--(\w+): var\(--(\w+)\)", CSS))
    assert aliases == {role.value: other.value for role, other in ALIASES.items()}
    for role in ColourRole:
        assert colour_of(role, scheme) == colours[aliases.get(role.value, role.value)], role
