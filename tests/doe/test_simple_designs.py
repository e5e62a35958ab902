"""Designs that need no search: every treatment, somebody's table, and what makes good lost runs."""

from __future__ import annotations

import csv
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyroshock.doe.designs.augment import augment
from pyroshock.doe.designs.base import Design
from pyroshock.doe.designs.factorial import factorial, subset
from pyroshock.doe.designs.imported import read_table
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.space import Space, gun_space, hammer_space

GUN, HAMMER = gun_space(), hammer_space()
HEADER = "run," + ",".join(GUN.columns)
FIRST = "1,aluminum,none,none,PLA,30,1,high"


def _table(folder: Path, *lines: str) -> Path:
    file = folder / "plan.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


class Drawn:
    """Draws further treatments at random, without repeats: the simplest choice that keeps the
    contract."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.seen: NDArray[np.int64] | None = None

    def __call__(self, space: Space, n: int, fixed: NDArray[np.int64]) -> Design:
        self.seen = fixed
        every = self.rng.permutation(space.all_treatments())
        new = [row for row in every.tolist() if row not in fixed.tolist()]
        return Design(space, np.array((new + every.tolist())[:n]), "drawn", 7)


@pytest.mark.parametrize("space", [GUN, HAMMER], ids=["gun", "hammer"])
def test_factorial_holds_every_treatment_once(space: Space) -> None:
    design = factorial(space)
    assert len({tuple(row.values()) for row in design.rows}) == len(design.treatments) == space.size


def test_factorial_is_balanced() -> None:
    treatments = factorial(GUN).treatments
    for column, axis in enumerate(GUN.axes):
        assert np.bincount(treatments[:, column]).tolist() == [810 // axis.size] * axis.size
    with pytest.raises(ValueError, match="plate_material is 2; expected 0 to 1"):
        Design(GUN, np.array([[2, 0, 0, 0, 0, 0]]), "own", None)


@pytest.mark.parametrize("reduction", [1, 10**6])
def test_reduction_beyond_the_levels_is_refused(reduction: int) -> None:
    with pytest.raises(ValueError, match=f"reduction is {reduction}; expected 2 to"):
        subset(GUN, reduction)


def test_table_a_1(thesis_tables: Path) -> None:
    """The printed design is neither distinct nor balanced, and comes back cell by cell."""
    # The printed design is neither distinct nor balanced.
    design = read_table(thesis_tables / "table_a1_lhs_105_runs.csv", GUN)
    assert design.runs == tuple(range(1, 106))
    assert len(np.unique(design.treatments, axis=0)) == 98
    counts = {column: Counter(row[column] for row in design.rows) for column in GUN.columns}
    assert counts["plate_material"] == {"aluminum": 65, "steel": 40}
    assert counts["anvil_material"] == {"none": 27, "aluminum": 47, "steel": 31}
    path = thesis_tables / "table_a1_lhs_105_runs.csv"
    with path.open(newline="") as handle:
        printed = list(csv.DictReader(handle))
    design = read_table(path, GUN)
    assert [
        {"run": str(run), **row} for run, row in zip(design.runs, design.rows, strict=True)
    ] == printed


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.sampled_from(",;"), st.booleans(), st.sampled_from(["\n", "\r\n"]))
def test_written_table_is_read_back(
    tmp_path_factory: pytest.TempPathFactory, seed: int, delimiter: str, marked: bool, ending: str
) -> None:
    rng = np.random.default_rng(seed)
    treatments = rng.integers([axis.size for axis in HAMMER.axes], size=(15, 5))
    runs = rng.choice(1000, size=15, replace=False) + 1
    columns = rng.permutation(["run", *HAMMER.columns]).tolist()
    lines = [
        columns,
        *(
            [{"run": str(run), **row}[column] for column in columns]
            for run, row in zip(runs, HAMMER.rows(treatments), strict=True)
        ),
    ]
    file = tmp_path_factory.mktemp("table") / "plan.csv"
    file.write_bytes(
        ending.join(delimiter.join(cells) for cells in lines).encode(
            "utf-8-sig" if marked else "utf-8"
        )
    )
    design = read_table(file, HAMMER)
    assert np.array_equal(design.treatments, treatments)
    assert design.runs == tuple(runs.tolist())


def test_tables_as_laboratories_write_them(tmp_path: Path) -> None:
    design = read_table(_table(tmp_path, HEADER, FIRST, FIRST.replace("1", "2", 1)), GUN)
    assert design.runs == (1, 2) and np.array_equal(design.treatments[0], design.treatments[1])
    lines = [HEADER, "", FIRST.replace(",1,high", ",0_2,high"), ",,,,,,,"]
    design = read_table(
        _table(tmp_path, *(line.replace(",", ";").replace("_2", ",2") for line in lines)), GUN
    )
    assert design.rows[0]["bullet_mass_kg"] == "0.2"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([""], "empty; expected a header"),
        ([HEADER], "no runs below the header"),
        (
            [HEADER + ",colour", FIRST + ",red"],
            "unknown column 'colour'; expected run, plate_material",
        ),
        ([HEADER.replace("run,", ""), FIRST[2:]], "column 'run' is missing"),
        ([HEADER.replace(",insulator", ""), FIRST], "column 'insulator' is missing"),
        (
            [HEADER.replace("insulator", "anvil_material"), FIRST],
            "column 'anvil_material' stands 2 times",
        ),
        ([HEADER, FIRST, "2,steel"], "row 3: 2 cells; expected 8"),
        ([HEADER, FIRST, FIRST], "row 3: run 1 stands in row 2 too"),
        ([HEADER, FIRST.replace("1", "0", 1)], "row 2: run is '0'; expected a whole number from 1"),
        ([HEADER, FIRST.replace("1", "1.5", 1)], "run is '1.5'"),
        ([HEADER, FIRST.replace("1", "9" * 30, 1)], "expected a whole number"),
        (
            [HEADER, FIRST.replace("PLA", "gold")],
            "run 1: tip_material is 'gold'; expected one of PLA",
        ),
        ([HEADER, FIRST.replace("none,none", "none,polymeric")], "run 1: insulator = polymeric"),
        ([HEADER, FIRST.replace("PLA", '"PLA')], "unexpected end of data"),
    ],
)
def test_bad_table_is_refused_with_its_name(tmp_path: Path, lines: list[str], message: str) -> None:
    file = _table(tmp_path, *lines)
    with pytest.raises(ValueError, match=re.escape(message)) as refusal:
        read_table(file, GUN)
    assert str(refusal.value).startswith(str(file))


def test_unreadable_table_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "plan.csv"
    file.write_bytes((HEADER + "\n" + FIRST.replace("PLA", "Flüssig")).encode("latin-1"))
    with pytest.raises(ValueError, match="not UTF-8"):
        read_table(file, GUN)
    with pytest.raises(FileNotFoundError):
        read_table(tmp_path / "nowhere.csv", GUN)


def test_lost_runs_are_replaced() -> None:
    recorded = factorial(HAMMER).treatments[:150]
    design = augment(HAMMER, recorded, 30, Drawn(1))
    assert design.method == "augment" and design.seed == 7
    assert len(np.unique(np.vstack([recorded, design.treatments]), axis=0)) == 180
    recorded = HAMMER.all_treatments()[:5]
    chooser = Drawn(2)
    augment(HAMMER, recorded, 3, chooser)
    assert chooser.seen is not None and np.array_equal(chooser.seen, recorded)
    assert not np.shares_memory(chooser.seen, recorded)
    with pytest.raises(ValueError, match="0 of the chosen treatments are new; expected 3"):
        augment(HAMMER, recorded, 3, _repeats)
    with pytest.raises(ValueError, match="2 treatments of space 'hammer' were chosen; expected 3"):
        augment(HAMMER, recorded, 3, _too_few)
    with pytest.raises(ValueError, match="space 'gun' were chosen; expected 3 of 'hammer'"):
        augment(HAMMER, recorded, 3, _elsewhere)
    with pytest.raises(ValueError, match="n is 0; expected at least 1"):
        augment(HAMMER, HAMMER.all_treatments(), 0, Drawn(1))
    with pytest.raises(ValueError, match="impact_position is 9"):
        augment(HAMMER, np.full((1, 5), 9), 1, Drawn(1))


def _level_spread(treatments: NDArray[np.int64]) -> int:
    """Largest difference between the counts of two levels of the hammer's axes."""
    columns = zip(treatments.T, HAMMER.axes, strict=True)
    return max(int(np.ptp(np.bincount(column, minlength=axis.size))) for column, axis in columns)


