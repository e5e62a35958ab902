"""`python -m benchmarks.prediction`: one end-to-end prediction of a warm process, from tank
pressure to spectrum.

64 random shots through gun, contact, plate (300 modes), two sensors and 41 lines: with a law of
contact, and with a Gaussian process that learned from 300 pulses, as the registry gives it back. No
other software has this chain, so that each time stands beside its promise, and beside what no way
of computing leaves out: one inverse transform for each acceleration. Nominal spectra of many
settings at once are what a search asks for.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.dataset.domain import Domain
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.models.serialization import pack, unpack
from pyroshock.training.registry.contact_stage import RegisteredContact
from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.contact_interface import ContactStage
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.plate.stage import PlateStage
from scipy.fft import irfft, next_fast_len

from .harness import Figure, promised, report, spread_text, take_turns
from .shared_records import BENCH, PREDICTORS, pulse_table, ringing_plate, setting

THEME = (
    "The twin: 64 random shots through gun, contact, plate (300 modes), two sensors and 41 lines"
)
LAW_LIMIT_S, PROCESS_LIMIT_S = 0.050, 0.150
SEARCHED, MODES, PULSES, DRAWS, SENSORS, WARM = 2_000, 300, 300, 64, 2, 5
PROCESS = "coregional-gp"


def twin_with(contact: ContactStage) -> Twin:
    plates = PlateStage({"aluminum": ringing_plate(MODES)})
    return Twin(contact, GunStage(BENCH, 0.046, unknown_effects=True), plates)


def registered_process() -> ContactStage:
    """As the registry gives it back: packed, read, asked with settings."""
    table = pulse_table(np.random.default_rng(0), repetitions=PULSES // 60)
    model = entry_of(PROCESS).make(BuildOptions()).fit(table, np.random.default_rng(0))
    dataset, when = DatasetName("spring", "5" * 64, "hammer"), datetime(2026, 1, 1, tzinfo=UTC)
    version = Version(
        PROCESS, 1, dataset, "repetitions", 0, {}, Cost(1, 1), "k", "r", "0" * 64, when, "hammer"
    )
    return RegisteredContact(
        RegisteredModel(version, unpack(*pack(model)), PREDICTORS, Domain.of(table), {})
    )


def measure_prediction(_folder: Path, runs: int = 40) -> Iterator[Figure]:
    at, law = setting(tank_pressure_pa=5e5), twin_with(LawContact("hertz"))
    process = twin_with(registered_process())
    length = next_fast_len(
        2 * law.samples, real=True
    )  # so that the convolution does not run into itself
    transforms = partial(
        irfft, np.ones((DRAWS * SENSORS, length // 2 + 1), dtype=np.complex128), length, workers=2
    )
    for name, twin, limit in (
        ("Hertz", law, LAW_LIMIT_S),
        ("a registered Gaussian process", process, PROCESS_LIMIT_S),
    ):

        def predict(twin: Twin = twin) -> object:
            return twin.predict(at, rng=np.random.default_rng(0))

        for _ in range(WARM):
            predict()
        seconds = take_turns({"ours": predict, "transforms": transforms}, runs)
        yield promised(
            THEME, f"one prediction, {name}", seconds["ours"], limit,
            question=f"a prediction with {name}",
            bound=f"the inverse transforms of {DRAWS * SENSORS} accelerations",
            bound_values=seconds["transforms"],
        )  # fmt: skip
    settings = [setting(tank_pressure_pa=p) for p in np.linspace(1e5, 8e5, SEARCHED)]
    seconds = take_turns({"spectra": lambda: law.spectra(settings)}, 3)
    text = spread_text(seconds["spectra"], "s")
    yield Figure(THEME, f"{SEARCHED:,} nominal spectra, Hertz", text, "no peer, no promise", None)


if __name__ == "__main__":
    sys.exit(report(measure_prediction))
