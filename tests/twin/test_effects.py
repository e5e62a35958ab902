"""The catalogue of effects is whole: ids, laws, sources, ranges; off, an effect does nothing; each
has its row."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.effects import (
    Effect,
    Parameter,
    catalogue,
    checked_effects,
    effect,
    effect_from_json,
)
from pyroshock.twin.gun.shot import GunEffect
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.plate.stage import PlateSpread, PlateStage
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effect import SensorEffect
from pyroshock.twin.setting import THESIS
from support.records.twin_parts import BENCH, ringing_plate, setting

DOCS = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "effects.md"
#: What `[known]` of campaign.toml may name.
PARAMETERS = Path(__file__).parents[2] / "schema" / "data" / "effect_parameters.csv"

IDS = (
    "gun.back_pressure",
    "gun.blow_by",
    "gun.valve_flow",
    "gun.barrel_loss",
    "gun.sliding_friction",
    "gun.heat_exchange",
    "gun.dead_volume",
    "contact.viscous_loss",
    "contact.plastic_yield",
    "contact.layer_compliance",
    "contact.plate_compliance",
    "contact.effective_mass",
    "contact.tip_geometry",
    "plate.damping",
    "plate.stiffness",
    "plate.sensor_mass",
    "plate.boundary",
    "sensor.pressure_offset",
    "sensor.pressure_gain",
    "sensor.velocity_gain",
    "sensor.force_gain",
    "sensor.force_bandwidth",
    "sensor.acceleration_gain",
    "sensor.mount_resonance",
    "sensor.zero_shift",
)
KINDS = pytest.mark.parametrize("kind", list(catalogue().values()), ids=list(catalogue()))


def at_off(kind: type[Effect]) -> Effect:
    return kind(**{item.name: item.off for item in kind.parameters()})


def test_catalogue_has_exactly_these_in_the_order_of_the_exchange_formats(effect_ids):
    assert sorted(catalogue()) == sorted(IDS)
    # In its order; a lab's own effects come on top.
    assert [name for name in IDS if name in effect_ids] == effect_ids


@KINDS
def test_law_and_source_are_told_the_file_bears_the_name_and_json_reads_back(kind):
    for text in (kind.law, kind.source):
        assert text and "\n" not in text
    assert kind.__module__.rpartition(".")[2] == kind.id.rpartition(".")[2]
    assert effect_from_json(json.loads(json.dumps(kind().as_json(), allow_nan=False))) == kind()


@KINDS
def test_parameters_lie_in_their_ranges_or_are_refused_by_name(kind):
    assert kind.parameters()
    for item in kind.parameters():
        assert item.meaning
        assert item.low <= item.default <= item.high and item.low <= item.off <= item.high
        assert np.all(np.isfinite([item.low, item.default, item.high, item.off]))
    assert any(item.default != item.off for item in kind.parameters()), (
        "by default an effect does something"
    )
    item = kind.parameters()[0]
    with pytest.raises(ValueError, match=re.escape(f"{kind.id}: {item.name} = ")):
        kind(**{item.name: item.high + 1 + abs(item.high)})
    with pytest.raises(ValueError, match=re.escape(f"{kind.id}: {item.name} = nan")):
        kind(**{item.name: float("nan")})


def test_what_there_is_not_is_named_and_arrays_read_back_from_json():
    with pytest.raises(LookupError, match=r"no effect 'gun\.magic'; there are: gun\."):
        effect("gun.magic")
    with pytest.raises(
        ValueError, match=r"sensor\.force_gain has no parameter 'loudness'; it has: gain"
    ):
        effect("sensor.force_gain", loudness=1.0)
    given = effect("sensor.force_gain", gain=np.array([1.0, 1.1]))
    again = effect_from_json(json.loads(json.dumps(given.as_json())))
    np.testing.assert_array_equal(again.gain, [1.0, 1.1])  # type: ignore[attr-defined]


def test_effects_of_another_stage_and_doubles_are_refused():
    gain = effect("sensor.force_gain")
    assert checked_effects([gain], SensorEffect) == (gain,)
    with pytest.raises(
        TypeError, match=r"sensor\.force_gain does not act here: expected effects of GunEffect"
    ):
        checked_effects([gain], GunEffect)
    with pytest.raises(ValueError, match="given twice"):
        checked_effects([gain, gain], SensorEffect)


def rows() -> dict[str, tuple[str, ...]]:
    """Cells of effects.md by id: law, parameters, source."""
    table: dict[str, tuple[str, ...]] = {}
    for line in DOCS.read_text(encoding="utf-8").splitlines():
        if line.startswith("| `"):
            identity, *cells = (
                cell.strip() for cell in line.replace(r"\|", "¦").strip("|").split("|")
            )
            table[identity.strip("`")] = tuple(cell.replace("¦", "|") for cell in cells)
    return table


def cell_of(item: Parameter) -> str:
    """Name, default, unit, the value at which the effect is off, range and meaning of a
    parameter."""
    numbers = (
        f"{item.default:g}{' ' + item.unit if item.unit else ''} (off "
        f"{item.off:g}; [{item.low:g}, {item.high:g}])"
    )
    return f"`{item.name}` {numbers}: {item.meaning}"


def row_of(kind: type[Effect]) -> tuple[str, ...]:
    return (kind.law, "<br>".join(cell_of(item) for item in kind.parameters()), kind.source)


def table_of_effects() -> str:
    """The page's rows as they should be; `renew()` puts them there
    (PYTHONPATH=tests:tests/twin)."""
    rows_in_order = [(f"`{kind.id}`", *row_of(kind)) for kind in catalogue().values()]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in rows_in_order
    )


def table_of_parameters() -> str:
    """`schema/data/effect_parameters.csv` as it should be; `renew()` writes it."""
    rows = [
        f"{kind.id}.{item.name},{item.unit},{float(item.low)!r},{float(item.high)!r}"
        for kind in catalogue().values()
        for item in kind.parameters()
        if item.likely is not None
    ]
    return "\n".join(["name,unit,low,high", *rows, ""])


def renew() -> None:
    PARAMETERS.write_text(table_of_parameters(), encoding="utf-8")
    kept = [
        line for line in DOCS.read_text(encoding="utf-8").splitlines() if not line.startswith("| `")
    ]
    at = next(i for i, line in enumerate(kept) if line.startswith("| ---")) + 1
    DOCS.write_text("\n".join([*kept[:at], table_of_effects(), *kept[at:], ""]), encoding="utf-8")


def test_page_has_the_current_row_of_each_and_no_other():
    assert rows() == {kind.id: row_of(kind) for kind in catalogue().values()}
    assert list(rows()) == list(catalogue())


def test_facts_may_be_of_every_parameter_that_is_looked_for():
    assert PARAMETERS.read_text(encoding="utf-8") == table_of_parameters()


def spectra_and_all(given: tuple[Effect, ...]) -> np.ndarray:
    """Everything that a twin foretells of two shots, one of them onto an insulated anvil."""
    stages = {
        stage: [e for e in given if e.stage() == stage]
        for stage in ("gun", "contact", "plate", "sensor")
    }
    twin = Twin(
        contact=LawContact("hertz", effects=stages["contact"]),  # checked there
        gun=GunStage(BENCH, 0.0, tuple(stages["gun"])),  # checked there
        plate=PlateStage(
            {"aluminum": ringing_plate()}, tuple(stages["plate"]), PlateSpread(0, 0, 0)
        ),
        sensors=SensorChain.of(stages["sensor"]),
        samples=1_000,
        frequency_hz=np.array([500.0, 2000.0, 5000.0]),
    )
    shots = [
        twin.predict(setting(tank_pressure_pa=8e5), draws=0),
        twin.predict(
            setting(tank_pressure_pa=8e5, anvil=THESIS["steel"], insulator="polymeric"), draws=0
        ),
    ]
    told = [[s.velocity_m_s.mean, s.peak_force_n.mean, *s.spectra_m_s2["a1"].mean] for s in shots]
    return np.array(told)


@pytest.fixture(scope="module")
def nominal() -> np.ndarray:
    return spectra_and_all(())


@KINDS
def test_off_leaves_the_prediction_as_it_is_and_the_default_changes_it(kind, nominal):
    """To the bit but for the contact, whose nominal law is a closed form and whose effects are
    integrated."""
    tolerance = 1e-6 if kind.stage() == "contact" else 0.0
    np.testing.assert_allclose(spectra_and_all((at_off(kind),)), nominal, rtol=tolerance)
    assert not np.allclose(spectra_and_all((kind(),)), nominal, rtol=1e-5)
