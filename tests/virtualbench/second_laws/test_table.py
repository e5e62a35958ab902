"""Which laws there are."""

from __future__ import annotations

import pytest
from pyroshock.virtualbench.effects import CATALOGUE
from pyroshock.virtualbench.second_laws import LAWS, SPLITS, law_of


def test_every_effect_has_a_law_for_each_split() -> None:
    effects = {name for name in CATALOGUE if not name.startswith("bench.")}
    assert set(LAWS) == {(effect, split) for effect in effects for split in SPLITS}


def test_splits_share_no_law() -> None:
    texts = [law.text for law in LAWS.values()]
    assert len(set(texts)) == len(texts)
    assert all(law.source for law in LAWS.values())


def test_law_of_no_effect_is_refused() -> None:
    with pytest.raises(ValueError, match=r"gun\.wear"):
        law_of("gun.wear", "sealed")
