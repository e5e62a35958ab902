"""What a notebook's session finds: plates that need no solution, no window, no registry of
another's."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest


@pytest.fixture
def notebook(quick_twins: Path) -> Iterator[None]:
    """Figures open no window, and none stays."""
    import matplotlib.pyplot as plt

    matplotlib.use("agg")
    yield
    plt.close("all")
