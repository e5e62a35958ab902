"""Columns of a gun's runs.csv with a form of their own: the profile of its valve."""

from __future__ import annotations

import pytest
from pyroshock.schema.campaigns import Factor, FactorLevel
from sqlalchemy import select
from support.records.campaigns import gun_rows, with_cell, write_runs
from support.stores.stores import ingested, opened


def labels(url: str, factor: str) -> list[str]:
    with opened(url) as store, store.reading() as session:
        query = select(FactorLevel.label).join(Factor).where(Factor.name == factor).order_by(FactorLevel.id)
        return list(session.scalars(query))


def test_a_profile_in_two_spellings_is_one_level(sqlite_url, gun_folder):
    rows = with_cell(gun_rows(), "valve_profile", "0:0, 0.1:1,0.40:1, 0.5:0.0", 0)
    write_runs(gun_folder, with_cell(rows, "valve_profile", "0:0 0.1:1 0.4:1 0.5:0", 1), ";")
    ingested(sqlite_url, gun_folder)
    assert labels(sqlite_url, "valve_profile") == ["0:0 0.1:1 0.4:1 0.5:0"]


@pytest.mark.parametrize("text", ["0:0 0.1", "0.1:0 0:1", "0:3"])
def test_a_text_that_is_no_profile_is_refused(gun_folder, refused, text):
    write_runs(gun_folder, with_cell(gun_rows(), "valve_profile", text))
    refused(gun_folder, "runs.csv: row 2, column 'valve_profile'", repr(text), "expected points TIME:POSITION")
