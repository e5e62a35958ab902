"""The gallery: every script draws its figure, what is drawn is what it says, and the page shows all
of it."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from pyroshock.examples.gallery import (
    chamber_pressure,
    contact_differences,
    cost_by_test,
    cost_function,
    deconvolution,
    exit_velocity,
    extraction_against_truth,
    extraction_methods,
    force_from_plate,
    measured_velocities,
    pulse_from_models,
    resampling_error,
    shipped_shots,
    spectrum_construction,
    trained,
    virtual_campaign,
)
from pyroshock.examples.gallery.__main__ import main
from pyroshock.examples.gallery.figures import FIGURES, Scene
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.training.evaluation.metrics import pulse_cost
from pyroshock.training.registry.evaluate import Evaluation
from pyroshock.twin.gun.nominal import trajectory
from scipy.signal import resample
from scipy.stats import spearmanr

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "images" / "gallery"
#: What the thesis shows and the software can draw.
DRAWABLE = (
    "1.1",
    "1.7",
    "2.6",
    "2.7",
    "2.9",
    "2.12",
    *(f"4.{i}" for i in range(2, 11)),
    *(f"5.{i}" for i in range(1, 6)),
)
#: Learn without PyTorch, in a second.
CHEAP = ("linear", "tree", "hann", "hunter", "reed")
#: A label of an axis: what, and the unit, or "-" where it has none; or a count.
LABEL = re.compile(
    r".+\((-|%|m/s²?|bar|mm|m?s|N|V|Hz|share of range|relative|eq\. 5\.4, of "
    r"1,000)\)$|.*\b(test|hit|point)\b.*"
)

Drawn = Callable[[str], Figure]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, coarse_plates: None) -> Scene:
    """Tests 19 to 36, three hits each: six with each tip on an anvil of aluminium. The bench's
    plates are coarse."""
    found = Scene(tmp_path_factory.mktemp("gallery"), 3, CHEAP)
    rows = virtual_campaign.tests_in_order()[18:36]
    vars(found)["campaign"] = virtual_campaign.recorded(found.work, found.hits, rows, jobs=1)
    return found


@pytest.fixture(scope="module")
def campaign(scene: Scene) -> virtual_campaign.HammerCampaign:
    return scene.campaign


@pytest.fixture(scope="module")
def judged(scene: Scene) -> Evaluation:
    return scene.judged


@pytest.fixture(scope="module")
def drawn(scene: Scene) -> Drawn:
    """Each figure by its name, drawn once."""
    return cache(lambda name: FIGURES[name].draw(scene))


def page() -> str:
    return (ROOT / "docs" / "measurements" / "gallery.md").read_text(encoding="utf-8")


# --- the page ---
def test_every_drawable_figure_has_a_script_and_a_picture() -> None:
    assert [number for entry in FIGURES.values() for number in entry.thesis.split(", ")] == list(
        DRAWABLE
    )
    folder = ROOT / "examples" / "gallery"
    drawing = {
        path.stem
        for path in folder.glob("*.py")
        if "\ndef draw(" in path.read_text(encoding="utf-8")
    }
    assert drawing == set(FIGURES) and {path.stem for path in PICTURES.iterdir()} == set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_page_has_the_picture_whose_axes_tell_what_and_in_which_unit(
    name: str, drawn: Drawn
) -> None:
    assert f"](../images/gallery/{name}.png)" in page()
    assert f"[`{name}.py`](../../examples/gallery/{name}.py)" in page()
    assert (PICTURES / f"{name}.png").stat().st_size < 80_000
    figure = drawn(name)
    labels = [axis.get_label_text() for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]
    labels += [each.get_supylabel() for each in (figure, *figure.subfigs)]
    assert [label for label in labels if label and not LABEL.match(label)] == []
    if name != "predictor_correlation":  # a matrix of names
        assert len([label for label in labels if label]) >= 2


# --- every figure ---


def test_command_writes_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["force_profiles", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "force_profiles.png").read_bytes().startswith(b"\x89PNG")
    assert "Fig. 1.7" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["mona_lisa"], ["force_models", "--models", "oracle"]])
def test_command_refuses_what_it_does_not_know(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2 and words[-1] in capsys.readouterr().err


# --- physics ---
@pytest.mark.parametrize(
    ("name", "peak_at"), [("Hunter", 0.5), ("Reed", 0.5), ("asymmetric von Hann", 0.6)]
)
def test_profiles_end_at_zero_and_peak_where_they_must(
    drawn: Drawn, name: str, peak_at: float
) -> None:
    """The von Hann pulse compresses for 1 / (1 + e) of its contact."""
    (line,) = (line for line in drawn("force_profiles").axes[0].lines if line.get_label() == name)
    phase, force = np.asarray(line.get_data())
    assert force[[0, -1]] == pytest.approx([0, 0])
    assert (force.max(), phase[np.argmax(force)]) == pytest.approx((1.0, peak_at), abs=2e-3)


def test_plates_are_as_thick_as_the_thesis_says_and_the_spectrum_passes_through_its_peaks(
    drawn: Drawn,
) -> None:
    marks = [
        line
        for axes in drawn("safety_plates").axes
        for line in axes.lines
        if line.get_marker() == "x"
    ]
    thickness, limit = np.array([np.ravel(line.get_data()) for line in marks]).T
    assert limit == pytest.approx([150, 150]) and thickness == pytest.approx([10, 5], abs=0.5)
    base, lines = spectrum_construction.recorded(), np.array(spectrum_construction.OSCILLATORS_HZ)
    (axes,) = (axes for axes in drawn("spectrum_construction").axes if axes.get_xscale() == "log")
    dots = [float(np.ravel(line.get_ydata())[0]) for line in axes.lines if line.get_marker() == "o"]
    (frequency, level) = next(
        np.asarray(line.get_data()) for line in axes.lines if line.get_marker() == "None"
    )
    assert dots == pytest.approx(
        [level[np.argmin(np.abs(frequency - line))] for line in lines], rel=1e-9
    )
    finer = resample(base.si, 16 * base.si.size)
    spectrum = shock_response_spectrum(
        finer, 16 * base.sampling_rate_hz, lines, resample_within=None
    )
    assert dots == pytest.approx(spectrum.primary, rel=0.01)


def test_measured_shots_err_as_table_5_1_says_and_a_virtual_one_is_read_as_fired(
    drawn: Drawn,
) -> None:
    errors = measured_velocities.errors_percent(shipped_shots.shots())
    assert errors == pytest.approx([-2.1, 4.4, -2.4, -3.9, 7.6], abs=0.1)
    assert np.mean(np.abs(errors)) == pytest.approx(4.07, abs=0.02)
    (pressure, laser) = drawn("chamber_pressure").axes
    read_bar, read_m_s = map(float, re.findall(r"([\d.]+) (?:bar|±)", pressure.get_title()))
    assert read_bar == pytest.approx(chamber_pressure.TEST_2_PA / 1e5, abs=0.01)
    assert (
        0.5 * 11.872 < read_m_s < 11.872
    )  # the virtual gun is slower than the thesis's there: docs/explanation/virtual-bench.md
    volts = np.asarray(laser.lines[0].get_ydata())
    assert np.median(volts) - np.median(volts[volts < -2]) == pytest.approx(
        4.8, rel=0.01
    )  # 48 mm at 0.1 V/mm


# --- the virtual campaign ---
def test_tests_are_grouped_by_tip_and_cost_adds_up_to_eq_5_4() -> None:
    rows = virtual_campaign.tests_in_order()
    tips = [row["tip_material"] for row in rows]
    assert len(rows) == 180 and tips == 10 * (
        6 * ["aluminum"] + 6 * ["delrin"] + 6 * ["polyurethane"]
    )
    assert {tips[i - 1] for i in (1, 40, 109)} == {
        "aluminum"
    }  # where the thesis's extractions differ most
    late, force = 0.03, 1.07 * cost_function.PULSE
    elements = cost_function.element_cost(late * cost_function.PHASE, force - cost_function.PULSE)
    pulse, one = cost_function.PULSE[None, :] / cost_function.PULSE.max(), np.ones(1)
    assert pulse_cost(pulse, one, 1.07 * pulse, (1 + late) * one)[0] == pytest.approx(
        elements.sum(), rel=1e-3
    )
    i = len(cost_function.PHASE) // 3
    costs = cost_function.cost_map(
        cost_function.PHASE[[i]], np.array([cost_function.PULSE[i], 3.0])
    )
    assert costs[:, 0] == pytest.approx([0, 1])
    whole = cost_function.cost_map(np.linspace(-1, 2, 31), np.linspace(-1, 2, 31))
    assert whole.min() >= 0 and whole.max() <= 1
    top = int(np.argmax(cost_function.PULSE))
    above = cost_function.cost_map(cost_function.PHASE[[top]], np.array([1.1]))[0, 0]
    assert above == pytest.approx(1 - np.exp(-0.5), abs=0.01)


def test_force_comes_back_from_the_plate_without_ringing(
    campaign: virtual_campaign.HammerCampaign,
) -> None:
    _, measured, computed = force_from_plate.forces(campaign, campaign.tests[6])
    assert np.sqrt(np.mean((computed - measured)[:256] ** 2)) < 0.05 * measured.max()
    # After the contact the hammer flies freely: what is left there is the hammer's own.
    time, raw, clean = deconvolution.cleaned(campaign, campaign.tests[0])
    after = (time > 0.6e-3) & (time < 2e-3)
    for each_raw, each_clean in zip(raw, clean, strict=True):
        assert np.std(each_clean[after]) < 0.5 * np.std(each_raw[after])


def test_both_methods_find_every_hit_at_its_sealed_truth(
    campaign: virtual_campaign.HammerCampaign,
) -> None:
    _, walk = extraction_methods.extracted(campaign, campaign.tests[0], "walk")
    _, mask = extraction_methods.extracted(campaign, campaign.tests[0], "mask")
    assert len(walk) == len(mask) == campaign.hits
    lengths = [
        [pulse.contact.last - pulse.contact.first for pulse in pulses] for pulses in (walk, mask)
    ]
    assert np.array_equal(np.array(lengths[0]) - lengths[1], np.ones(campaign.hits))
    hit = extraction_against_truth.worst(campaign)
    period_s = hit.force.period_s
    assert hit.walk.contact_time_s == pytest.approx(hit.truth["contact_time_s"], abs=3 * period_s)
    assert hit.walk.start_s == pytest.approx(hit.truth["start_s"], abs=2 * period_s)
    assert hit.walk.contact_time_s - hit.mask.contact_time_s == pytest.approx(period_s)


def test_resampling_errors_fall_with_samples_and_extractions_differ_most_for_aluminium(campaign):
    errors = np.ravel(resampling_error.by_hit(campaign, "spline_nrmse"))
    assert (
        spearmanr(
            np.ravel(resampling_error.by_hit(campaign, "samples_in_contact")), errors
        ).statistic
        < -0.8
    )
    assert errors.max() < 0.005  # the thesis: consistently below 0.5 %
    # By one sample of the contact.
    by_tip = contact_differences.difference_percent(campaign).reshape(3, 6)
    assert by_tip[0].min() > by_tip[1].max() > by_tip[1].min() > by_tip[2].max()


def test_exit_velocities_are_those_of_the_equation_of_motion_and_pulses_go_through_their_samples(
    drawn: Drawn,
) -> None:
    for axes in drawn("resampled_pulses").axes:
        samples, spline = (np.asarray(line.get_data()) for line in axes.lines)
        off = np.interp(samples[0], *spline) - samples[1]
        assert np.sqrt(np.mean(off**2)) < 0.005 * np.ptp(samples[1])
    curves = drawn("exit_velocity").axes[0].lines[: len(exit_velocity.MASSES_KG)]
    for mass, curve in zip(exit_velocity.MASSES_KG, curves, strict=True):
        pressure_bar, velocity = np.asarray(curve.get_data())
        for i in (20, 80, 160):
            shot = trajectory(shipped_shots.gun(), pressure_bar[i] * 1e5, mass)
            assert velocity[i] == pytest.approx(shot.muzzle_velocity_m_s, rel=1e-6)


# --- models ---
def test_held_out_hits_models_and_pulses_are_those_of_the_evaluation(
    judged: Evaluation, drawn: Drawn, campaign
):
    axes = pulse_from_models.draw(judged, "tree").axes
    row, prediction = pulse_from_models.median_pulse(judged, "tree"), judged.predictions["tree"]
    time_ms, force = np.asarray(axes[2].lines[1].get_data())
    assert time_ms[[0, -1]] == pytest.approx([0, prediction.contact_time_s[row] * 1e3])
    at_points = np.linspace(0, time_ms[-1], 20)
    assert np.interp(at_points, time_ms, force) == pytest.approx(
        prediction.force_n[row], abs=1e-3 * force.max()
    )
    labels = [text.get_text() for text in drawn("force_models").axes[0].get_yticklabels()]
    names = [label.partition(" (")[0] for label in labels]  # behind each stands its mean
    assert names == sorted(CHEAP, key=lambda name: float(judged.errors[name].force_nrmse.mean()))
    assert np.array_equal(
        np.unique(judged.pulses.run, return_counts=True)[1], np.ones(len(campaign.tests))
    )
    assert set(cost_by_test.five(judged)) == {"hann", "hunter", "reed"}


@pytest.mark.parametrize(
    ("name", "metric"), [("cost_by_test", "cost"), ("impulse_error_by_test", "impulse_error")]
)
def test_points_are_means_over_a_tests_hits(
    drawn: Drawn, judged: Evaluation, name: str, metric: str
) -> None:
    axes = next(axes for axes in drawn(name).axes if axes.get_title().startswith("hunter"))
    points = sorted(
        float(y) for line in axes.lines if line.get_marker() == "o" for y in line.get_ydata()
    )
    assert points == pytest.approx(sorted(getattr(judged.errors["hunter"], metric)))


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_whole_gallery_is_drawn(tmp_path: Path) -> None:
    """180 tests of three hits, and the models that learn in seconds."""
    assert main(["--out", str(tmp_path), "--work", str(tmp_path / "work"), "--hits", "3"]) == 0
    sizes = {path.stem: path.stat().st_size for path in tmp_path.glob("*.png")}
    assert set(sizes) == set(FIGURES) and max(sizes.values()) < 80_000


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_trained_models_beat_the_pulses_of_physics(tmp_path: Path) -> None:
    """Table 5.2's order of the two kinds."""
    campaign = virtual_campaign.recorded(tmp_path, 3)
    found = trained.judged(
        campaign.table(), ("nn-medium", "coregional-gp", "hann", "hunter", "reed")
    )
    cost = {name: float(errors.cost.mean()) for name, errors in found.errors.items()}
    assert (
        max(cost["nn-medium"], cost["coregional-gp"])
        < min(cost["hann"], cost["hunter"], cost["reed"]) / 2
    )
