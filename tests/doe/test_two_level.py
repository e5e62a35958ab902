"""Two-level designs against the tables of their authors."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.doe.designs import pydoe
from pyroshock.doe.designs.two_level import (
    fractional_factorial,
    plackett_burman,
    smallest_generators,
)
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit.quality import Alias, alias_lines, aliases, quality
from pyroshock.doe.space import Space, gun_space, space_of

#: Plackett and Burman, Biometrika 33 (1946), the first row for N = 12; the others are its shifts,
#: and one of -1.
FIRST_ROW_12 = (1, 1, -1, 1, 1, 1, -1, -1, -1, 1, -1)
#: Box, Hunter and Hunter, Statistics for Experimenters, Table 6.22: 2^(7-4) of resolution III.
TABLE_7_4 = {
    "A = B*D = C*E = F*G",
    "B = A*D = C*F = E*G",
    "C = A*E = B*F = D*G",
    "D = A*B = C*G = E*F",
    "E = A*C = B*G = D*F",
    "F = A*G = B*C = D*E",
    "G = A*F = B*E = C*D",
}


def two_level_space(names: str) -> Space:
    return space_of(
        "s",
        "hammer",
        [DesignFactor(n.lower(), n.lower(), ("low", "high"), None, True, 0) for n in names],
    )


def test_number_of_runs_follows_the_authors() -> None:
    # pyDOE3 has the table with all signs changed and its columns from last to first, which is the
    # same design.
    published = {tuple(np.roll(FIRST_ROW_12, shift)) for shift in range(11)} | {(-1,) * 11}
    assert {tuple(-row[::-1]) for row in pydoe.plackett_burman(11).astype(int)} == published
    with pytest.raises(ValueError, match="24 factors; pyDOE3 has no"):
        pydoe.plackett_burman(24)


@pytest.mark.parametrize("factors", [3, 7, 11, 15, 19, 23])
def test_plackett_burman_is_orthogonal(factors: int) -> None:
    space = two_level_space("abcdefghijklmnopqrstuvw"[:factors])
    judged = quality(space, plackett_burman(space).treatments)
    assert judged.runs == 4 * (factors // 4 + 1)
    assert (judged.worst_level, judged.largest_correlation) == (0, pytest.approx(0, abs=1e-9))
    assert judged.d_efficiency == pytest.approx(1.0)


def test_aliases_of_seven_factors_in_eight_runs_are_those_of_the_table() -> None:
    space = two_level_space("ABCDEFG")
    design = fractional_factorial(space, generators="a b c ab ac bc abc")
    assert len(design.treatments) == 8
    assert {line.upper() for line in alias_lines(aliases(space, design.treatments))} == TABLE_7_4
    assert aliases(gun_space(), gun_space().all_treatments()) == ()
    space = two_level_space("abc")
    alias_rows = aliases(space, fractional_factorial(space, generators="a b -ab").treatments)
    assert Alias("c", "a*b", -1.0) in alias_rows
    assert "a = -b*c" in alias_lines(alias_rows)
    screening = two_level_space("abcdefghijk")
    lines = alias_lines(aliases(screening, plackett_burman(screening).treatments))
    assert lines[-1].endswith(
        "aliased in part, by up to 0.33"
    )  # of 1/3: Lin and Draper, Technometrics 34 (1992)
    assert smallest_generators(4, 3) == "a b c abc"
    assert smallest_generators(5, 4) == "a b c d abcd"
    space = gun_space()
    with pytest.raises(ValueError, match="anvil_material\\+insulator has 5 levels without order"):
        fractional_factorial(space)
    rows = space.rows(fractional_factorial(space, categorical="first-last").treatments)
    assert {row["tip_material"] for row in rows} == {"PLA", "steel"}
    assert {row["tip_radius_mm"] for row in rows} == {"30", "60"}
    assert {(row["anvil_material"], row["insulator"]) for row in rows} == {
        ("none", "none"),
        ("steel", "polymeric"),
    }


@pytest.mark.parametrize(
    "generators", ["a b ab", "a b c abc", "a b c d abc abd", "a b c d e abcde", "a b c ab ac"]
)
def test_groups_of_aliases_are_those_of_pydoe(generators: str) -> None:
    """Up to interactions of two factors."""
    from pyDOE3 import fracfact_aliasing

    names = "abcdefgh"[: len(generators.split())]
    space = two_level_space(names)
    groups = [
        [word for word in group.split(" = ") if len(word) <= 2]
        for group in fracfact_aliasing(pydoe.two_level(generators))[0]
    ]
    expected = {" = ".join("*".join(word) for word in group) for group in groups if len(group) > 1}
    treatments = fractional_factorial(space, generators=generators).treatments
    assert set(alias_lines(aliases(space, treatments))) == expected


@pytest.mark.parametrize(
    ("factors", "resolution", "runs"),
    [
        *(
            (3, 3, 4),
            (5, 3, 8),
            (7, 3, 8),
            (11, 3, 16),
            (15, 3, 16),
            (4, 4, 8),
            (6, 4, 16),
            (8, 4, 16),
            (9, 4, 32),
        ),
        *((5, 5, 16), (6, 5, 32), (8, 5, 64), (10, 5, 128), (7, 7, 64), (3, 5, 8), (1, 3, 2)),
    ],
)
def test_fewest_runs_of_a_resolution_are_those_of_the_table(
    factors: int, resolution: int, runs: int
) -> None:
    """Box, Hunter and Hunter, Table 6.22; a full factorial where no fraction has the resolution."""
    coded = pydoe.two_level(smallest_generators(factors, resolution))
    assert coded.shape == (runs, factors)
    assert _resolution(coded) >= resolution


def _resolution(coded: np.ndarray) -> float:
    """Length of the shortest product of columns that is constant; without a fraction there is
    none."""
    factors = coded.shape[1]
    products = {mask: np.prod(coded[:, [i for i in range(factors) if mask >> i & 1]],
    axis=1) for mask in
                range(1, 2**factors)} if factors <= 11 else {}  # fmt: skip
    lengths = [
        mask.bit_count() for mask, product in products.items() if abs(product.sum()) == len(coded)
    ]
    return min(lengths, default=99)


@pytest.mark.parametrize(
    ("generators", "message"),
    [
        ("a b ab", "give 3 columns; expected 6: plate_material"),
        ("a b c d ab ab", "generators are"),
        ("a b c d e g", "a letter of its own"),
        ("a b c d e xy", "generators are"),
        ("", "give 0 columns"),
    ],
)
def test_generators_that_do_not_fit_are_refused(generators: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fractional_factorial(gun_space(), generators=generators, categorical="first-last")


@pytest.mark.parametrize(("factors", "resolution"), [(4, 2), (0, 3), (21, 3)])
def test_what_no_fraction_has_is_refused(factors: int, resolution: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        smallest_generators(factors, resolution)
