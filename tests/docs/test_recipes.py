"""The recipes of CONTRIBUTING.md in a scratch copy: an effect, a check, a reader and a design, four
files each."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
MOST_FILES = 4


@dataclass(frozen=True)
class Recipe:
    """New files by path, lines put before a line of a file, a command, and the tests that must pass
    afterwards."""

    files: dict[str, str]
    lines: dict[str, tuple[tuple[str, str], ...]]
    tests: tuple[str, ...]
    command: str = ""
    written: tuple[str, ...] = ()  # files that the command writes


CHANGELOG = {"CHANGELOG.md": (("- ", "- Something new that a user notices.\n"),)}

EFFECT = Recipe(
    files={
        "twin/plate/effects/bolt_tension.py": '''"""Loose bolts: all frequencies fall."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...effects import parameter
from ..modal import ModalPlate, PlateEffect


@dataclass(frozen=True)
class BoltTension(PlateEffect):
    """Frequencies fall by the share that the joint loses of its stiffness, halved."""

    loss: float = parameter(
        "share of stiffness that is lost", "", default=0.05, low=0.0, high=0.5, off=0.0,
        likely=(0, 0.2), owner="plate",
    )  # fmt: skip

    id = "plate.bolt_tension"
    law = "f' = (1 - loss / 2) f"
    source = "Ibrahim and Pettit, J. Sound Vib. 279 (2005) 857: loose joints soften"

    def changed(self, plate: ModalPlate) -> ModalPlate:
        return replace(plate, frequency_hz=(1 - self.loss / 2) * plate.frequency_hz)
'''
    },
    lines={
        "tests/twin/test_effects.py": (('    "plate.boundary",', '    "plate.bolt_tension",\n'),),
        **CHANGELOG,
    },
    command="import test_effects; test_effects.renew()",
    written=("docs/explanation/effects.md",),
    tests=("tests/twin/test_effects.py",),
)

CHECK = Recipe(
    files={
        "signals/checks/quiet_force.py": '''"""Quiet force: a force channel without any contact."""

from __future__ import annotations

from ..channel import Channel
from .base import Contact, Finding


