"""Packages of others add readers, effects and models: which are refused, and what becomes of the
rest."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from pyroshock import plugins
from pyroshock.app.operations.diagnose.request import check_effects
from pyroshock.ingest import readers
from pyroshock.ingest.readers import RecordingError, open_recording
from pyroshock.plugins import PluginError
from pyroshock.training.models import serialization
from pyroshock.training.models.catalogue import MODEL_SPECS, entry_of, models_of
from pyroshock.twin import effects
from pyroshock.twin.effects import catalogue, effect
from support.plugin_package.bench_extras.inclined_barrel import Inclination

CACHES = (
    plugins.installed,
    readers.added_readers,
    effects.added_effects,
    effects.catalogue,
    serialization.added_kinds,
)

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """A function that installs a package of one module, as pip would leave it."""
    monkeypatch.syspath_prepend(str(tmp_path))
    for cache in CACHES:
        cache.cache_clear()

    def put(package: str, group: str, name: str, target: str, code: str = "") -> None:
        info = tmp_path / f"{package.replace('-', '_')}-1.5.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.5\n")
        (info / "entry_points.txt").write_text(f"[{group}]\n{name} = {target}\n")
        if code:
            (tmp_path / f"{target.partition(':')[0]}.py").write_text(code)

    yield put
    for cache in CACHES:
        cache.cache_clear()


READER = """
import numpy as np
from pyroshock.ingest.readers.contents import Contents, in_memory
from pyroshock.ingest.readers.recording import ArrayReader

class R(ArrayReader):
    format, suffixes = {format!r}, {suffixes!r}

    def contents(self, path, open_files, options):
        numbers = np.array(path.read_text().split(), dtype=float)
        return Contents([in_memory("fs", np.array(1000.0)), in_memory("force", numbers)])
"""
MODEL = """
from pyroshock.training.estimators.linear import LinearPowers

class M(LinearPowers):
    kind, description = {kind!r}, {description!r}
