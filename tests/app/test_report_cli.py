"""`report`: what a word means, which file is written, and one line for what a user can mend."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import Result
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.report import dispatch as any_module
from pyroshock.schema.campaigns import Campaign
from pyroshock.training.fitting.session import train
from sqlalchemy import select
from support.checks.pdf_layout import words_of
from support.checks.well_formed import Page, needs_nothing
from support.records import verdicts
from support.records.campaigns import gun_campaign
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import counts, ingested, opened, pyroshock


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The campaigns spring (diagnosed twice) and hann; the models hann@1, linear@1."""
    place = tmp_path_factory.mktemp("filled")
    url = f"sqlite:///{place / 'lab.db'}"
    for name in ("spring", "hann"):
        ingested(url, gun_campaign(place / name, name=name))
    with opened(url) as store:
        keep(store, verdicts.verdict())
        keep(store, verdicts.none())
    registry = fresh_registry(place)
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        train(registry, context_in(registry), ["hann", "linear"], ["repetitions"])
    return place


@pytest.fixture
def lab(filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The store of `filled`, where the test may write; its registry is read where it lies."""
    (registry,) = [file for file in filled.glob("*.db") if file.name != "lab.db"]
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"sqlite:///{registry}")
    shutil.copy(filled / "lab.db", tmp_path)
    return tmp_path


def report(lab: Path, subject: str, out: str) -> Result:
    return pyroshock("report", subject, "--db", f"sqlite:///{lab / 'lab.db'}", "--out", lab / out)


def heading(lab: Path, subject: str) -> tuple[str, str]:
    """Kind and title of the page that a word gives."""
    result = report(lab, subject, "page.html")
    assert result.exit_code == 0, result.stderr
    page = Page((lab / "page.html").read_text(encoding="utf-8"))
    assert needs_nothing(page)
    title = next(word for word in page.words if word.strip())
    return title.partition(": ")[0], title.partition(": ")[2]


@pytest.mark.parametrize(("subject", "meant"), [
    ("spring", ("Campaign", "spring")),
    ("campaign:hann", ("Campaign", "hann")),
    ("diagnosis:1", ("Diagnosis", "spring")),
    ("diagnosis:spring", ("Diagnosis", "spring")),
    ("linear@1", ("Model", "linear@1")),
    ("models:/hann@1", ("Model", "hann@1")),
])  # fmt: skip
def test_words_mean_what_they_say(lab: Path, subject: str, meant: tuple[str, str]) -> None:
    assert heading(lab, subject) == meant


def test_diagnosis_is_the_newest_and_its_file_is_replaced(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = counts(f"sqlite:///{lab / 'lab.db'}")
    for subject, words in (
        ("diagnosis:spring", "Model and measurement agree"),
        ("diagnosis:1", "Most probably it is the compliance"),
        ("spring", "spring"),
        ("linear@1", "linear@1"),
    ):
        report(lab, subject, "page.html")
        assert words in (lab / "page.html").read_text(encoding="utf-8")
    assert counts(f"sqlite:///{lab / 'lab.db'}") == before
    (lab / "new").mkdir()
    (lab / "new" / "page.html").write_text("old")
    assert report(lab, "spring", "new/page.html").exit_code == 0
    assert report(lab, "spring", "newer/page.html").exit_code == 0
    assert (lab / "new" / "page.html").read_bytes() == (lab / "newer" / "page.html").read_bytes()
    assert not list(lab.rglob("*.part"))
    monkeypatch.setattr(
        any_module, "report_on", lambda *_: pytest.fail("worked before it looked at the ending")
    )
    result = report(lab, "spring", "page.docx")
    assert result.exit_code == 2 and "expected a name that ends in .html or .pdf" in result.stderr


@pytest.mark.parametrize(("subject", "said"), [
    ("hann", "say campaign:hann or models:/hann@VERSION"),
    ("linear", "say which version: models:/linear@1"),
    ("models:/linear", "models:/linear@VERSION"),
    ("autumn", "diagnosis:CAMPAIGN"),
    ("campaign:autumn", "known: "),
    ("diagnosis:99", "no diagnosis 99"),
    ("diagnosis:hann", "pyroshock diagnose hann"),
    ("linear@7", "versions: 1"),
])  # fmt: skip
def test_what_there_is_not_is_one_line(lab: Path, subject: str, said: str) -> None:
    result = report(lab, subject, "page.html")
    assert result.exit_code == 2 and said in result.stderr and result.stderr.count("\n") == 1
    assert not (lab / "page.html").exists()


@pytest.mark.parametrize("subject", ["spring", "diagnosis:1", "linear@1"])
def test_pdf_is_the_same_each_time(lab: Path, subject: str) -> None:
    for name in ("a.pdf", "b.pdf"):
        result = report(lab, subject, name)
        assert result.exit_code == 0, result.stderr
        assert f"written: {lab / name}" in result.stderr and result.stdout == ""
    assert (lab / "a.pdf").read_bytes().startswith(b"%PDF")
    assert (lab / "a.pdf").read_bytes() == (lab / "b.pdf").read_bytes()


def test_reports_are_in_the_units_that_are_asked_for(lab: Path) -> None:
    out, url = lab / "page.html", f"sqlite:///{lab / 'lab.db'}"
    for units, shown in (("bench", "tank pressure (bar)"), ("si", "tank pressure (Pa)")):
        result = pyroshock("report", "spring", "--db", url, "--out", out, "--units", units)
        assert result.exit_code == 0 and shown in out.read_text(encoding="utf-8")


def test_letters_of_the_store_are_printed_and_those_without_a_font_are_named(lab: Path) -> None:
    """Of a part that is read from the store, too: the operator's name."""
    for operator, shown in (("田中", "田中"), ("田中ไทย", "U+0E22 THAI CHARACTER YO YAK")):
        with opened(f"sqlite:///{lab / 'lab.db'}") as store, store.writing() as session:
            session.scalars(
                select(Campaign).where(Campaign.name == "spring")
            ).one().operator = operator
        result = report(lab, "spring", "spring.pdf")
        assert result.exit_code == 0, result.stderr
        assert shown in " ".join(words_of((lab / "spring.pdf").read_bytes()).split())


def test_campaigns_and_models_are_reported_without_mlflow(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import builtins

    real = builtins.__import__

    def without(name: str, *rest: object) -> object:
        if name.partition(".")[0] == "mlflow":
            raise ModuleNotFoundError("No module named 'mlflow'", name="mlflow")
        return real(name, *rest)

    for subject in ("spring", "linear@1"):
        assert report(lab, subject, f"{subject}.html").exit_code == 0
    monkeypatch.setattr(builtins, "__import__", without)
    for subject in ("spring", "linear@1"):
        assert report(lab, subject, f"{subject}-without.html").exit_code == 0
        pages = [(lab / f"{subject}{end}.html").read_bytes() for end in ("", "-without")]
        assert pages[0] == pages[1]
