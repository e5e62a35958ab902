"""In a browser: a gun, a hammer and a plate are stored from bare recordings, by pages alone. What a
person does for it is counted, and printed."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import func, select
from support.processes.browsers import Lab, at, page_of, screenshot, served
from support.records.campaigns import hammer_campaign

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A server over a store of nothing."""
    folder = tmp_path_factory.mktemp("form")
    url = f"sqlite:///{folder / 'lab.db'}"
    with open_store(url, Writer("browser", "0"), create=True):
        pass
    with served(url, folder) as window:
        yield window


@dataclass
class Person:
    """What a person does on a page, counted."""

    page: Any
    clicks: int = 0
    fields: int = 0
    begun: float = field(default_factory=time.monotonic)

    def click(self, where: str) -> None:
        """Press a button."""
        self.page.click(where)
        self.clicks += 1

    def fill(self, label: str, text: str) -> None:
        """Type into the field of this label."""
        self.page.get_by_label(label, exact=True).fill(text)
        self.fields += 1

    def choose(self, label: str, words: str) -> None:
        """Choose in the select of this label."""
        self.page.get_by_label(label, exact=True).select_option(label=words)
        self.fields += 1

    def told(self, kind: str) -> str:
        """The counts in words."""
        seconds = time.monotonic() - self.begun
        return (
            f"{kind}: {self.clicks} clicks, {self.fields} fields, {seconds:.1f} s of the pages; "
            "0 files written by hand"
        )


def uploaded(page: Any, folder: Path) -> Person:
    """The form that the bare recordings of a folder lead to."""
    at(page, "/ingest")
    person = Person(page)
    page.set_input_files("#upload-folder", str(folder))
    person.clicks += 1  # the folder is chosen in the browser's own window
    person.click("#upload button[name=dry_run]")
    page.wait_for_selector("#campaign-form")
    return person


def checked_and_stored(person: Person, name: str) -> str:
    """The form is checked, and the campaign is stored from the check."""
    page = person.page
    person.click("#check")
    page.wait_for_selector("#store, #again, .field-error", timeout=120_000)
    faults = page.locator(".field-error, .faults").all_inner_texts()
    assert page.locator("#store").count() == 1, faults
    verdict = str(page.inner_text("#verdict"))
    assert page.locator("#written a[href*=files]").count() == 2
    person.click("#store button")
    page.wait_for_selector("#job-result, #job-error:not([hidden])", timeout=120_000)
    person.click("#job-result")
    page.wait_for_selector("#counts")
    assert page.inner_text("h1") == name
    return verdict


def counted(lab: Lab, name: str, table: Any) -> int:
    with lab.reading() as session:
        key = select(Campaign.id).where(Campaign.name == name).scalar_subquery()
        return session.scalar(select(func.count()).where(table.campaign_id == key)) or 0


def without_files(folder: Path) -> Path:
    for name in ("campaign.toml", "runs.csv"):
        (folder / name).unlink()
    return folder


def test_a_hammer(browser, lab, tmp_path, capsys):
    folder = without_files(hammer_campaign(tmp_path / "spring", 3, 2, "spring"))
    with page_of(browser, lab) as page:
        person = uploaded(page, folder)
        screenshot(page, "campaign-form")
        person.fill("Date needed", "2026-11-01")
        person.fill("Effective mass of the hammer (kg)", "320 g")
        person.fill("Unit of force", "N")
        person.fill("Material of the tip, all runs", "steel")
        person.fill("Radius of the tip (mm), all runs", "30")
        verdict = checked_and_stored(person, "spring")
        assert "Nothing is stored yet" in verdict
        counts = person.told("hammer, 3 recordings")
    assert counted(lab, "spring", Impact) == 6
    with capsys.disabled():
        print(f"\n{counts}")


def test_a_gun(browser, lab, tmp_path, capsys):
    folder = tmp_path / "autumn"
    (folder / "recordings").mkdir(parents=True)
    for name in ("0001-01.h5", "0002-01.h5", "0003-01.h5"):
        shutil.copy(EXAMPLES / "rehearsal" / "recordings" / name, folder / "recordings")
    with page_of(browser, lab) as page:
        person = uploaded(page, folder)
        person.fill("Date needed", "2026-11-02")
        for label, text in (
            ("Volume of the tank (m³)", "9.5 L"),
            ("Inner diameter of the barrel (m)", "49 mm"),
            ("Diameter of the projectile (m)", "48 mm"),
            ("Travel of the projectile, from rest to the vent holes (m)", "885 mm"),
            ("Friction coefficient", "0.3"),
            ("Heat capacity ratio of the gas (1.4 for air)", "1.4"),
            ("Efficiency of the gun (above 0, at most 1)", "1"),
        ):
            person.fill(label, text)
        person.choose("What laser measures", "light barrier or laser at the muzzle, in mm")
        for channel, unit in (
            *((f"force_{i}", "kN") for i in (1, 2, 3, 4)),
            ("acceleration_1", "g"),
            ("acceleration_2", "g"),
            ("laser", "mm"),
            ("tank_pressure", "bar"),
        ):
            person.fill(f"Unit of {channel}", unit)
        for channel, sensitivity, offset in (
            ("laser", "0.1", "-13"),
            ("tank_pressure", "0.5621", "0.3624"),
        ):
            person.fill(f"Sensitivity of {channel}, volt per unit", sensitivity)
            person.fill(f"Offset of {channel}, volt", offset)
        person.fill("Mass of the projectile (kg), all runs", "0.4")
        person.fill("Pressure of the tank (bar), all runs", "0.387")
        person.fill("Material of the tip, all runs", "PLA")
        person.fill("Radius of the tip (mm), all runs", "60")
        person.fill("Radius of the tip (mm) of recordings/0002-01.h5", "30")
        person.fill("Material of the plate, all runs", "aluminum")
        person.fill("Length of the projectile (mm), all runs", "85")
        checked_and_stored(person, "autumn")
        counts = person.told("gun, 3 recordings, 8 channels")
    assert counted(lab, "autumn", Shot) == 3
    with lab.reading() as session:
        row = session.scalars(select(Campaign).where(Campaign.name == "autumn")).one()
        assert row.gun is not None and row.gun.travel_m == 0.885
    with capsys.disabled():
        print(f"\n{counts}")


