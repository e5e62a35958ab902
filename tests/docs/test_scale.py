"""docs/measurements/scale.md shows every question that `make bench-scale` asks, and the questions can be asked."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.benchmarks.scale import MARK, QUESTIONS
from pyroshock.schema.impacts import Impact
from sqlalchemy import func, select
from support.records.campaigns import hammer_campaign
from support.stores.large_store import StoreSize, fill, sample_of
from support.stores.stores import ingested, opened

PAGE = Path(__file__).resolve().parents[2] / "docs" / "measurements" / "scale.md"


def test_page_shows_every_question():
    measured = PAGE.read_text(encoding="utf-8").split(MARK)[1]
    assert [name for name in (q.name for q in QUESTIONS) if f"| {name} |" not in measured] == []


@pytest.fixture(scope="module")
def large_store(tmp_path_factory):
    """Four small campaigns in the shape of the large ones, and what is in them."""
    folder = tmp_path_factory.mktemp("large")
    real, url = f"sqlite:///{folder}/real.db", f"sqlite:///{folder}/large.db"
    ingested(real, hammer_campaign(folder / "real", 1, 2))
    with opened(real) as store:
        size = StoreSize(4_000, 1_000, own_radii=True, sample=sample_of(store), series_every=20)
    fill(url, size)
    with opened(url) as store, store.reading() as session:
        yield session, size


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda q: q.name)
def test_questions_are_answered(large_store, question):
    session, size = large_store
    question.ask(session, size)
    assert session.scalar(select(func.count()).select_from(Impact)) == size.impacts
