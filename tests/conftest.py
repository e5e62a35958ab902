"""What every test may ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

pytest_plugins = [
    "support.stores.databases",
    "support.stores.quick_stores",
    "support.stores.care_fixtures",
    "support.stores.web_stores",
]

REPOSITORY = Path(__file__).resolve().parent.parent

# Each test has its time limit; an example that waited for a busy machine is no failure. It changes no other profile.
settings.register_profile("default", deadline=None)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of exchange formats and measured data beside the repository; skips where it is absent."""
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


@pytest.fixture(scope="session")
def real_data(shared: Path) -> Path:
    """Measured records of others (checks only, not part of the product)."""
    return shared / "real-data"


@pytest.fixture(scope="session", autouse=True)
def played_here() -> Iterator[Callable[[], int]]:
    """The virtual bench plays in the test's own process where no number of processes is given: others cost seconds to
    start, and the tests run in several processes already. Gives what else says how many."""
    from pyroshock.virtualbench import simulate

    really = simulate.default_jobs
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulate, "default_jobs", lambda: 1)
        yield really


@pytest.fixture(scope="module")
def coarse_plates() -> Iterator[None]:
    """The virtual bench with plates of a few modes: solving for all 300 of them takes ten seconds a plate."""
    from pyroshock.virtualbench.campaigns import ringing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 500.0)
        yield
