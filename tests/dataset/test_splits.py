"""Splits: by property, over every text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import concatenate, expand, split_of
from support.records.pulse_tables import pulse_table

TABLE = pulse_table(np.random.default_rng(5), positions=3)
TWO = concatenate([TABLE, pulse_table(np.random.default_rng(6), campaign="autumn")])
TEXTS = (
    "repetitions",
    "configurations",
    "treatments",
    "material=steel",
    "material=delrin",
    "campaign=autumn",
)


@pytest.mark.parametrize("text", TEXTS)
def test_every_pulse_stands_on_one_side(text):
    split = split_of(TWO, text)
    assert sorted([*split.train, *split.test]) == list(range(len(TWO)))


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("seed", [0, 7])
def test_order_of_rows_does_not_matter(text, seed):
    order = np.random.default_rng(1).permutation(len(TWO))
    shuffled = TWO.take(order)
    held_out = {*TWO.key[split_of(TWO, text, seed).test]}
    assert {*shuffled.key[split_of(shuffled, text, seed).test]} == held_out


def test_thesis_split_is_1440_to_360():
    split = split_of(TABLE, "repetitions")
    assert (len(split.train), len(split.test)) == (1440, 360)
    _, counts = np.unique(TABLE.configuration[split.test], return_counts=True)
    assert counts.tolist() == [2] * 180
    other = replace(TABLE, key=np.array([f"other-{key}" for key in TABLE.key]))
    assert np.array_equal(split_of(TABLE, "repetitions").test, split_of(other, "repetitions").test)
    apart = replace(
        TABLE,
        configuration=np.char.add("x", TABLE.configuration),
        campaign=np.full(len(TABLE), "x"),
    )
    alone, joined = (
        split_of(TABLE, "repetitions"),
        split_of(concatenate([TABLE, apart]), "repetitions"),
    )
    assert joined.test[joined.test < len(TABLE)].tolist() == alone.test.tolist()
    # Why there is a split by treatment: other positions of the same treatment stand in training.
    split = split_of(TABLE, "configurations")
    assert {*TABLE.treatment[split.test]} <= {*TABLE.treatment[split.train]}
    # 2 of 10 in each of 180 configurations and 20 seeds: 720 per repetition, deviation 24 by the
    # binomial law.
    drawn = sum(
        np.bincount(TABLE.repetition[split_of(TABLE, "repetitions", s).test]) for s in range(20)
    )
    assert np.all(np.abs(drawn[1:] - 720) < 4.5 * 24)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("names", "held_out"), [("configuration", 36), ("treatment", 6)])
def test_configurations_and_treatments_are_never_parted(names, held_out, seed):
    split = split_of(TABLE, f"{names}s", seed)
    training, test = ({*getattr(TABLE, names)[rows]} for rows in (split.train, split.test))
    assert not training & test
    assert len(test) == held_out


def test_left_out_material_or_campaign_is_nowhere_in_training():
    split = split_of(TABLE, "material=steel")
    assert "steel" not in {*TABLE.tip_material[split.train], *TABLE.target_material[split.train]}
    assert np.all(TABLE.target_material[split.test] == "steel")
    assert {*TWO.campaign[split_of(TWO, "campaign=autumn").test]} == {"autumn"}


@pytest.mark.parametrize("text", ["repetitions", "configurations", "treatments"])
def test_another_seed_draws_others(text):
    drawn = {tuple(split_of(TABLE, text, seed).test) for seed in range(8)}
    assert len(drawn) > 4


@pytest.mark.parametrize(("repetitions", "held_out"), [(2, 1), (3, 1), (7, 1), (8, 2), (13, 3)])
def test_a_fifth_of_the_repetitions_at_least_one(repetitions, held_out):
    table = pulse_table(np.random.default_rng(0), repetitions=repetitions)
    assert len(split_of(table, "repetitions").test) == 60 * held_out


def test_split_without_two_sides_is_refused():
    table = pulse_table(np.random.default_rng(0), repetitions=1)
    with pytest.raises(
        ValueError, match="split 'repetitions' of 60 pulses: no pulse would be held out"
    ):
        split_of(table, "repetitions")
    with pytest.raises(ValueError, match="every pulse would be held out"):
        split_of(TABLE, "campaign=synthetic")
    with pytest.raises(
        LookupError, match=r"no material 'wood'.*there: aluminum, delrin, polyurethane, steel"
    ):
        split_of(TABLE, "material=wood")


@pytest.mark.parametrize("text", ["", "halves", "material", "material=", "repetitions=2", "=steel"])
def test_unknown_split_is_refused_with_those_known(text):
    with pytest.raises(
        ValueError, match=r"expected one of repetitions, .*, material=NAME, campaign=NAME"
    ):
        split_of(TABLE, text)


def test_expansion_leaves_out_one_after_the_other():
    assert expand(TABLE, "materials") == (
        "material=aluminum", "material=delrin", "material=polyurethane", "material=steel"
    )  # fmt: skip
    assert expand(TWO, "campaigns") == ("campaign=autumn", "campaign=synthetic")
    assert expand(TABLE, "campaigns") == ()
    assert expand(TABLE, "repetitions") == ("repetitions",)
    aluminum = TABLE.take(TABLE.target_material == "aluminum")
    assert expand(aluminum, "materials") == ("material=delrin", "material=polyurethane")
