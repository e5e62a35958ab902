from __future__ import annotations

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.validation.cases import (
    draw_case,
    label_of,
    new_key,
    open_labels,
    publish,
    record_case,
    seal_labels,
)
from pyroshock.validation.cases.case import KINDS, BackgroundGap, Case, Label
from pyroshock.validation.cases.designs import design
from pyroshock.virtualbench.recorder import SealError, folder_hash

QUIET = BackgroundGap(1e-9, 1e-9, 2.0, False, 1)


def drawn(kind: str, cause: str = "catalogue") -> Case:
    return draw_case(kind, "strong", np.random.default_rng(11), cause=cause, number=0)


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("kind", KINDS)
def test_folder_is_that_of_a_campaign_and_the_same_for_the_same_seed(
    kind: str, tmp_path: Path
) -> None:
    case = drawn(kind)
    record_case(case, tmp_path / "c", 1)
    rows = rows_of(tmp_path / "c")
    assert len(rows) == len(design(kind, 0)) * case.repetitions
    assert all((tmp_path / "c" / row["recording"]).is_file() for row in rows if "recording" in row)
    card = tomllib.loads((tmp_path / "c" / "campaign.toml").read_text())
    assert card["campaign"]["kind"] == ("gun" if kind in ("gun", "chain") else "hammer")
    assert set(card["bench"]) == {"gun": {"gun"}, "hammer": {"hammer"}, "plate": {"plate"}}.get(
        kind, {"gun", "plate"}
    )
    labels = [record_case(drawn(kind), tmp_path / name, 5, name="c") for name in ("a", "b")]
    assert labels[0] == labels[1]
    assert labels[0].folder_sha256 == folder_hash(tmp_path / "b")
    other = record_case(drawn(kind), tmp_path / "o", 6, name="c")
    assert other.folder_sha256 != labels[0].folder_sha256


def test_nothing_of_the_label_stands_in_the_folder(tmp_path: Path) -> None:
    label = record_case(drawn("gun"), tmp_path / "c", 1)
    text = "".join(
        path.read_text() for path in (tmp_path / "c").rglob("*") if path.suffix in (".csv", ".toml")
    )
    assert label.cause[0] not in text
    assert not [word for word in ("sealed", "strength", "family", "floor") if word in text]
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == ["campaign.toml", "runs.csv"]
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="already"):
        record_case(drawn("gun"), tmp_path, 1)


def test_recorded_velocities_show_the_change_of_the_label(tmp_path: Path) -> None:
    """Without background and with next to no scatter: measured over nominal is what the label
    says."""
    case = replace(drawn("gun", "gun.blow_by"), background=QUIET, floor=1e-9, decoys={})
    label = record_case(case, tmp_path / "a", 1)
    none = record_case(replace(case, strengths={}), tmp_path / "b", 1)
    first, second = (
        [float(r["measured_velocity_m_s"]) for r in rows_of(tmp_path / n)] for n in "ab"
    )
    runs = [tuple(str(v) for v in c.values()) for c in label.configurations]
    which = [
        runs.index(tuple(row[k] for k in label.configurations[0]))
        for row in rows_of(tmp_path / "a")
    ]
    np.testing.assert_allclose(
        np.log(first) - np.log(second), np.ravel(label.changes["gun"])[which], atol=1e-5
    )
    assert none.cause == ("none",)


def test_scatter_and_decoys_are_as_the_label_says(tmp_path: Path) -> None:
    case = replace(drawn("gun", "none"), background=QUIET, floor=1.0, repetitions=40)
    record_case(case, tmp_path / "c", 1)
    rows = rows_of(tmp_path / "c")
    groups: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        key = row["tank_pressure_bar"], row["bullet_mass_kg"]
        groups.setdefault(key, []).append(np.log(float(row["measured_velocity_m_s"])))
    pooled = np.sqrt(np.mean([np.var(values, ddof=1) for values in groups.values()]))
    assert pooled / np.sqrt(40) == pytest.approx(0.01, rel=0.1)
    case = replace(drawn("hammer", "none"), decoys={"mass_kg": 1.01})
    record_case(case, tmp_path / "decoy", 1)
    card = tomllib.loads((tmp_path / "decoy" / "campaign.toml").read_text())
    assert card["bench"]["hammer"]["mass_kg"] == pytest.approx(1.01 * 0.32)


@pytest.fixture(scope="module")
def labels() -> list[Label]:
    return [label_of(drawn("gun"), 1), label_of(drawn("hammer", "unknown"), 2)]


def test_sealed_labels_come_back_as_published(labels: list[Label], tmp_path: Path) -> None:
    key, file = new_key(), tmp_path / "labels"
    seal_labels(labels, file, key)
    assert open_labels(file, key, publish(labels, key)) == labels
    assert publish(labels, new_key()) != publish(labels, new_key())
    text = file.read_text()
    assert labels[0].cause[0] not in text
    assert labels[0].cause[0].encode().hex() not in text
    with pytest.raises(SealError, match="key"):
        open_labels(file, new_key())
    file.write_text(text[:-4] + ("0" if text[-4] != "0" else "1") + text[-3:])
    with pytest.raises(SealError, match="changed"):
        open_labels(file, key)


def test_hash_is_known_before_the_recording_and_other_labels_are_refused(
    labels: list[Label], tmp_path: Path
) -> None:
    key, case = new_key(), drawn("gun")
    before = publish([label_of(case, 1)], key)
    assert publish([record_case(case, tmp_path / "c", 1)], key) == before
    seal_labels([replace(labels[0], cause=("none",)), labels[1]], tmp_path / "labels", key)
    with pytest.raises(SealError, match="published"):
        open_labels(tmp_path / "labels", key, publish(labels, key))
