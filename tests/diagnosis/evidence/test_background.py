"""Small errors: a pulse that is too long is so in all that is made of its length; shapes may be met better."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.background import BANK, PLATE_BANK, Background, Kernels, bank, under
from pyroshock.diagnosis.evidence.cells import Cells
from pyroshock.diagnosis.evidence.whitening import Whitening
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.base import Observable
from pyroshock.diagnosis.stages.contact import ContactStage
from pyroshock.diagnosis.stages.plate import PlateStage
from support.records.contact_campaigns import hammer_record
from support.records.plate_records import plate, played
from support.records.toy_bench import Design, campaign, stages_of


@pytest.fixture(scope="module")
def kernels() -> tuple[GapTable, Cells, Kernels]:
    record = hammer_record()
    gap = GapTable.of(record, (ContactStage(record),))
    cells = Cells.of(gap)
    return gap, cells, Kernels.of(gap, cells)


def of(gap: GapTable, cells: Cells, name: str) -> int:
    """The cell of an observable in the first configuration."""
    column = [each.name for each in gap.observables].index(name)
    return int(np.flatnonzero((cells.configuration == 0) & (cells.observable == column))[0])


def test_impulse_is_height_times_length(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    gap, cells, kernel = kernels
    found = kernel.background({"contact": Background(1.0, 0.0, 0.0)})
    peak, impulse, half, tenth = (of(gap, cells, f"ln_{n}") for n in ("peak", "impulse", "width_half", "width_tenth"))
    assert found[half, tenth] == found[peak, impulse] == found[half, impulse] == pytest.approx(1.0)
    assert found[peak, half] == 0
    left = np.zeros(len(found))
    left[[impulse, peak, half]] = 1, -1, -1
    assert left @ found @ left < 0.5  # what an impulse is beside its height and its length


def test_shapes_may_be_met_better(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    gap, cells, kernel = kernels
    found = kernel.background({"contact": Background(0.0, 0.0, 1.0, detail=0.1)})
    skew, peak = of(gap, cells, "skew"), of(gap, cells, "ln_peak")
    assert found[skew, skew] == pytest.approx(0.01)
    assert found[peak, peak] > 0.9


def test_gain_is_not_priced_by_shapes_that_are_right(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    """Widths 0.7 tolerances off everywhere, shapes right to a twentieth: a background of the bank holds that."""
    gap, cells, kernel = kernels
    z = np.zeros(len(cells.z))
    for name in ("ln_width_half", "ln_width_tenth", "ln_impulse"):
        z[cells.observable == [each.name for each in gap.observables].index(name)] = 0.7
    noise = np.diag(np.full(len(z), 0.05**2))
    density = [Whitening.of(noise + kernel.background({"contact": one})).log_density(z) for one in BANK]
    coarse = [value for value, one in zip(density, BANK, strict=True) if one.detail == 1]
    assert max(density) > max(coarse) + 5


@pytest.mark.parametrize("one", BANK)
def test_every_background_is_a_covariance(one: Background, kernels: tuple[GapTable, Cells, Kernels]) -> None:
    found = kernels[2].background({"contact": one})
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9


@pytest.fixture(scope="module")
def plates() -> tuple[GapTable, Cells, Kernels]:
    record = played(bench=plate(), contacts=[(2e-4, 900.0), (3e-4, 1200.0), (4e-4, 900.0)], repetitions=2)
    gap = GapTable.of(record, (PlateStage(record),))
    cells = Cells.of(gap)
    return gap, cells, Kernels.of(gap, cells)


def test_gain_is_shared_by_all_that_a_sensor_shows_of_one_configuration(
    plates: tuple[GapTable, Cells, Kernels],
) -> None:
    gap, cells, kernel = plates
    found = kernel.background({"plate": Background(0.0, gain=(0.0, 0.7))})
    name = [gap.observables[int(o)].name for o in cells.observable]
    level = np.array(["spectrum" in each or "ln amplitude" in each for each in name])
    same = (cells.configuration[:, None] == cells.configuration) & (kernel.channel[:, None] == kernel.channel)
    np.testing.assert_allclose(found, 0.49 * (same & level[:, None] & level))


@pytest.mark.parametrize("one", PLATE_BANK)
def test_every_background_of_a_plate_is_a_covariance(one: Background, plates: tuple[GapTable, Cells, Kernels]) -> None:
    found = plates[2].background({"plate": one})
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9


@pytest.mark.parametrize(
    "stages", [("gun",), ("contact",), ("gun", "contact"), ("plate",), ("gun", "contact", "plate")]
)
def test_what_may_lie_under_a_gap_is_of_the_bank(stages: tuple[str, ...]) -> None:
    every = bank(stages)
    assert all(set(one) == set(stages) for one in every)
    assert all(one in every for one in under(stages))
    assert len({tuple(one.items()) for one in every}) == len(every)


def item(name: str, stage: str, channel: str, unit: str = "1", hz: float | None = None, **more: object) -> Observable:
    return Observable(name, stage, channel, unit, 0.02, 0.01, hz, **more)


#: A gun, a contact and a plate with lines and modes; what two channels name alike is not the same.
OBSERVABLES = (
    item("ln_velocity", "gun", "velocity"),
    item("ln_peak", "contact", "force", parts=("height",)),
    item("ln_impulse", "contact", "force", parts=("height", "length")),
    item("ln_width", "contact", "force", parts=("length",)),
    item("skew", "contact", "force", detail=True),
    item("a_1 at 100 Hz", "plate", "a_1", "dB", 100.0),
    item("a_1 at 250 Hz", "plate", "a_1", "dB", 250.0),
    item("a_1 ln amplitude", "plate", "a_1", hz=180.0, parts=("amplitude",)),
    item("a_1 rest", "plate", "a_1", detail=True),
    item("a_2 at 100 Hz", "plate", "a_2", "dB", 100.0, parts=("amplitude",)),
    item("ln frequency 1", "plate", "modes", hz=180.0, detail=True),
    item("ln damping 1", "plate", "modes", hz=180.0),
)


@cache
def bench() -> tuple[GapTable, Cells, Kernels]:
    """Nine of twelve configurations, some cells without a run, of these observables."""
    rng = np.random.default_rng(2)
    record = campaign([], rng, Design(pressures_bar=(0.5, 1.0, 4.0), masses_kg=(0.25, 1.0), repetitions=2))
    gap = GapTable.of(record, stages_of(record)).only(np.array([0, 1, 2, 4, 6, 7, 8, 10, 11]))
    count = np.where(rng.uniform(size=gap.count.shape) < 0.2, 0, gap.count)
    gap = replace(gap, observables=OBSERVABLES, count=count)
    cells = Cells.of(gap)
    return gap, cells, Kernels.of(gap, cells)


def squared_distance(one: dict[str, float | str], other: dict[str, float | str]) -> float:
    """Pressures of a factor of 8 and masses of a factor of 4 by their logarithms' share of it; another word is 1."""
    words = float(one["insulator"] != other["insulator"])
    pressure = np.log(float(one["tank_pressure"]) / float(other["tank_pressure"])) / np.log(8)
    mass = np.log(float(one["bullet_mass"]) / float(other["bullet_mass"])) / np.log(4)
    return float(words + pressure**2 + mass**2)


