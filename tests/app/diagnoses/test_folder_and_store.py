"""A campaign is diagnosed alike in its folder and in a store: the same figures of the same data."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.diagnose.diagnosing import report_json, run_diagnosis
from pyroshock.app.operations.diagnose.request import DiagnosisRequest
from pyroshock.diagnosis.reading import read_campaign, read_folder
from pyroshock.ingest.load import ingest_folder
from support.stores.stores import opened

#: Shares, sizes and probabilities of both reports agree to so much.
RELATIVE = 1e-9
#: Campaigns of a gun, a hammer and a plate, and one that all three stages explain.
CAMPAIGNS = ("gun-valve-flow", "hammer-effective-mass", "plate-damping", "slow-valve")


def numbers_of(report: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every entry of a report with its place in it."""
    if isinstance(report, dict):
        for name, part in report.items():
            if name != "seconds":  # how long it took is no figure of the data
                yield from numbers_of(part, f"{place}.{name}")
    elif isinstance(report, list):
        for i, part in enumerate(report):
            yield from numbers_of(part, f"{place}[{i}]")
    else:
        yield place, report


def folder_of(name: str, request: pytest.FixtureRequest) -> Path:
    """The folder that ships, else that of the played campaigns."""
    shipped = Path(__file__).parents[3] / "examples" / name
    return shipped if shipped.is_dir() else Path(request.getfixturevalue("examples") / name)


def assert_same(place: str, of_folder: Any, of_store: Any) -> None:
    """To the last bit: a diagnosis weighs hundreds of sets of effects, and may choose others where
    two records differ by the last digit of a double."""
    assert type(of_folder) is type(of_store), place
    if is_dataclass(of_folder):
        for item in fields(of_folder):
            entries = [getattr(record, item.name) for record in (of_folder, of_store)]
            assert_same(f"{place}.{item.name}", *entries)
    elif isinstance(of_folder, np.ndarray):
        assert of_folder.shape == of_store.shape and np.array_equal(
            of_folder, of_store, equal_nan=True
        ), place
    elif isinstance(of_folder, Mapping):
        assert list(of_folder) == list(of_store), place
        for name in of_folder:
            assert_same(f"{place}[{name}]", of_folder[name], of_store[name])
    elif isinstance(of_folder, list | tuple):
        assert len(of_folder) == len(of_store), place
        for i, parts in enumerate(zip(of_folder, of_store, strict=True)):
            assert_same(f"{place}[{i}]", *parts)
    else:
        assert of_folder == of_store or (of_folder != of_folder and of_store != of_store), place


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_folder_and_store_give_the_same_record(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    folder = folder_of(name, request)
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store:
        ingest_folder(store, folder)
        with store.reading() as session:
            assert_same(name, read_campaign(session, name), read_folder(folder))


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_folder_and_store_give_the_same_report(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    folder = folder_of(name, request)
    db = f"sqlite:///{tmp_path}/lab.db"
    with opened(db, create=True) as store:
        ingest_folder(store, folder)
        reports = [
            dict(numbers_of(json.loads(json.dumps(report_json(verdict)))))
            for verdict in (
                run_diagnosis(None, db, DiagnosisRequest(campaign=str(folder))),
                run_diagnosis(store, db, DiagnosisRequest(campaign=name)),
            )
        ]
    of_folder, of_store = reports
    assert of_folder.keys() == of_store.keys()
    for place, entry in of_folder.items():
        if isinstance(entry, float):
            assert np.isclose(entry, of_store[place], rtol=RELATIVE, atol=1e-12), place
        else:
            assert entry == of_store[place], place
