"""Settings for a spectrum from Python: the verdict first, targets in every form, and errors by
argument."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pint
import pyroshock as ps
import pytest
from pyroshock.app.operations.fields import TextFile
from pyroshock.app.operations.tune.bench_adapter import proposal_json
from pyroshock.app.operations.tune.request import SpectrumSearch, masses_of
from pyroshock.app.operations.tune.service import TunedSettings, target_of
from pyroshock.app.operations.tune.session import session_of
from pyroshock.app.operations.tune.verdict import answer_sentences
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.building import TwinRequest
from pyroshock.doe.space import shipped_factors
from pyroshock.twin.tune.space import ContinuousRange, Levels
from support.records.twin_parts import unsolved
from support.stores.stores import opened

SPEC = "frequency_hz,level_m_s2\n200,200\n800,3000\n"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty store, a target, and a laboratory that owns two tips and two radii."""
    folder = tmp_path_factory.mktemp("lab")
    with opened(f"sqlite:///{folder / 'lab.db'}", create=True):
        pass
    (folder / "spec.csv").write_text(SPEC)
    text = shipped_factors("gun").replace(
        'levels = ["PLA", "aluminum", "steel"]', 'levels = ["PLA", "steel"]'
    )
    (folder / "own.toml").write_text(text.replace("levels = [30, 45, 60]", "levels = [30, 60]"))
    return folder


@pytest.fixture
def store(
    lab: Path, notebook: None, monkeypatch: pytest.MonkeyPatch
) -> Iterator[ps.ExperimentStore]:
    monkeypatch.setattr(twins, "solved", partial(unsolved, points=1))
    with ps.open(lab / "lab.db", create=False) as store:
        yield store


def test_targets_and_masses_in_every_form(tmp_path: Path) -> None:
    frequency, level = np.array([100.0, 1000.0, 5000.0]), np.array([200.0, 2000.0, 2000.0])
    frame = pd.DataFrame({"frequency_hz": frequency, "level_m_s2": level})
    frame.to_csv(tmp_path / "spec.csv", index=False)
    series = pd.Series(level, index=frequency)
    targets = [
        target_of(given, "6dB")
        for given in (tmp_path / "spec.csv", series, frame, (frequency, level))
    ]
    targets.append(target_of(targets[0]))
    for target in targets:
        np.testing.assert_allclose(target.level_m_s2, targets[0].level_m_s2)
        np.testing.assert_allclose(target.upper_db, targets[0].upper_db)
    with pytest.raises(ValueError, match="level"):
        target_of(pd.Series([-1.0, 1.0], index=[100.0, 200.0]))
    half = pint.UnitRegistry().Quantity(500, "g")
    for mass in (0.5, "0.5 kg", "0.5kg:0.5kg", half):
        assert masses_of(mass, "bullet_mass") == Levels((0.5,))
    for several in ("0.2kg,0.5kg", [0.2, half]):
        assert masses_of(several, "bullet_mass") == Levels((0.2, 0.5))
    assert masses_of("1kg:0.2kg", "bullet_mass") == ContinuousRange(0.2, 1.0)


@pytest.fixture
def tuned(store: ps.ExperimentStore, lab: Path) -> TunedSettings:
    twin = store.twin(contact="hertz")
    return twin.tune(
        lab / "spec.csv", tolerance=20, factors=lab / "own.toml", at_least=0.01, progress=False
    )


def test_settings_are_those_of_the_service(
    tuned: TunedSettings, store: ps.ExperimentStore, lab: Path
) -> None:
    target = target_of(lab / "spec.csv", "20dB")
    search = SpectrumSearch(factors=TextFile(text=(lab / "own.toml").read_text()), at_least=0.01)
    session = session_of(store.store, store.url, target, search, TwinRequest(contact="hertz"))
    expected = session.run()
    assert tuned.to_json() == [
        proposal_json(choice.proposal, rank) | choice.as_json()
        for rank, choice in enumerate(expected.choices, 1)
    ]
    assert tuned.sentence == " ".join(map(str, answer_sentences(tuned.job_data())))
    assert tuned.sentence.startswith(
        ("One proposal meets", f"{expected.attainability.meeting} proposals")
    )
    assert tuned.attainable and tuned.probability == expected.proposals[0].probability_met

    table = tuned.to_frame()
    assert table["rank"].tolist() == list(range(1, len(table) + 1))
    assert table["probability_within"].tolist() == [
        row["probability_within"] for row in tuned.to_json()
    ]
    assert (
        table.attrs["units"]["tank_pressure_pa"] == "Pa"
        and len(tuned.alternatives) == table["alternatives"].sum()
    )
    assert tuned._repr_html_().startswith(f"<p><b>{tuned.sentence}")

    spectra = tuned.spectra
    assert spectra.loc[200.0, "target"] == pytest.approx(200.0)
    assert spectra.loc[200.0, "tolerance_upper"] == pytest.approx(2000.0)
    assert spectra["expected_1"].tolist() == pytest.approx(tuned.to_json()[0]["expected_m_s2"])
    axes = tuned.plot()
    assert axes.get_xlabel() == "natural frequency (Hz)" and axes.get_ylabel() == "maximax SRS (g)"
    prescribed = next(line for line in axes.lines if line.get_linestyle() == "--")
    assert prescribed.get_ydata()[0] == pytest.approx(spectra["target"].iloc[0] / 9.80665)


@pytest.mark.parametrize(("options", "message"), [
    ({"share": 0.0}, "share is 0.0; expected"),
    ({"bullet_mass": "5 bar"}, "bullet_mass is '5 bar'"),
    ({"tolerance": "6"}, "tolerance is '6'"),
    ({"sensor": "nose"}, "no sensor 'nose'"),
    ({"measured": "autumn"}, "autumn"),
])  # fmt: skip
def test_error_names_the_argument(
    store: ps.ExperimentStore, lab: Path, options: dict[str, object], message: str
):
    with pytest.raises(ps.PyroshockError) as caught:
        store.twin(contact="hertz").tune(lab / "spec.csv", progress=False, **options)
    assert message in str(caught.value)


def test_shipped_twin_has_no_campaign_to_learn_from(store: ps.ExperimentStore, lab: Path) -> None:
    with pytest.raises(ps.NotFoundError, match="no campaign 'spring': there is no store"):
        ps.shipped_twin(contact="hertz").tune(lab / "spec.csv", measured="spring", progress=False)
