"""Sets of effects that stand for each other, of posteriors over sets whose answer is known."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.inference.credible_sets import (
    ESTABLISHED,
    Weighted,
    credible_sets,
    inclusion,
)


def posterior(**weights: float) -> Weighted:
    """By the letters of the effects that act: "ab" for two, "none" for no effect."""
    return [
        (frozenset("" if acting == "none" else acting), weight)
        for acting, weight in weights.items()
    ]


@pytest.mark.parametrize(("weighted", "sets"), [
    (posterior(a=0.95, b=0.05), [("a",)]),
    # neither is likelier than not by far, and one of them acts
    (posterior(a=0.52, b=0.48), [("a", "b")]),
    (posterior(ac=0.5, bc=0.47, a=0.03), [("c",), ("a", "b")]),
    (posterior(ab=0.5, cd=0.48, none=0.02), [("a", "c"), ("b", "d")]),  # two for two
    (posterior(a=0.4, b=0.35, c=0.25), [("a", "b", "c")]),
    # they act together as often as chance has it
    (posterior(ab=0.5, a=0.25, b=0.2, none=0.05), [("a",), ("b",)]),
    (posterior(a=0.5, none=0.5), []),
    (posterior(none=1.0), []),
    ([], []),
])  # fmt: skip
def test_effects_that_act_instead_of_each_other_are_one_set(
    weighted: Weighted, sets: list[tuple[str, ...]]
) -> None:
    assert credible_sets(weighted) == sets


ACTING = st.frozensets(st.sampled_from("abcdef"), max_size=4)


@given(st.dictionaries(ACTING, st.floats(0.01, 1.0), min_size=1, max_size=12))
def test_sets_are_disjoint_and_as_probable_as_promised(mass: dict[frozenset[str], float]) -> None:
    total = sum(mass.values())
    weighted = [(acting, weight / total) for acting, weight in mass.items()]
    sets = credible_sets(weighted)
    members = [name for own in sets for name in own]
    assert len(members) == len(set(members))
    for own in sets:
        assert inclusion(weighted, own) >= ESTABLISHED
        alone = [inclusion(weighted, {name}) for name in own]
        assert alone == sorted(alone, reverse=True)
        assert max(alone) <= inclusion(weighted, own) + 1e-12 <= sum(alone) + 1e-9
    # An effect that is as probable by itself is in a set.
    for name in "abcdef":
        assert name in members or inclusion(weighted, {name}) < ESTABLISHED
