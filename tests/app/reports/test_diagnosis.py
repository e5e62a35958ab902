"""The page of a diagnosis: whole, well formed, everything escaped, and its bars true to the numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.diagnose.report import page, waterfall, write_page
from pyroshock.diagnosis.verdict import GapSize, Pictures, StageShare, Where
from support.checks.well_formed import Page
from support.records import verdicts

HOSTILE = "<script>alert('x')</script>&\"quoted\""


def test_page_is_whole_in_itself() -> None:
    found = Page(page(verdicts.verdict()))
    tags = {tag for tag, _ in found.elements}
    assert not tags & {"script", "link", "img", "iframe"}
    assert not any(key in ("src", "href") for _, attributes in found.elements for key in attributes)


def test_page_holds_every_part() -> None:
    text = Page(page(verdicts.verdict())).text
    for part in (
        "Most probably it is the compliance of the insulating layer or",
        "contact.plate_compliance (20 %)",
        "93 %",
        "insulator = polymeric",
        "peak force (contact)",
        "4 runs at tank_pressure_bar = 0.3",
        "floor of 2 observables assumed",
        "there was no error to reduce",
        "steel, 0.3 bar",
    ):
        assert part in text, part


def test_page_begins_with_the_sentence_and_what_to_do_next() -> None:
    text = " ".join(Page(page(verdicts.gun())).text.split())
    body = text.partition("Diagnosis spring ")[2]
    assert body.startswith("The model error is 42 times the tolerance and 99 times the measurement noise; it arises in")
    assert body.partition("What to do next")[2].startswith(" Adopt these effects")
    assert text.index("What to do next") < text.index("+ flow resistance of the valve") < text.index("Causes")


def test_effects_stand_in_a_table_with_shares_and_names() -> None:
    text = Page(page(verdicts.gun())).text
    for part in ("gun.dead_volume", "the atmosphere ahead of the projectile", "52 to 68\u00a0%", "unexplained"):
        assert part in text, part
    assert "Shares of the effects" not in Page(page(verdicts.verdict())).text


def test_unknown_names_an_experiment_on_its_page() -> None:
    text = Page(page(verdicts.unknown())).text
    experiment = text.partition("The next experiment")[2].partition("Assumptions")[0]
    assert "Fire three repetitions" in experiment and "needed" not in experiment


def test_residuals_of_logarithms_are_per_cent_of_the_simulated_value() -> None:
    """A force of twice the simulated one is 100 % above it."""
    picture = replace(verdicts.pictures().residuals[0], before=np.full(6, np.log(2.0)), after=None)
    chart = Page(page(verdicts.verdict(pictures=Pictures((), (picture,)))))
    assert "measured over simulated (%)" in chart.text
    assert "configuration 1: 100" in chart.text


def test_restriction_stands_among_the_facts() -> None:
    sentence = "The diagnosis considers only gun.valve_flow (--with), and no other effect."
    assert f"Restriction {sentence}" in " ".join(Page(page(verdicts.gun(assumptions=(sentence,)))).text.split())


def test_floor_is_shaded_and_dots_are_configurations() -> None:
    found = Page(page(verdicts.verdict()))
    kinds = [attributes.get("class") for tag, attributes in found.elements if tag in ("polygon", "circle")]
    assert kinds.count("floor") == 1
    assert kinds.count("before") == kinds.count("after") == 5  # the sixth configuration was not measured


def test_agreement_makes_a_page_too() -> None:
    assert "No pictures are kept with this diagnosis." in Page(page(verdicts.none())).text


def test_words_of_a_campaign_are_escaped() -> None:
    whole = verdicts.verdict()
    stage = replace(whole.where.stage[0], name=HOSTILE)
    curve = replace(whole.pictures.curves[0], title=HOSTILE, x_name=HOSTILE, y_unit=HOSTILE)
    residual = replace(whole.pictures.residuals[0], name=HOSTILE, stage=HOSTILE, unit=HOSTILE)
    hostile = replace(
        whole,
        campaign=HOSTILE,
        simulator=HOSTILE,
        where=replace(whole.where, stage=(stage,), drift=(HOSTILE,)),
        shrinkage=(replace(whole.shrinkage[0], held_out_by=HOSTILE, more={HOSTILE: (1.0, 2.0)}),),
        next_runs=(replace(whole.next_runs[0], why=HOSTILE, settings={HOSTILE: HOSTILE}),),
        assumptions=(HOSTILE,),
        pictures=Pictures((HOSTILE,) * 6, (residual,), (curve,)),
    )
    text = page(hostile)
    assert "<script" not in text
    assert HOSTILE in Page(text).text


def test_page_suits_a_telephone_and_a_dark_room(tmp_path: Path) -> None:
    write_page(verdicts.verdict(), tmp_path / "new" / "page.html")
    text = (tmp_path / "new" / "page.html").read_text(encoding="utf-8")
    assert "width=device-width" in text and "prefers-color-scheme: dark" in text
    assert not re.search(r"(?<!-)width: ?[4-9]\d\dpx", text)


@given(
    before=st.floats(1e-6, 1e3),
    floor=st.floats(0, 1e3),
    shares=st.lists(st.floats(-0.5, 1.5), max_size=3),
)
def test_waterfall_stays_on_its_track(before: float, floor: float, shares: list[float]) -> None:
    stages = tuple(StageShare(name, share, (share, share), 1.0) for name, share in zip("abc", shares, strict=False))
    gap = GapSize("rms", before, floor, 0.01, before > floor)
    steps = waterfall(verdicts.verdict(gap=gap, where=Where(stage=stages)))
    assert all(-1e-9 <= step.start <= step.end <= 1 + 1e-9 for step in steps)


def test_waterfall_goes_down_to_the_floor() -> None:
    gap = GapSize("rms", 2.0, 1.0, 0.01, True)
    stages = (StageShare("contact", 0.75, (0.7, 0.8), 3.0), StageShare("gun", 0.25, (0.2, 0.3), 1.0))
    steps = waterfall(verdicts.verdict(gap=gap, where=Where(stage=stages)))
    assert [(s.name, s.start, s.end) for s in steps] == [
        ("model error", 0.0, 1.0),
        ("contact", pytest.approx(1 - 0.75 * 0.75), 1.0),
        ("gun", pytest.approx(0.25), pytest.approx(1 - 0.75 * 0.75)),
        ("measurement noise", 0.0, pytest.approx(0.25)),
    ]


def test_perfect_agreement_divides_by_nothing() -> None:
    gap = GapSize("rms", 0.0, 0.0, 0.01, False)
    assert (
        "rms: 0; measurement noise 0,"
        in Page(page(verdicts.none().__class__(**{**vars(verdicts.none()), "gap": gap}))).text
    )


def test_missing_values_are_not_drawn() -> None:
    picture = replace(verdicts.pictures().residuals[0], before=np.full(6, np.nan), after=None)
    text = page(verdicts.verdict(pictures=Pictures((), (picture,))))
    assert "nan" not in text.replace("finance", "")