def test_balance_is_restored() -> None:
    """Of 36 balanced runs six were lost, all with the plate fixed: the six new ones make up for
    it."""
    rng = np.random.default_rng(5)
    planned = balance_levels(HAMMER, 36, rng, steps=300).treatments
    lost = np.flatnonzero(planned[:, 4] == 1)[:6]
    recorded = np.delete(planned, lost, axis=0)

    def choose(space: Space, n: int, fixed: NDArray[np.int64]) -> Design:
        return balance_levels(space, n, rng, fixed=fixed, steps=300)

    assert _level_spread(recorded) >= 6
    repaired = np.vstack([recorded, augment(HAMMER, recorded, 6, choose).treatments])
    assert _level_spread(repaired) <= 1 and len(np.unique(repaired, axis=0)) == 36


@settings(max_examples=30)
@given(st.integers(0, 200), st.integers(1, 60), st.integers(0, 2**32))
def test_additions_are_new_while_new_ones_remain(recorded: int, n: int, seed: int) -> None:
    before = np.random.default_rng(seed).permutation(np.vstack([HAMMER.all_treatments()] * 2))[
        :recorded
    ]
    after = np.vstack([before, augment(HAMMER, before, n, Drawn(seed)).treatments])
    distinct = len(np.unique(before, axis=0)) if recorded else 0
    assert len(np.unique(after, axis=0)) == min(180, distinct + n)


def _repeats(space: Space, n: int, fixed: NDArray[np.int64]) -> Design:
    return Design(space, np.repeat(fixed[:1], n, axis=0), "own", None)


def _too_few(space: Space, n: int, fixed: NDArray[np.int64]) -> Design:
    return Design(space, space.all_treatments()[-n + 1 :], "own", None)


def _elsewhere(space: Space, n: int, fixed: NDArray[np.int64]) -> Design:
    return Design(GUN, GUN.all_treatments()[:n], "own", None)
