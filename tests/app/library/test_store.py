"""`import pyroshock` and `ps.open(...)`: cheap, complete, and what the store gives is what the
command line prints."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.schema import series
from support.stores.hammer_stores import HITS, full_campaign

_FIRST_SHOTS = str(files("pyroshock") / "examples" / "first-shots")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    campaign = full_campaign(folder / "spring")
    with ps.open(folder / "lab.db") as store:
        assert store.ingest(campaign, progress=False).added["impacts"] == 4 * HITS
        yield store


def _printed(command, store, *arguments):
    result = CliRunner().invoke(main, [command, "--db", store.url, "--json", *arguments])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize("where", ["", "tip_material=delrin", "peak_force_n>800", "quality=ok"])
def test_impacts_are_those_of_the_command(lab, where):
    conditions = [where] if where else []
    printed = _printed("impacts", lab, *(word for each in conditions for word in ("--where", each)))
    _assert_same_rows(lab.impacts(where=conditions), printed)


def test_shots_are_those_of_the_command(tmp_path):
    with ps.open(f"sqlite:///{tmp_path / 'gun.db'}") as store:
        store.ingest(_FIRST_SHOTS, progress=False)
        frame = store.shots()
        _assert_same_rows(frame, _printed("shots", store))
    assert len(frame) == 5


def _assert_same_rows(frame, printed):
    assert len(frame) == len(printed) > 0
    for (_, row), wanted in zip(frame.iterrows(), printed, strict=True):
        assert {name: None if pd.isna(row[name]) else row[name] for name in wanted} == wanted
        assert all(pd.isna(row[name]) for name in set(frame.columns) - set(wanted))


def test_frames_have_chosen_columns_units_and_order(lab):
    frame = lab.impacts(
        columns=["id", "peak_force_n", "tip_radius_m"], sort="-peak_force_n", limit=3
    )
    assert list(frame.columns) == ["id", "peak_force_n", "tip_radius_m"]
    assert frame.attrs["units"] == {"peak_force_n": "N", "tip_radius_m": "m"}
    assert list(frame["peak_force_n"]) == sorted(lab.impacts()["peak_force_n"], reverse=True)[:3]
    frame = lab.campaigns()
    assert list(frame["name"]) == ["spring"] and list(frame["impacts"]) == [4 * HITS]
    assert (
        "lab.db" in repr(lab)
        and "spring" in lab._repr_html_()
        and lab.impacts(where="peak_force_n>1e12").empty
    )


def test_a_dry_run_stores_nothing_and_a_dataset_is_frozen_once(lab, tmp_path):
    report = lab.ingest(full_campaign(tmp_path / "autumn", "autumn"), dry_run=True, progress=False)
    assert report.added["impacts"] == 4 * HITS and "nothing is stored" in repr(report)
    assert list(lab.campaigns()["name"]) == ["spring"]
    with pytest.raises(ps.PyroshockError, match="no such folder"):
        lab.ingest(tmp_path / "winter", progress=False)
    data, again = lab.dataset("spring-1", campaigns=["spring"]), lab.dataset("spring-1")
    assert data.hash == again.hash and len(data) == len(data.to_frame()) > 10
    assert (
        list(lab.datasets()["name"]) == ["spring-1"] and "contact_time_s" in data.to_frame().columns
    )
    assert "spring-1" in data._repr_html_()
    with pytest.raises(ps.PyroshockError, match="autumn"):
        lab.dataset("autumn")


@pytest.mark.parametrize(("arguments", "kind", "words"), [
    ({"campaign": "autumn"}, ps.NotFoundError, "no campaign 'autumn'"),
    ({"where": "tip_colour = red"}, ps.InvalidValueError, "no column or factor 'tip_colour'"),
    ({"columns": ["mass"]}, ps.NotFoundError, "no column 'mass'; there are: id, campaign"),
    ({"sort": "mass"}, ps.NotFoundError, "no column 'mass'"),
    ({"limit": 0}, ps.InvalidValueError, "limit is 0"),
])  # fmt: skip
def test_what_is_wrong_is_named(lab, arguments, kind, words):
    with pytest.raises(kind, match=words):
        lab.impacts(**arguments)


def test_a_pulse_has_the_figures_of_the_listing(lab):
    row = lab.impacts(limit=1).iloc[0]
    pulse = lab.pulse(int(row["id"]))
    assert pulse.figures["peak_force_n"] == row["peak_force_n"]
    assert pulse.force_n.max() == pytest.approx(pulse.figures["spline_peak_force_n"], rel=1e-3)
    assert np.trapezoid(pulse.force_n, pulse.time_s) == pytest.approx(row["impulse_n_s"], rel=0.02)
    assert pulse.to_frame().attrs["units"] == {"time_s": "s", "force_n": "N"}
    axes = pulse.plot()
    assert (
        "(ms)" in axes.get_xlabel()
        and "(kN)" in axes.get_ylabel()
        and "peak_force_n" in pulse._repr_html_()
    )


def test_restitution_of_a_pulse_is_its_impulse_over_that_of_the_impact(lab):
    """Of one mass: P = m u (1 + e)."""
    pulse = lab.pulse(1)
    impulse = float(np.trapezoid(pulse.force_n, pulse.time_s))
    assert pulse.restitution(0.5, impulse / 0.5 / 1.6) == pytest.approx(0.6, abs=1e-3)
    assert np.isnan(pulse.restitution(0.5, impulse / 0.5 / 0.9))
    with pytest.raises(ps.InvalidValueError, match="mass_kg: expected"):
        pulse.restitution(0.0, 1.0)


def test_an_impact_that_is_not_there(lab):
    with pytest.raises(ps.NotFoundError, match="no impact 999"):
        lab.pulse(999)
    with pytest.raises(ps.NotFoundError, match="no impact 999"):
        lab.recording(999)


def test_a_slice_reads_its_own_chunks_only(lab, monkeypatch):
    channel = lab.recording(1)["force"]
    whole = channel.values
    assert len(whole) == len(channel) and channel.unit == "N"
    decoded, plain = [], series._decode_into

    def counted(frame, target, skip, layout):
        decoded.append(target.size)
        plain(frame, target, skip, layout)

    monkeypatch.setattr(series, "_decode_into", counted)
    np.testing.assert_array_equal(channel[100:200], whole[100:200])
    assert sum(decoded) <= 100 + series.SHORTEST_CHUNK < len(whole) or len(decoded) == 1


def test_channels_by_name_and_windows_of_times(lab):
    channel = lab.recording(1)["force"]
    part = channel.between(channel.time_s[10], channel.time_s[20])
    assert len(part) == 11 and part.index.name == "time_s" and part.attrs["unit"] == "N"
    np.testing.assert_array_equal(part.to_numpy(), channel[10:21])
    assert channel.between(1e6, 2e6).empty and channel.between(-2e6, -1e6).empty
    with pytest.raises(ps.InvalidValueError, match="rising order"):
        channel.between(1.0, 0.5)
    recording = lab.recording(1)
    assert list(recording) == ["force"] and recording.to_frame().iloc[0]["unit"] == "N"
    with pytest.raises(ps.NotFoundError, match=r"no channel 'strain'.*there are: force"):
        recording["strain"]
    with pytest.raises(
        ps.InvalidValueError, match="channel of force; a spectrum needs an acceleration"
    ):
        recording["force"].srs()
    assert recording.plot()[-1].get_xlabel() == "time (ms)"


@pytest.mark.parametrize("samples", [5, slice(0, 10, 2), "force"])
def test_only_slices_without_a_step(lab, samples):
    with pytest.raises(ps.InvalidValueError, match="expected a slice"):
        lab.recording(1)["force"][samples]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [({"target_motion": "floor"}, "target_motion is 'floor'"), ({"smothing": 0.5}, "smothing")],
)
def test_options_of_an_ingest_are_checked(lab, tmp_path, arguments, words):
    with pytest.raises(ps.InvalidValueError, match=words):
        lab.ingest(tmp_path, **arguments)


def test_a_store_that_is_not_there(tmp_path):
    with pytest.raises(ps.StorageError, match=r"no store|no such"):
        ps.open(tmp_path / "lab.db", create=False)
    assert not (tmp_path / "lab.db").exists()


# --- the import, and the public names ---
_HEAVY = {
    "numpy",
    "pandas",
    "scipy",
    "sqlalchemy",
    "torch",
    "mlflow",
    "matplotlib",
    "sklearn",
    "click",
}


def test_every_public_name_is_there_and_errors_are_what_python_users_expect():
    assert set(ps.__all__) == {*ps._PUBLIC, "__version__"}
    for name in ps.__all__:
        assert getattr(ps, name).__doc__ and name in dir(ps)
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        ps.opne  # noqa: B018
    assert issubclass(ps.InvalidValueError, ValueError) and issubclass(
        ps.NotFoundError, LookupError
    )
    assert issubclass(ps.StorageError, OSError)
    kinds = (ps.InvalidValueError, ps.NotFoundError, ps.StorageError)
    assert all(issubclass(kind, ps.PyroshockError) for kind in kinds)


def test_the_import_alone_loads_nothing_heavy():
    code = "import sys, pyroshock; print(*sorted(name for name in sys.modules if '.' not in name))"
    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not _HEAVY & set(printed)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_typed_project_passes_mypy_strict(tmp_path):
    (tmp_path / "analysis.py").write_text(
        textwrap.dedent(
            """
            import numpy as np
            import pandas as pd
            import pyroshock as ps


            def analyse(folder: str) -> pd.DataFrame:
                with ps.open("sqlite:///lab.db") as store:
                    report = store.ingest(folder, progress=False)
                    steel = store.impacts(campaign=report.campaign, where="tip_material = steel")
                    force: pd.Series[float] = store.recording(12)["force"].between(0.0, 0.1)
                    spectrum: pd.Series[float] = ps.srs(np.asarray(force), 50_000.0)
                    rows = store.dataset("spring", campaigns=[report.campaign])
                    runs = store.train(rows, models=["tree"])
                    decision = store.promote(runs.labels[0], reason="first")
                    assert decision.promoted and len(spectrum) > 0
                    nominal = store.twin(campaign=report.campaign)
                    shot = nominal.predict(tank_pressure="5 bar", bullet_mass=0.5)
                    print(float(shot.velocity), shot.force.to_frame(), shot.srs.mean.max())
                    diagnosis = store.diagnose(report.campaign)
                    twin = nominal.with_effects(diagnosis)
                    tuned = twin.tune("spec.csv", tolerance="6 dB", bullet_mass=[0.5])
                    print(tuned.to_frame(), diagnosis.effects)
                    print(twin.predict_many(steel, jobs=2).attrs["units"])
                    print(store.validate(report.campaign).scores, store.adopt(diagnosis).version)
                    return steel


            def wrong() -> None:
                ps.shipped_twin().predict("5 bar")
            """
        ),
        encoding="utf-8",
    )
    packages = tmp_path / "packages"  # the folder of a clone may have any name
    packages.mkdir()
    (packages / "pyroshock").symlink_to(Path(ps.__file__).parent)
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--config-file=",
        "--follow-imports=silent",
        "analysis.py",
    ]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={"MYPYPATH": str(packages), "PATH": ""},
    )
    errors = [
        line
        for line in done.stdout.splitlines()
        if "error" in line and line.startswith("analysis.py")
    ]
    assert len(errors) == 1 and "Too many positional arguments" in errors[0], done.stdout
