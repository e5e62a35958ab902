"""`python -m benchmarks.prediction`: one end-to-end prediction of a warm process, as Markdown.

64 random shots through gun, contact, plate (300 modes), two sensors and 41 lines: with a law of contact, and with a
Gaussian process that learned from 300 pulses, as the registry gives it back. Beside it, nominal spectra of many
settings at once: what a search asks for. The exit code is 1 where a promise is broken: 50 ms, 150 ms.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.contact_interface import ContactStage
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import Setting

from .measuring import Spread
from .shared_records import BENCH, PREDICTORS, pulse_table, ringing_plate, setting

RUNS, WARM, SEARCHED = 40, 5, 2_000
LAW_LIMIT_S, PROCESS_LIMIT_S = 0.050, 0.150
MODES, PULSES, PROCESS = 300, 300, "coregional-gp"


def twin_with(contact: ContactStage) -> Twin:
    plates = PlateStage({"aluminum": ringing_plate(MODES)})
    return Twin(contact, GunStage(BENCH, 0.046, unknown_effects=True), plates)


def registered_process() -> ContactStage:
    """As the registry gives it back: packed, read, asked with settings."""
    from datetime import UTC, datetime

    from pyroshock.dataset.domain import Domain
    from pyroshock.training.models.catalogue import BuildOptions, entry_of
    from pyroshock.training.models.serialization import pack, unpack
    from pyroshock.training.registry.contact_stage import RegisteredContact
    from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version

    table = pulse_table(np.random.default_rng(0), repetitions=PULSES // 60)
    model = entry_of(PROCESS).make(BuildOptions()).fit(table, np.random.default_rng(0))
    dataset, when = DatasetName("spring", "5" * 64, "hammer"), datetime(2026, 1, 1, tzinfo=UTC)
    version = Version(PROCESS, 1, dataset, "repetitions", 0, {}, Cost(1, 1), "k", "r", "0" * 64, when, "hammer")
    return RegisteredContact(RegisteredModel(version, unpack(*pack(model)), PREDICTORS, Domain.of(table), {}))


def measured(call: Callable[[], object], runs: int) -> Spread:
    for _ in range(WARM):
        call()
    seconds: list[float] = []
    for _ in range(runs):
        begin = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - begin)
    return Spread.of(seconds)


def one_shot(twin: Twin, asked: Setting) -> Callable[[], object]:
    return lambda: twin.predict(asked, rng=np.random.default_rng(0))


def searched(twin: Twin) -> Callable[[], object]:
    settings = [setting(tank_pressure_pa=p) for p in np.linspace(1e5, 8e5, SEARCHED)]
    return lambda: twin.spectra(settings)


def main() -> int:
    asked = setting(tank_pressure_pa=5e5)
    law, process = twin_with(LawContact("hertz")), twin_with(registered_process())
    rows = [
        ("one prediction, Hertz", measured(one_shot(law, asked), RUNS), LAW_LIMIT_S),
        ("one prediction, registered Gaussian process", measured(one_shot(process, asked), RUNS), PROCESS_LIMIT_S),
        (f"{SEARCHED} nominal spectra, Hertz", measured(searched(law), 3), None),
    ]
    print(f"| what | ms, median (least to most) of {RUNS} | promised |\n| --- | --- | --- |")
    for what, spread, limit in rows:
        print(f"| {what} | {spread.text(scale=1e3)} | {'-' if limit is None else f'{1e3 * limit:g}'} |")
    return int(any(limit is not None and spread.median > limit for _, spread, limit in rows))


if __name__ == "__main__":
    raise SystemExit(main())
