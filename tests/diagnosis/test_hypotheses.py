"""Shares of what may be the matter sum to one."""

from __future__ import annotations

import pytest
from pyroshock.diagnosis.hypotheses import Priors


def test_shares_are_those_of_the_report() -> None:
    """docs/diagnosis.md: none 0.2, single effects 0.5, pairs 0.1, unknown 0.2."""
    priors = Priors()
    assert (priors.none, priors.singles, priors.pairs, priors.unknown) == (0.2, 0.5, 0.1, 0.2)


@pytest.mark.parametrize("shares", [(0.3, 0.6, 0.0, 0.1), (0.0, 1.0, 0.0, 0.0), (0.1, 0.2, 0.3, 0.4)])
def test_a_share_may_be_nothing(shares: tuple[float, float, float, float]) -> None:
    priors = Priors(*shares)
    assert (priors.none, priors.singles, priors.pairs, priors.unknown) == shares


@pytest.mark.parametrize(
    "shares", [(-0.2, 0.8, 0.2, 0.2), (0.2, 0.5, 0.1, 0.1), (0.2, 0.5, 0.1, 0.6), (0.2, 0.5, 0.1, 0.2 + 1e-6)]
)
def test_shares_below_nothing_or_not_of_one_are_refused(shares: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match="none, singles, pairs, unknown that sum to one"):
        Priors(*shares)
