"""Records for the quality checks: channels from arrays, contacts from a force, measured hits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import Contact

UNITS = {"force": "N", "acceleration": "m/s2", "temperature": "K", "pressure": "Pa", "strain": "1"}

ChannelOf = Callable[..., Channel]


@pytest.fixture(scope="session")
def channel_of() -> ChannelOf:
    """`channel_of(samples, quantity="force", rate_hz=51200.0, header={}, **sensor)`."""

    def make(
        samples: Any,
        quantity: str = "force",
        rate_hz: float = 51200.0,
        header: dict[str, Any] | None = None,
        **sensor: Any,
    ) -> Channel:
        fields = {"name": "probe", "quantity": quantity, "unit": UNITS[quantity], **sensor}
        return Channel(Sensor(**fields), np.asarray(samples), rate_hz, header=header or {})

    return make


@pytest.fixture(scope="session")
def contact_at_peak() -> Callable[[NDArray[Any]], tuple[Contact, ...]]:
    """The one contact of a hit: from the peak outward while the force is above 0.5 % of it (thesis,
    section 4.1)."""

    def find(force: NDArray[Any]) -> tuple[Contact, ...]:
        peak = int(force.argmax())
        below = force <= 0.005 * force[peak]
        first = peak - int(below[peak::-1].argmax()) + 1
        return (Contact(first, peak, peak + int(below[peak:].argmax()) - 1),)

    return find


@pytest.fixture(scope="session")
def half_sine() -> Callable[..., NDArray[np.float64]]:
    """`half_sine(n=2048, first=400, width=60, height=1000.0, noise=0.0, rng=None)`: one pulse in a
    record at rest."""

    def make(
        n: int = 2048,
        first: int = 400,
        width: int = 60,
        height: float = 1000.0,
        noise: float = 0.0,
        rng: np.random.Generator | None = None,
    ) -> NDArray[np.float64]:
        x = np.zeros(n) if rng is None else rng.normal(scale=noise, size=n)
        x[first : first + width] += height * np.sin(np.pi * (np.arange(width) + 0.5) / width)
        return x

    return make


@pytest.fixture(scope="session")
def vrtac(real_data: Path) -> dict[str, NDArray[np.float32]]:
    """33 measured single hits at 20 kHz, each (4, 5000): force in N, then three accelerations in
    m/s2."""
    with np.load(real_data / "vrtac-impact-hammer" / "dewesoft_20000Hz.npz") as file:
        return {
            f"{series}[{hit}]": record
            for series in file
            if series[0] == "F"
            for hit, record in enumerate(file[series])
        }