def shared(one: Observable, other: Observable) -> float:
    """B of docs/diagnosis.md."""
    common = len(set(one.parts) & set(other.parts))
    if one.name == other.name:
        return common + 0.1 if common else 1.0
    if one.channel != other.channel:
        return 0.0
    if one.frequency_hz is None or other.frequency_hz is None:
        return float(common)
    return common + 0.5 * float(np.exp(-0.5 * (np.log2(one.frequency_hz / other.frequency_hz) / 0.7) ** 2))


def by_hand(of: dict[str, Background]) -> np.ndarray:
    """The bank's equation of docs/diagnosis.md, entry by entry."""
    gap, cells, _ = bench()
    level = [each.frequency_hz is not None and each.channel in ("a_1", "a_2") for each in OBSERVABLES]
    found = np.zeros((len(cells.z), len(cells.z)))
    for i, (c, o) in enumerate(zip(cells.configuration, cells.observable, strict=True)):
        for j, (d, p) in enumerate(zip(cells.configuration, cells.observable, strict=True)):
            one, other = OBSERVABLES[o], OBSERVABLES[p]
            if one.stage != other.stage or one.stage not in of:
                continue
            a, same = of[one.stage], float(c == d)
            factors = [dict(gap.record.configurations[gap.rows[row]].factors) for row in (c, d)]
            smooth = np.exp(-squared_distance(*factors) / (2 * 0.8**2))
            details = (a.detail if one.detail else 1.0) * (a.detail if other.detail else 1.0)
            own = (a.constant**2 + a.smooth**2 * smooth + a.white**2 * same) * shared(one, other) * details
            gain = (a.gain[0] ** 2 * smooth + a.gain[1] ** 2 * same) if level[o] and level[p] else 0.0
            found[i, j] = own + (gain if one.channel == other.channel else 0.0)
    return found


