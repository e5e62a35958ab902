"""The theme of the twin: one prediction from tank pressure to spectrum, as `python -m benchmarks.prediction`.

No other software does this chain, so that each time stands beside its promise and beside what of it no way of computing
leaves out: one inverse transform for each acceleration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact

from .figures import Figure
from .measuring import Spread, interleaved, ratio
from .prediction import (
    LAW_LIMIT_S,
    PROCESS_LIMIT_S,
    RUNS,
    SEARCHED,
    WARM,
    measured,
    one_shot,
    registered_process,
    searched,
    twin_with,
)
from .shared_records import setting

THEME = "The twin: 64 random shots through gun, contact, plate (300 modes), two sensors and 41 lines"
DRAWS, SENSORS = 64, 2


def measure_predictions(_folder: Path, runs: int = RUNS) -> Iterator[Figure]:
    asked = setting(tank_pressure_pa=5e5)
    law, process = twin_with(LawContact("hertz")), twin_with(registered_process())
    for name, twin, limit in (("Hertz", law, LAW_LIMIT_S), ("a registered Gaussian process", process, PROCESS_LIMIT_S)):
        for _ in range(WARM):
            one_shot(twin, asked)()
        taken = interleaved({"ours": one_shot(twin, asked), "transforms": transforms(twin)}, runs)
        text, bound = (Spread.of(taken[which]).text(" ms", 1e3) for which in ("ours", "transforms"))
        yield Figure(
            THEME, f"one prediction, {name}", text, f"{1e3 * limit:g} ms, promised",
            Spread.of([s / limit for s in taken["ours"]]), limit=1.0, of="bound",
            nature=f"the inverse transforms of {DRAWS * SENSORS} accelerations: {bound}",
            near=ratio(taken["ours"], taken["transforms"]), question=f"a prediction with {name}",
        )  # fmt: skip
    text = measured(searched(law), 3).text(" s")
    yield Figure(THEME, f"{SEARCHED:,} nominal spectra, Hertz", text, "no peer, no promise", None)


def transforms(twin: Twin) -> Callable[[], object]:
    """Of twice the record, so that the convolution does not run into itself."""
    from scipy.fft import irfft, next_fast_len

    length = next_fast_len(2 * twin.samples, real=True)
    spectra = np.ones((DRAWS * SENSORS, length // 2 + 1), dtype=np.complex128)
    return partial(irfft, spectra, length, workers=2)
