"""JSON in the store: what goes in comes out, on both engines."""

from __future__ import annotations

import datetime as dt
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.schema.base import from_plain, to_plain
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import select

TEXT = st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]))
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


def same(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return type(a) is type(b) and a == b


@given(VALUES)
def test_plain_and_back_is_the_same(value):
    text = json.dumps(to_plain(value), allow_nan=False)
    assert same(from_plain(json.loads(text)), value)


def test_numpy_becomes_python():
    value = {"a": np.float32(0.5), "b": np.arange(3), "c": np.bool_(True), "d": (np.nan, 1)}
    plain = to_plain(value)
    assert plain == {"a": 0.5, "b": [0, 1, 2], "c": True, "d": [{"$float": "nan"}, 1]}
    with pytest.raises(TypeError, match="object"):
        to_plain(object())


def test_both_engines_store_what_json_has_not(database_url):
    report = {"nan": math.nan, "inf": -math.inf, "text": "half \ud800 and nul \x00", "list": [np.float64(1.5)]}
    with open_store(database_url, Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            session.add(Campaign(name="c", kind="gun", date=dt.date(2026, 1, 1), fingerprint="f"))
            session.flush()
            when = dt.datetime(2026, 1, 1, tzinfo=dt.UTC)
            session.add(Diagnosis(campaign_id=1, simulator="s", report=report, diagnosed_at=when))
        with store.reading() as session:
            back = session.scalars(select(Diagnosis.report)).one()
    assert math.isnan(back["nan"])
    assert back["inf"] == -math.inf
    assert back["text"] == "half ? and nul \ufffd"
    assert back["list"] == [1.5]
