"""Factors and rules one by one, the file in which a lab writes them, and rules in the words of
campaign files."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.doe.factor_rules import holds, rules, short_between
from pyroshock.doe.factors import DesignFactor, Requirement, Tie, connected, number_label
from pyroshock.doe.space import Space, read_space
from support.records.toy_bench import Design

RADIUS = DesignFactor(
    "tip_radius", "tip_radius_mm", ("30", "45", "60"), (30.0, 45.0, 60.0), True, 0, "mm"
)
ANVIL = DesignFactor("anvil", "anvil", ("none", "aluminum", "steel"), None, False, 2)
INSULATOR = DesignFactor("insulator", "insulator", ("none", "polymeric"), None, False, 1)
NEEDS_ANVIL = Requirement("insulator", "polymeric", "anvil", ("aluminum", "steel"))

SPEEDS = (
    '[[factors]]\nname = "speed"\nkind = "ordered"\nlevels = ["low", '
    '"high"]\nunit = "m/s"\nvalues = [7, 22]\n'
)
FACTOR = '[[factors]]\nname = "anvil"\nkind = "categorical"\nlevels = ["none", "steel"]\n'
RADII = (
    '[[factors]]\nname = "radius"\ncolumn = "radius_mm"\nkind = "numeric"\nunit '
    '= "mm"\nlevels = [15, 30.0]\n'
)
HEAD = 'name = "own"\nkind = "gun"\n'


def _read(folder: Path, text: str) -> Space:
    file = folder / "factors.toml"
    file.write_text(text, encoding="utf-8")
    return read_space(file)


@pytest.mark.parametrize("cell", ["45", "45.0", " 45 ", "4.5e1", "45,0", "+45"])
def test_number_is_known_however_written(cell: str) -> None:
    assert RADIUS.index(cell) == 1


@pytest.mark.parametrize("cell", ["", "46", "4_5", "nan", "inf", "1,045.0", "45 mm", "٤٥", "high"])
def test_unknown_number_is_refused(cell: str) -> None:
    with pytest.raises(
        ValueError, match=re.escape(f"tip_radius_mm is {cell!r}; expected one of 30, 45, 60")
    ):
        RADIUS.index(cell)


def test_words_are_not_compared_as_numbers() -> None:
    position = DesignFactor("position_of_impact", "position_of_impact", ("1", "2"), None, False, 0)
    with pytest.raises(ValueError, match=r"'1\.0'; expected one of 1, 2"):
        position.index("1.0")
    assert DesignFactor("velocity", "velocity_m_s", ("10",), (10.0,), True, 0, "m/s").unit == "m/s"
    assert number_label(-0.0) == "0"


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_label_reads_back_to_twelve_digits(number: float) -> None:
    label = number_label(number)
    assert float(label) == pytest.approx(number, rel=1e-11, abs=1e-300)
    assert number_label(float(label)) == label


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "Tip radius"}, "name is 'Tip radius'"),
        ({"column": "run"}, "column is 'run'"),
        (
            {"column": "impact_velocity_m_s", "unit": "m/s"},
            "column is 'impact_velocity_m_s'; expected",
        ),
        ({"column": "tip_radius"}, "column is 'tip_radius'; expected a name that ends in '_mm'"),
        ({"unit": "m"}, "ends in '_m'"),
        ({"levels": ()}, "levels is empty"),
        ({"levels": ("30", "30", "60")}, "'30' stands twice"),
        ({"levels": ("30", " 45", "60")}, "' 45'"),
        ({"levels": ("30", "4\n5", "60")}, "expected printable text"),
        ({"numbers": (30.0, 45.0)}, "2 numbers; expected 3"),
        ({"numbers": (30.0, 60.0, 45.0)}, "rising order"),
        ({"numbers": (30.0, 30.0, 45.0)}, "rising order"),
        ({"numbers": (30.0, 45.0, math.inf)}, "finite"),
        ({"change": -1}, "change is -1"),
    ],
)
def test_bad_factor_is_refused_by_name(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        DesignFactor(**{**vars(RADIUS), **change})


def test_rules_chain_factors_into_groups() -> None:
    [(members, combinations)] = connected([ANVIL, INSULATOR], [NEEDS_ANVIL])
    assert members == (ANVIL, INSULATOR)
    assert combinations == ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1))
    names = [
        [factor.name for factor in members]
        for members, _ in connected([ANVIL, RADIUS, INSULATOR], [NEEDS_ANVIL])
    ]
    assert names == [["anvil", "insulator"], ["tip_radius"]]
    radius_of_anvil = Tie(
        ("anvil", "tip_radius"), (("none", "30"), ("aluminum", "45"), ("steel", "60"))
    )
    [(_, combinations)] = connected([RADIUS, ANVIL, INSULATOR], [NEEDS_ANVIL, radius_of_anvil])
    assert combinations == ((0, 0, 0), (1, 1, 0), (1, 1, 1), (2, 2, 0), (2, 2, 1))
    bare = Tie(("anvil", "insulator"), (("none", "polymeric"),))
    with pytest.raises(ValueError, match="no feasible combination"):
        connected([ANVIL, INSULATOR], [NEEDS_ANVIL, bare])
    levels = tuple(map(str, range(400)))
    factors = [DesignFactor(name, name, levels, None, False, 0) for name in ("a", "b", "c")]
    with pytest.raises(ValueError, match=r"a\+b\+c: more than 100000 combinations"):
        connected(factors, [Tie(("a", "b", "c"), ((levels[:3]),))])


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (
            Requirement("layer", "polymeric", "anvil", ("steel",)),
            "factor 'layer' is unknown; expected one of anvil",
        ),
        (
            Requirement("insulator", "foam", "anvil", ("steel",)),
            "'insulator' has no level 'foam'; expected one of none",
        ),
        (Requirement("insulator", "none", "anvil", ("brass",)), "'anvil' has no level 'brass'"),
        (Requirement("anvil", "none", "anvil", ("steel",)), "expected two or more different ones"),
        (Tie(("anvil",), (("none",),)), "expected two or more different ones"),
        (
            Tie(("anvil", "insulator"), (("none", "none"), ("steel", "polymeric"))),
            "level 'aluminum' is in no feasible",
        ),
    ],
)
def test_rule_that_fits_nothing_is_refused(rule: Requirement | Tie, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        connected([ANVIL, INSULATOR], [rule])


def test_a_labs_own_file(tmp_path: Path) -> None:
    tied = (
        '[[tied]]\nfactors = ["anvil", "radius"]\ncombinations = [["none", 15.0], ["steel", 30]]\n'
    )
    space = _read(
        tmp_path,
        HEAD + FACTOR + "change = 2\n" + RADII + tied + "[bench]\ntank_pressure_limit_pa = 2e6\n",
    )
    assert [axis.labels for axis in space.axes] == [("none/15", "steel/30")]
    assert space.factors[1].numbers == (15.0, 30.0) and space.factors[0].change == 2
    assert space.bench == {"tank_pressure_limit_pa": 2e6}
    [speed] = _read(tmp_path, HEAD + SPEEDS).factors
    assert (speed.values, speed.numbers, speed.unit, speed.ordered) == (
        (7.0, 22.0),
        None,
        "m/s",
        True,
    )
    with pytest.raises(ValueError, match="speed is '7'; expected one of low, high"):
        speed.index("7")
    assert _read(tmp_path, HEAD + FACTOR).columns == ("anvil",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = ", "not TOML"),
        ("x = " + "[" * 5000, "within each other hundreds deep; expected at most 16"),
        ('kind = "gun"\n' + FACTOR, "the file: key 'name' is missing"),
        (HEAD + "factors = []\n", "factors is empty; expected at least one"),
        (HEAD + "factors = 3\n", "factors is 3; expected tables [[factors]]"),
        (HEAD + "bench = 3\n" + FACTOR, "bench is 3; expected a table"),
        (HEAD.replace("gun", "rope") + FACTOR, "kind is 'rope'; expected one of hammer, gun"),
        (
            HEAD + 'colour = "red"\n' + FACTOR,
            "the file: unknown key 'colour'; known: name, kind, factors",
        ),
        (HEAD + FACTOR + "weight = 3\n", "[[factors]] 1: unknown key 'weight'; known: name, kind"),
        (HEAD + FACTOR + FACTOR, "name 'anvil' stands twice"),
        (
            HEAD + FACTOR + FACTOR.replace('"anvil"', '"base"\ncolumn = "anvil"'),
            "column 'anvil' stands twice",
        ),
        (
            HEAD + FACTOR.replace("categorical", "number"),
            "kind is 'number'; expected one of numeric, continuous, ordered",
        ),
        (
            HEAD + FACTOR + 'unit = "m"\n',
            "[[factors]] 1: unit is 'm'; expected one for a factor of numbers",
        ),
        (HEAD + RADII.replace('unit = "mm"', ""), "unit is None"),
        (HEAD + SPEEDS.replace('unit = "m/s"', ""), "unit is None"),
        (
            HEAD + SPEEDS.replace("7, 22", "22"),
            "factor 'speed': 1 numbers; expected 2, one per level",
        ),
        (HEAD + SPEEDS.replace("7, 22", "22, 7"), "rising order"),
        (
            HEAD + RADII + "values = [1, 2]\n",
            "values are given; expected them for an ordered factor",
        ),
        (HEAD + FACTOR + "change = true\n", "change is True; expected a whole number"),
        (
            HEAD + FACTOR.replace('["none", "steel"]', "[]"),
            "levels is []; expected a list with at least one",
        ),
        (HEAD + FACTOR.replace('["none", "steel"]', '"none"'), "levels is 'none'; expected a list"),
        (HEAD + FACTOR.replace('"none"', "1"), "level 1; expected a text in quotes"),
        (HEAD + FACTOR.replace("steel", "none"), "factor 'anvil': level 'none' stands twice"),
        (HEAD + RADII.replace("15", '"15"'), "level '15'; expected a number"),
        (HEAD + RADII.replace("15", "nan"), "expected finite numbers"),
        (HEAD + RADII.replace("15", "30"), "level '30' stands twice"),
        (HEAD + RADII.replace("15", "9" * 400), "beyond any number"),
        (HEAD + RADII.replace("15", "true"), "level True; expected a number"),
        (
            HEAD + FACTOR + RADII + '[[requires]]\nfactor = "anvil"\n',
            "[[requires]] 1: key 'level' is missing",
        ),
        (
            HEAD + FACTOR + RADII + "[[tied]]\nfactors = [1]\ncombinations = [[1]]\n",
            "[[tied]] 1: factors is [1]",
        ),
        (
            HEAD
            + FACTOR
            + RADII
            + '[[tied]]\nfactors = ["anvil", "radius"]\ncombinations = [["none"]]\n',
            "combination ['none']; expected a list of 2 levels",
        ),
    ],
)
def test_bad_file_is_refused_with_its_name(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)) as refusal:
        _read(tmp_path, text)
    assert str(refusal.value).startswith(str(tmp_path / "factors.toml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            RADII.replace('"radius_mm"', '"tip_radius_mm"'),
            "tables of runs know 'tip_radius' in 'tip_radius_mm', numeric",
        ),
        (
            RADII.replace('"radius"', '"tip_radius"'),
            "tables of runs know 'tip_radius' in 'tip_radius_mm'",
        ),
        (
            RADII.replace('"radius', '"tip_radius').replace("15", "0"),
            "tip_radius_mm has level '0'; expected a number abo",
        ),
        (
            FACTOR.replace("anvil", "bullet_mass_kg"),
            "categorical 'bullet_mass_kg' in column 'bullet_mass_kg'",
        ),
        (
            FACTOR.replace("anvil", "insulator"),
            "insulator has level 'steel'; expected one of none, polymeric",
        ),
    ],
)
def test_factor_that_recordings_know_otherwise_is_refused(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        _read(tmp_path, HEAD + text)


def test_unreadable_file_is_no_space(tmp_path: Path) -> None:
    file = tmp_path / "factors.toml"
    file.write_bytes((HEAD + FACTOR + "# Prüfstand").encode("latin-1"))
    with pytest.raises(ValueError, match="not UTF-8"):
        read_space(file)
    with pytest.raises(FileNotFoundError):
        read_space(tmp_path / "nowhere.toml")


SETTINGS = [configuration.factors for configuration in Design().configurations()]


def test_rules_for_the_same_settings_are_one() -> None:
    texts = [rule.text for rule in rules(SETTINGS)]
    assert "tank_pressure_bar > 3" in texts
    assert "insulator = polymeric" in texts
    assert "bullet_mass_kg <= 0.4" in texts
    texts = [rule.text for rule in rules(STRIKERS)]
    assert {f"striker = {word}" for word in WORDS} <= set(texts)
    assert "shot by whom = Ann" in texts
    assert "shot by whom = Bo and Cy" in texts
    three = [{"anvil_material": ["none", "steel", "aluminum"][i % 3]} for i in range(9)]
    assert "anvil_material != none" in [rule.text for rule in rules(three)]
    assert not any("!=" in rule.text for rule in rules(SETTINGS))
    assert len({rule.inside.tobytes() for rule in rules(SETTINGS)}) == len(rules(SETTINGS))
    # Only one bullet was ever shot by that striker.
    confounded = [
        {"bullet_mass": [0.25, 0.5][i % 2], "striker": ["127 mm", "254 mm"][i % 2]}
        for i in range(8)
    ]
    alike = {rule.text: rule.same for rule in rules(confounded)}
    assert alike["bullet_mass_kg > 0.4"] == ("striker = 254 mm",)
    with pytest.raises(LookupError, match="no factor 'weather'; there are: insulator"):
        holds("weather = dry", {"insulator": "none"})
    with pytest.raises(ValueError, match="is no rule"):
        holds("everywhere", {"insulator": "none"})


def test_a_rule_reads_back_as_what_it_holds_for() -> None:
    for rule in rules(SETTINGS):
        assert [holds(rule.text, setting) for setting in SETTINGS] == rule.inside.tolist()
    for rule in rules(STRIKERS):
        assert [holds(rule.text, setting) for setting in STRIKERS] == rule.inside.tolist(), (
            rule.text
        )
    # A column of lengths in which somebody wrote a word: the ingest keeps numbers as numbers.
    mixed = [{"striker": [254.0, 127.0, "long"][i % 3]} for i in range(9)]
    results = {rule.text: rule.inside.tolist() for rule in rules(mixed)}
    assert results["striker = 254"] == [i % 3 == 0 for i in range(9)]
    assert results["striker = long"] == [i % 3 == 2 for i in range(9)]
    mixed = [{"serial": [1000001.0, 1000002.0, "none"][i % 3]} for i in range(9)]
    assert {"serial = 1000001", "serial = 1000002"} <= {rule.text for rule in rules(mixed)}


#: As laboratories write them: lengths, names with an "and", signs, a number that is a name, a
#: column with blanks.
WORDS = ["254 mm", "127 mm", "PLA and steel", "a = b", "254"]
STRIKERS = [
    {
        "striker": WORDS[i % 5],
        "shot by whom": "Ann" if i % 2 else "Bo and Cy",
        "tank_pressure": 1e5 * i,
    }
    for i in range(20)
]


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_short_number_lies_between(low: float, apart: float) -> None:
    if low + apart > low:
        number = short_between(low, low + apart)
        assert low <= number < low + apart or np.isclose(number, low)