def test_a_gun_on_the_same_bench_takes_it_from_the_store(browser, lab, tmp_path, capsys):
    folder = tmp_path / "winter"
    (folder / "recordings").mkdir(parents=True)
    for name in ("0004-01.h5", "0005-01.h5"):
        shutil.copy(EXAMPLES / "rehearsal" / "recordings" / name, folder / "recordings")
    with page_of(browser, lab) as page:
        person = uploaded(page, folder)
        person.fill("Date needed", "2026-11-03")
        person.choose("What laser measures", "light barrier or laser at the muzzle, in mm")
        person.fill("The bench and the sensors are those of campaign", "autumn")
        person.click("button[value=bench]")
        page.wait_for_url("**bench=autumn")
        assert "campaign autumn of the store" in page.inner_text("#campaign-form")
        person.fill("Mass of the projectile (kg), all runs", "0.4")
        person.fill("Pressure of the tank (bar), all runs", "0.387")
        person.fill("Length of the projectile (mm), all runs", "85")
        checked_and_stored(person, "winter")
        counts = person.told("gun again, 2 recordings, bench of another campaign")
    with lab.reading() as session:
        guns = set(session.scalars(select(Campaign.gun_id).where(Campaign.kind == "gun")))
        assert len(guns) == 1  # the very same bench
    with capsys.disabled():
        print(f"\n{counts}")


def test_a_plate(browser, lab, tmp_path, capsys):
    folder = tmp_path / "plate"
    folder.mkdir()
    source = EXAMPLES / "modal-hammer-hit" / "recordings" / "acceleration.lvm"
    shutil.copy(source, folder / "hit_1.lvm")
    with page_of(browser, lab) as page:
        person = uploaded(page, folder)
        assert page.input_value("[name='campaign.date']") == "2018-12-17"
        assert "from: the headers of 1 of 1 recordings" in page.inner_text("#campaign-form")
        person.choose("Kind needed", "Plate: a plate is struck, nothing is known of the hammer")
        assert not page.is_visible("[name='bench.hammer.mass_kg']")
        page.locator("[name='bench.plate.material']").fill("steel")
        person.fields += 1
        person.fill("Thickness of the plate (m)", "10 mm")
        person.fill("Outline of the plate (m)", "600 mm x 400 mm")
        checked_and_stored(person, "plate")
        counts = person.told("plate, 1 recording")
    with lab.reading() as session:
        row = session.scalars(select(Campaign).where(Campaign.name == "plate")).one()
        assert row.plate is not None and row.plate.thickness_m == 0.01 and row.hammer is None
    with capsys.disabled():
        print(f"\n{counts}")


def test_what_is_missing_stands_beside_its_field(browser, lab, tmp_path):
    folder = without_files(hammer_campaign(tmp_path / "faults", 1, 1, "faults"))
    with page_of(browser, lab, width=390) as page:
        person = uploaded(page, folder)
        person.click("#check")
        page.wait_for_selector(".field-error")
        assert page.locator("[name='campaign.date'][aria-invalid]").count() == 1
        # the page does not scroll sideways on a telephone
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_form_and_the_facts_are_read_by_everyone(browser, lab, tmp_path):
    from axe_playwright_python.sync_playwright import Axe

    folder = without_files(hammer_campaign(tmp_path / "seen", 1, 1, "seen"))
    rules = {"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]}
    with page_of(browser, lab) as page:
        uploaded(page, folder)
        form = page.url
        for address in (form, "/campaigns/spring/facts", "/campaigns/spring", "/ingest"):
            at(page, address)
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)
                report = Axe().run(page, options=rules)
                assert report.violations_count == 0, f"{address}: {report.generate_report()}"
            page.set_viewport_size({"width": 390, "height": 844})
            assert page.evaluate("document.documentElement.scrollWidth") <= 390, address
            page.set_viewport_size({"width": 1280, "height": 900})


def test_a_name_of_256_letters_does_not_push_the_table_away(browser, lab, tmp_path):
    name = "n" * 256
    ingest_folder(lab.store, hammer_campaign(tmp_path / "long", 1, 1, name))
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        link = page.locator(f"#campaigns a[title='{name}']")
        assert link.count() == 1  # the whole name stands where the pointer rests
        table = page.locator("#campaigns").bounding_box()
        assert table is not None and table["width"] <= 1280
        page.set_viewport_size({"width": 390, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        link.click()
        page.wait_for_selector("#counts")
        assert page.inner_text("h1") == name  # and whole behind one tap
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
