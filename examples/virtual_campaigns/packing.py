"""Recordings of the virtual bench, stored small: the part around the impact, in steps of 16 bits.

A step is at most twice the noise of its sensor (one standard deviation).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray
from pyroshock.array_types import Floats
from pyroshock.virtualbench.campaigns.gun import RATE_HZ

#: By quantity, in the unit of its channels: bar, mm, g and kN.
STEPS: Mapping[str, float] = {
    "tank_pressure": 0.002,
    "laser": 0.02,
    "acceleration": 1.0,
    "force": 0.01,
}
#: What is kept: from before the trigger, which is at 0.3 s, to after the plate has rung.
FROM_S, AFTER_IMPACT_S = 0.2, 0.15
#: Of a silent channel, so that noise changes the low byte only: deflate takes bytes.
_SILENCE = 2**15 + 2**7


def step_of(channel: str) -> float:
    """The step of a channel, in its unit, by the name of the channel without its number."""
    return STEPS[channel.rstrip("_1234")]


def steps_of(channel: str, values: NDArray[np.float32]) -> tuple[NDArray[np.uint16], float]:
    """A channel (n,) in steps, and the value of step 0 in the channel's unit.

    Raises `ValueError` where the channel goes further than 16 bits.
    """
    step = step_of(channel)
    rest_value = step * round(float(np.median(values)) / step)
    steps = np.round((values.astype(float) - rest_value) / step) + _SILENCE
    if steps.min() < 0 or steps.max() > np.iinfo(np.uint16).max:
        raise ValueError(f"channel {channel!r}: more than 16 bits in steps of {step:g}")
    return steps.astype(np.uint16), rest_value - _SILENCE * step


def pack(recording: Mapping[str, NDArray[np.float32]], impact_s: float, path: Path) -> None:
    """Write the channels (n,) of a recording, without its `fs`, as HDF5 packed by the conventions
    of netCDF.

    Parameters:
        recording: Channel to values at the rate of the virtual gun bench.
        impact_s: When in the recording the impact begins.
        path: The file to write.
    """
    kept_samples = slice(round(FROM_S * RATE_HZ), round((impact_s + AFTER_IMPACT_S) * RATE_HZ))
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["fs"] = RATE_HZ
        for channel, values in recording.items():
            steps, zero = steps_of(channel, values[kept_samples])
            dataset = file.create_dataset(
                channel,
                data=steps,
                chunks=steps.shape,
                compression="gzip",
                compression_opts=9,
                shuffle=True,
            )
            dataset.attrs["scale_factor"] = step_of(channel)
            dataset.attrs["add_offset"] = zero


def unpacked(path: Path) -> dict[str, Floats]:
    """The channels (n,) of a packed recording, in their units."""
    with h5py.File(path) as file:
        return {
            name: dataset[()] * dataset.attrs["scale_factor"] + dataset.attrs["add_offset"]
            for name, dataset in file.items()
        }