@pytest.mark.parametrize(
    "of",
    [
        {"gun": Background(0.7), "contact": Background(0.3), "plate": Background(0.9)},
        {"contact": Background(0.0, 0.6)},
        {"gun": Background(0.0, 0.0, 1.3), "plate": Background(0.0, 0.0, 0.4, 0.5)},
        {"plate": Background(0.0, gain=(0.6, 0.0))},
        {name: Background(0.5, 0.4, 0.3, 0.2, (0.7, 1.1)) for name in ("gun", "contact", "plate")},
    ],
)
def test_covariance_of_a_background_is_what_its_equation_says(of: dict[str, Background]) -> None:
    np.testing.assert_allclose(bench()[2].background(of), by_hand(of), rtol=1e-12, atol=1e-14)


def test_kernels_are_of_the_configurations_that_are_left() -> None:
    gap, cells, kernels = bench()
    assert kernels.distance.shape == (9, 9)
    np.testing.assert_array_equal(kernels.loudness["gun"], gap.loudness["gun"][gap.rows])
    assert list(kernels.stage) == [OBSERVABLES[o].stage for o in cells.observable]
    assert all(course.root.shape[0] == 9 for course in kernels.courses("gun"))


def sizes(one: Background) -> tuple[float, float, float]:
    return one.constant, one.smooth, one.white


def members() -> list[Background]:
    """All there are, of every kind of bench."""
    every = [of for stages in (("gun",), ("plate",), ("gun", "plate")) for of in bank(stages)]
    return list(dict.fromkeys(one for of in every for one in of.values()))


def test_bank_runs_from_nothing_to_about_the_tolerance() -> None:
    """A larger error is a gap; details are met as badly as amplitudes, or seven times better."""
    assert Background(0.0) in members()
    for one in members():
        assert all(size >= 0 for size in (*sizes(one), *one.gain))
        assert np.linalg.norm(sizes(one)) < 1.2
        assert np.linalg.norm(one.gain) < 1 + 1e-9
        assert one.detail == 1 or 1 / one.detail == pytest.approx(7, abs=0.5)
    largest = max(BANK, key=lambda one: float(np.linalg.norm(sizes(one))))
    assert np.linalg.norm(sizes(largest)) > 1


def test_bank_holds_each_manner_alone_and_all_of_them_together() -> None:
    """Eight sets of amplitudes; each but nothing twice, with details of either kind."""
    every = set(map(sizes, BANK))
    assert len(every) == 8
    manners = [tuple(size > 0 for size in each) for each in every]
    alone = [(True, False, False), (False, True, False), (False, False, True)]
    assert [manners.count(one) for one in alone] == [2, 1, 1]
    assert manners.count((True, True, True)) == 3
    for each in every - {(0.0, 0.0, 0.0)}:
        assert len({one.detail for one in BANK if sizes(one) == each}) == 2
    assert not any(any(one.gain) for one in BANK)


def test_plates_are_off_by_the_same_everywhere_and_their_sensors_from_one_to_the_next() -> None:
    assert len(PLATE_BANK) == 14
    assert all(one.constant > 0 for one in PLATE_BANK if one != Background(0.0))
    steady = [one for one in PLATE_BANK if all(one.gain)]
    assert len(steady) == 10
    assert not any(one.smooth or one.white for one in steady)


def test_a_front_and_a_plate_have_backgrounds_of_their_own_each_with_each() -> None:
    """Nothing, four by four, and the largest of both."""
    every = [(of["gun"], of["plate"]) for of in bank(("gun", "contact", "plate"))]
    assert all(of["gun"] == of["contact"] for of in bank(("gun", "contact", "plate")))
    assert len(every) == 18
    assert every[0] == (Background(0.0), Background(0.0))
    fronts, behind = {front for front, _ in every[1:17]}, {plate for _, plate in every[1:17]}
    assert len(fronts) == len(behind) == 4
    assert fronts <= set(BANK)
    assert behind | {every[-1][1]} <= set(PLATE_BANK)
    assert every[-1][1].constant == max(one.constant for one in PLATE_BANK)
    assert every[-1][1].gain == max(one.gain for one in PLATE_BANK)
    assert {front for front, _ in ((of["gun"], of["plate"]) for of in under(("gun", "plate")))} == fronts


@pytest.mark.parametrize("stages", [("gun",), ("plate",), ("gun", "plate")])
def test_nothing_may_always_lie_under_a_gap(stages: tuple[str, ...]) -> None:
    always = under(stages)
    assert dict.fromkeys(stages, Background(0.0)) in always
    assert len(always) in (4, 5)
    assert len({tuple(one.items()) for one in always}) == len(always)


def test_small_gains_may_lie_under_a_gap_with_details_of_either_kind() -> None:
    small = [one["plate"] for one in under(("plate",)) if any(one["plate"].gain)]
    least = min(small, key=lambda one: one.constant)
    assert {replace(least, detail=one.detail) for one in PLATE_BANK} <= set(small)