def check_quiet_force(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A `note` for a force channel in which nothing touches."""
    if channel.quantity != "force" or contacts:
        return []
    message = "no contact in this force channel"
    return [Finding("quiet-force", "note", message, channel.name, {"contacts": 0}, None)]
''',
        "tests/signals/checks/test_quiet_force.py": '''\
"""Force channels without a contact are told."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks.quiet_force import check_quiet_force


@pytest.mark.parametrize(("quantity", "told"), [("force", 1), ("acceleration", 0)])
def test_only_a_force_without_contact_is_told(quantity: str, told: int) -> None:
    channel = Channel(Sensor("a", quantity, "N"), np.zeros(8), 1000.0)
    assert len(check_quiet_force(channel, ())) == told
''',
    },
    lines={
        "signals/checks/__init__.py": (
            ("from .rest_level", "from .quiet_force import check_quiet_force\n"),
            ("    check_rest_level,", "    check_quiet_force,\n"),
        ),
        **CHANGELOG,
    },
    tests=(
        "tests/signals/checks/test_quiet_force.py",
        "tests/docs/test_reference.py",
        "tests/docs/test_docs.py",
    ),
)

READER = Recipe(
    files={
        "ingest/readers/shk.py": '''\
"""A format of a shock recorder: a line of JSON, then the samples."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from .base import ReadingOptions, RecordingError
from .contents import Contents, in_memory
from .recording import ArrayReader

_MAGIC = b"SHK1 "


class ShkReader(ArrayReader):
    """Small records, read whole; every channel has its dtype in the first line."""

    format = "shk"
    suffixes = (".shk",)

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        first, _, samples = path.read_bytes().partition(b"\\n")
        if not first.startswith(_MAGIC):
            raise RecordingError(f"{path.name}: no record of a shock recorder")
        head = json.loads(first.removeprefix(_MAGIC))
        arrays = [in_memory("fs", np.array(float(head["fs"])))]
        for name, dtype in head["channels"]:
            size = head["samples"] * np.dtype(dtype).itemsize
            if len(samples) < size:
                raise RecordingError(
                    f"{path.name}: {name!r} ends after {len(samples)} of {size} bytes"
                )
            arrays.append(in_memory(name, np.frombuffer(samples[:size], dtype)))
            samples = samples[size:]
        return Contents(arrays)
'''
    },
    lines={
        "ingest/readers/__init__.py": (
            ("from .tdms import", "from .shk import ShkReader\n"),
            ("    WavReader(),", "    ShkReader(),\n"),
        ),
        "tests/support/records/recipes.py": (
            (
                "#: Name -> suffix and writer",
                "def write_shk(path: Path, truth: Truth) -> Truth:\n"
                "    import json\n\n"
                "    channels = [(name, str(x.dtype)) for name, x in truth.channels.items()]\n"
                '    head = {"fs": truth.rate_hz, "samples": truth.samples, "channels": channels}\n'
                '    samples = b"".join(x.tobytes() for x in truth.channels.values())\n'
                '    path.write_bytes(b"SHK1 " + json.dumps(head).encode() + b"\\n" + samples)\n'
                "    return unitless(truth)\n\n\n",
            ),
            ('    "npz": (".npz"', '    "shk": (".shk", write_shk),\n'),
        ),
        **CHANGELOG,
    },
    tests=(
        "tests/ingest/readers/test_compliance.py",
        "tests/docs/test_contributing.py",
        "tests/docs/test_reference.py",
    ),
)

DESIGN = Recipe(
    files={
        "doe/designs/simple_random.py": '''"""Levels drawn at random (McKay and others, 1979)."""

from __future__ import annotations

import numpy as np

from ..space import Space
from .base import Design


def simple_random(space: Space, n: int, rng: np.random.Generator) -> Design:
    """`n` runs whose levels are drawn with replacement."""
    levels = [rng.integers(axis.size, size=n) for axis in space.axes]
    return Design(space, np.stack(levels, axis=1).astype(np.int64), "simple-random", None)
''',
        "tests/doe/test_simple_random.py": '''"""Every level of an axis is drawn."""

from __future__ import annotations

import numpy as np
from pyroshock.doe.designs.simple_random import simple_random
from pyroshock.doe.space import gun_space


def test_all_levels_are_drawn() -> None:
    space = gun_space()
    drawn = simple_random(space, 1000, np.random.default_rng(1)).treatments
    assert [set(column) for column in drawn.T] == [set(range(axis.size)) for axis in space.axes]
''',
    },
    lines={
        "doe/designs/methods.py": (
            ("from .space_filling", "from .simple_random import simple_random\n"),
            (
                '    "sobol": DesignMethod(',
                '    "simple-random": DesignMethod(\n'
                '        "Simple random sampling",\n'
                '        "Levels drawn at random, each factor by itself.",\n'
                "        _of_runs(simple_random),\n"
                '        ("runs",),\n'
                "        repeats=True,\n"
                '        example="plan simple-random spring --runs 50 --seed 1",\n'
                "    ),\n",
            ),
        ),
        **CHANGELOG,
    },
    tests=(
        "tests/doe/test_simple_random.py",
        "tests/doe/test_methods.py",
        "tests/docs/test_contributing.py",
    ),
)

RECIPES = {"effect": EFFECT, "check": CHECK, "reader": READER, "design": DESIGN}


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the repository, whose tests import the copy."""
    copy = tmp_path_factory.mktemp("scratch") / "pyroshock"
    left_out = shutil.ignore_patterns(
        ".git",
        ".venv",
        ".cache",
        "__pycache__",
        "images",
        "_build",
        "*.egg-info",
        "results",
        "*.nb?",
    )
    shutil.copytree(ROOT, copy, ignore=left_out, symlinks=True)
    return copy


def put_before(text: str, begin: str, line: str) -> str:
    lines = text.splitlines(keepends=True)
    at = next(i for i, present in enumerate(lines) if present.startswith(begin))
    return "".join([*lines[:at], line, *lines[at:]])


@pytest.mark.parametrize("name", RECIPES)
def test_recipe_touches_few_files_and_its_family_passes(name: str, scratch: Path) -> None:
    recipe = RECIPES[name]
    assert len({*recipe.files, *recipe.lines, *recipe.written}) <= MOST_FILES
    for path, text in recipe.files.items():
        (scratch / path).write_text(text, encoding="utf-8")
    for path, additions in recipe.lines.items():
        text = (scratch / path).read_text(encoding="utf-8")
        for begin, line in additions:
            text = put_before(text, begin, line)
        (scratch / path).write_text(text, encoding="utf-8")
    if recipe.command:
        run(scratch, "-c", recipe.command)
    run(
        scratch,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow and not bench",
        *recipe.tests,
    )


def run(scratch: Path, *words: str) -> None:
    path = os.pathsep.join(
        str(folder) for folder in (scratch.parent, scratch / "tests", scratch / "tests" / "twin")
    )
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, *words], cwd=scratch, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
