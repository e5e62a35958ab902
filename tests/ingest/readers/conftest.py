"""One recording of each recipe, and recordings made to order."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.records.recipes import (
    RECIPES,
    Sample,
    Truth,
    base_truth,
    write_ide,
    write_lvm,
    write_mat73,
    write_tdms,
    write_uff,
)


@pytest.fixture(scope="session", params=RECIPES)
def sample(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """One recording of each recipe; treat it as read-only."""
    suffix, write = RECIPES[request.param]
    path = tmp_path_factory.mktemp("recordings") / f"{request.param}{suffix}"
    return Sample(path, write(path, base_truth()))


@pytest.fixture(scope="session")
def make_recording() -> Callable[..., Truth]:
    """`make_recording("tdms", path, parts=3)` writes one recipe and returns what its format holds of the truth."""
    writers = {"mat73": write_mat73, "tdms": write_tdms, "lvm": write_lvm, "uff": write_uff, "ide": write_ide}

    def make(recipe: str, path: Path, **options: Any) -> Truth:
        return writers[recipe](path, base_truth(), **options)

    return make