"""
EFFECT = "support.plugin_package.bench_extras.inclined_barrel:Inclination"


def test_shipped_formats_and_models_load_no_package(install: Install, tmp_path: Path) -> None:
    install("ruins", "pyroshock.readers", "mat", "ruins_a:R", "raise SystemExit(3)")
    install("ruins-too", "pyroshock.models", "linear", "ruins_b:M", "raise SystemExit(3)")
    np.savez(tmp_path / "a.npz", fs=1000.0, force=np.arange(8.0))
    with open_recording(tmp_path / "a.npz") as recording:
        assert recording.channels[0].samples == 8
    assert entry_of("linear") is MODEL_SPECS["linear"]


def test_a_shipped_name_is_refused_with_both_packages_and_the_cure(install: Install) -> None:
    install("grabby", "pyroshock.effects", "gun.blow_by", EFFECT)
    with pytest.raises(PluginError, match=r"'gun.blow_by' of grabby 1.5.*pyroshock.*pip uninstall"):
        catalogue()


def test_a_name_of_another_package_is_refused(install: Install) -> None:
    install("a-lab", "pyroshock.effects", "gun.inclination", EFFECT)
    install("b-lab", "pyroshock.effects", "gun.inclination", EFFECT)
    with pytest.raises(PluginError, match=r"of b-lab 1.5.*a-lab 1.5.*pip uninstall b-lab"):
        catalogue()


@pytest.mark.parametrize("name", ["tree", "gp"])
def test_a_model_may_not_take_a_shipped_kind_or_name(install: Install, name: str) -> None:
    code = MODEL.format(kind=name, description="One.")
    install("grabby", "pyroshock.models", name, "grabby_model:M", code)
    with pytest.raises(PluginError, match=f"'{name}' of grabby 1.5.*pyroshock.*pip uninstall"):
        models_of("all")


def test_a_suffix_that_is_taken_is_refused(install: Install, tmp_path: Path) -> None:
    code = READER.format(format="loud", suffixes=(".loud", ".wav"))
    install("loud-lab", "pyroshock.readers", "loud", "loud_reader:R", code)
    with pytest.raises(PluginError, match=r"of loud-lab 1.5.*pyroshock reads.*\.wav.*uninstall"):
        open_recording(tmp_path / "a.loud")


def test_a_broken_package_is_one_line_and_stops_no_other(
    install: Install, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    install("broken-lab", "pyroshock.readers", "broken", "broken_reader:R", "import no_such_module")
    code = READER.format(format="quiet", suffixes=(".quiet",))
    install("quiet-lab", "pyroshock.readers", "quiet", "quiet_reader:R", code)
    (tmp_path / "a.quiet").write_text("1 2 3")
    with caplog.at_level(logging.WARNING, "pyroshock.plugins"):
        for _ in range(2):
            with open_recording(tmp_path / "a.quiet") as recording:
                assert recording.read("force").tolist() == [1.0, 2.0, 3.0]
    (line,) = [record.getMessage() for record in caplog.records]
    assert "\n" not in line
    for words in ("reader 'broken' of broken-lab 1.5", "broken_reader:R", "no_such_module"):
        assert words in line
    with pytest.raises(RecordingError, match=r"no reader for \.broken.*\.quiet.*no_such_module"):
        open_recording(tmp_path / "a.broken")


def test_what_is_broken_and_asked_for_by_name_says_why(install: Install) -> None:
    install("broken-gun", "pyroshock.effects", "gun.haunted", "haunted:E", "1 / 0")
    install("broken-net", "pyroshock.models", "ghost-net", "ghost:M", "class M: pass")
    assert "gun.haunted" not in catalogue() and "gun.blow_by" in catalogue()
    assert models_of("all") == list(MODEL_SPECS)
    with pytest.raises(LookupError, match=r"'gun.haunted' of broken-gun.*ZeroDivisionError"):
        effect("gun.haunted")
    with pytest.raises(LookupError, match=r"--with 'gun.haunted'.*ZeroDivisionError"):
        check_effects(only=["gun.haunted"])
    with pytest.raises(LookupError, match=r"'ghost-net' of broken-net.*derived from"):
        models_of("ghost-net")
    description = {"kind": "ghost-net", "settings": {}}
    with pytest.raises(serialization.UnknownKindError, match=r"'ghost-net' of broken-net"):
        serialization.build(description)


BROKEN_EFFECTS = {
    "gun.other": ("", "expected the entry point's name"),
    "plate.inclination": ("", "derived from pyroshock.twin.plate.modal.PlateEffect"),
    "tank.inclination": ("", "expected STAGE.NAME"),
    "gun.mute": ("Inclination.id = 'gun.mute'; Inclination.subject = ''", "subject is empty"),
    "gun.never": ("Inclination.id = 'gun.never'; Inclination.prior_odds = 0.0", "prior_odds is 0"),
    "gun.regime": (
        "Inclination.id = 'gun.regime'; Inclination.regimes = (('speed',),)",
        "the regime .* is not one to 3",
    ),
}


@pytest.mark.parametrize("name", BROKEN_EFFECTS)
def test_an_effect_that_breaks_the_contract_is_left_out_with_the_reason(
    install: Install, name: str
) -> None:
    change, reason = BROKEN_EFFECTS[name]
    source = Path(effects.__file__).parents[1] / "tests/support/plugin_package/bench_extras"
    code = (source / "inclined_barrel.py").read_text(encoding="utf-8") + change + "\n"
    module = f"effect_{name.replace('.', '_')}"
    install("odd-lab", "pyroshock.effects", name, f"{module}:Inclination", code)
    assert name not in catalogue()
    with pytest.raises(LookupError, match=reason):
        effect(name)


def test_effects_are_last_and_by_name_and_versions_are_told(install: Install) -> None:
    install("bench-extras", "pyroshock.effects", "gun.inclination", EFFECT)
    assert list(catalogue())[-1] == "gun.inclination"
    assert catalogue()["gun.inclination"] is Inclination
    assert plugins.with_packages("0.1.0") == "0.1.0 with bench-extras 1.5"
