"""What every test may ask for."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings
from support.missing import summary_of

# Starting processes costs more than the small work of tests takes.
os.environ.setdefault("PYROSHOCK_JOBS", "1")

pytest_plugins = [
    "support.processes.quick_windows",
    "support.stores.databases",
    "support.stores.web_stores",
]

REPOSITORY = Path(__file__).resolve().parent.parent

# Each test has its time limit; an example that waited for a busy machine is no failure. It changes
# no other profile.
settings.register_profile("default", deadline=None)


def _collects_backwards(config: pytest.Config) -> bool:
    """Whether this is every second of the processes that share the tests."""
    worker: str = getattr(config, "workerinput", {}).get("workerid", "gw0")
    return int(worker.removeprefix("gw")) % 2 == 1


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Each process imports all files of tests. Every second one begins with the last: in a new
    clone each then compiles half of them, and finds the other half compiled."""
    report = yield
    if isinstance(collector, pytest.Directory) and _collects_backwards(collector.config):
        report.result.reverse()
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """All processes have the tests in one order, without which none may share them."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: item.path.parts)


def pytest_collection_finish(session: pytest.Session) -> None:
    """What collecting has made stays until the end, a million objects: the garbage collector goes
    through them no more, and through the others less often than in a program that must save
    memory."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How many tests were skipped for want of which program."""
    reasons = (str(report.longrepr) for report in terminalreporter.stats.get("skipped", ()))
    if line := summary_of(reasons):
        terminalreporter.section("missing programs")
        terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of exchange formats and measured data beside the repository; skips where it is
    absent."""
    folder = REPOSITORY.parent / "shared"
    if not (folder / "campaign-format.md").is_file():
        pytest.skip("no ../shared beside the repository: the measured records live there")
    return folder


@pytest.fixture(scope="session")
def thesis_tables() -> Path:
    """Tables of the thesis as CSV, a file each."""
    return REPOSITORY / "tests" / "data" / "thesis"


@pytest.fixture(scope="session")
def effect_ids() -> list[str]:
    """Ids of the effects that the exchange formats name, in their order."""
    return (REPOSITORY / "tests" / "data" / "effect_ids.txt").read_text(encoding="utf-8").split()


@dataclass(frozen=True)
class Unlabelled:
    """In place of a case's label."""

    folder_sha256: str = ""


#: Campaigns as the disclosed ones, by name: kind, and the effect that acts with its strength.
EXAMPLES = {
    "gun-valve-flow": ("gun", "gun.valve_flow", 1.0),
    "hammer-effective-mass": ("hammer", "contact.effective_mass", 6.0),
    "plate-damping": ("plate", "plate.damping", 9.0),
}


@pytest.fixture(scope="session")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the folders of `EXAMPLES`: two repetitions of each configuration, played with a
    fixed seed."""
    from pyroshock.validation.cases import record
    from pyroshock.validation.cases.case import BackgroundGap, Case

    folder, background = tmp_path_factory.mktemp("examples"), BackgroundGap(0.3, 0.2, 1.0, False, 1)
    with pytest.MonkeyPatch.context() as patch:
        # What each effect makes of the gap takes ten seconds, and no test of a folder asks for it.
        patch.setattr(record, "label_of", lambda case, seed: Unlabelled())
        for name, (kind, effect, strength) in EXAMPLES.items():
            rate_hz = 51_200.0 if kind == "hammer" else 102_400.0
            case = Case(
                kind, "strong", 0, 2, 0.4, background, {effect: strength}, sampling_rate_hz=rate_hz
            )
            record.record_case(case, folder / name, seed=7)
    return folder


@pytest.fixture(scope="session")
def real_data(shared: Path) -> Path:
    """Measured records of others (checks only, not part of the product)."""
    return shared / "real-data"


@pytest.fixture(scope="session", autouse=True)
def played_here() -> Iterator[Callable[[], int]]:
    """The virtual bench plays in the test's own process where no number of processes is given:
    others cost seconds to start, and the tests run in several processes already. Gives what else
    says how many."""
    from pyroshock.parallel.executor import usual_jobs
    from pyroshock.virtualbench import simulate

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulate, "usual_jobs", lambda: 1)
        yield usual_jobs


@pytest.fixture(scope="session", autouse=True)
def readers_imported_once() -> Iterator[None]:
    """Processes that read files apart are forked from a server that has imported the readers.

    The server imports what the first call names, and nothing later. Where that call came from a
    test that needs no reader, each later process imported the readers for itself, a second each.
    """
    from pyroshock.ingest.readers.contents import reading_apart
    from pyroshock.parallel.workers_without_main import ContextWithoutMain

    readers = reading_apart(lambda item: item, lambda _: 0.0).preload
    name_modules = ContextWithoutMain.set_forkserver_preload

    def with_readers(context: ContextWithoutMain, modules: list[str]) -> None:
        name_modules(context, [*readers, *(name for name in modules if name not in readers)])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ContextWithoutMain, "set_forkserver_preload", with_readers)
        yield


@pytest.fixture(scope="module")
def coarse_plates() -> Iterator[None]:
    """The virtual bench with plates of a few modes: solving for all 300 of them takes ten seconds a
    plate."""
    from pyroshock.virtualbench.campaigns import ringing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 500.0)
        yield
