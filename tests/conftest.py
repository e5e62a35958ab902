"""What every test may ask for."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest_plugins = ["databases"]

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of exchange formats and measured data beside the repository; skips where it is absent."""
    folder = REPOSITORY.parent / "shared"
    if not (folder / "campaign-format.md").is_file():
        pytest.skip("no ../shared beside the repository: the measured records live there")
    return folder


@pytest.fixture(scope="session")
def real_data(shared: Path) -> Path:
    """Measured records of others (checks only, not part of the product)."""
    return shared / "real-data"
