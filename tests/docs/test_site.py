"""The documentation's site: every page has its place, every link leads somewhere, and it builds
without a warning."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tools import links
from tools.reference.subjects import SUBJECTS, asked
from tools.site.contents import MARK, reachable, sections, with_contents
from tools.site.docstrings import fields_of
from tools.site.files import linked
from tools.site.pages import of_root

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
#: Folders of `docs` that hold scripts, rows and pictures.
NO_PAGES = ("_build", "blind-check", "studies", "images", "_static")


def all_pages() -> set[str]:
    found = {path.relative_to(DOCS) for path in DOCS.rglob("*.md")}
    return {path.as_posix() for path in found if path.parts[0] not in NO_PAGES}


def test_every_page_is_reached_and_every_subject_and_decision_has_one() -> None:
    assert reachable(DOCS) == all_pages()
    pages = [
        subject for page in (DOCS / "reference").glob("*.md") for subject in asked(page.read_text())
    ]
    assert sorted(pages) == sorted(SUBJECTS)
    listed = (DOCS / "decisions" / "README.md").read_text(encoding="utf-8")
    for path in (DOCS / "decisions").glob("0*.md"):
        number, title = re.match(r"# (\d+)\. (.+)", path.read_text(encoding="utf-8")).groups()
        assert f"- [{number}. {title}]({path.name})\n" in listed


def test_links_become_the_tree_and_docstrings_say_what_they_say(monkeypatch, tmp_path) -> None:
    page = (
        f"# A\n\n[b](b.md)\n\n## Two\n\n- [c](d/c.md), [c](d/c.md#e), [out](../out.md)\n\n{MARK}\n"
    )
    assert list(sections(page)) == [("", ["b.md"]), ("Two", ["d/c.md"])]
    assert "```{toctree}\n:hidden:\n:caption: Two\n\nd/c\n```" in with_contents(page)
    assert {"deploy", "deploy/backup.sh"} <= set(
        linked()
    ) and "docs/reference/store.md" not in linked()
    monkeypatch.setattr("tools.site.pages.ROOT", tmp_path)
    (tmp_path / "FILE.md").write_text(
        "# Title\n\n[a](docs/a.md#b) [c](LICENSE) [d](#e) [f](https://g.h) [i](docs/j/)\n"
    )
    assert of_root("FILE.md") == "\n[a](a.md#b) [c](../LICENSE) [d](#e) [f](https://g.h) [i](j/)\n"
    from pyroshock.signals.checks.base import Finding

    assert "- ``message``: one sentence for a person, with value and limit" in fields_of(Finding)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does; a warning is an error."""
    folder = tmp_path_factory.mktemp("site")
    options = ["-W", "--keep-going", "-q", "-E", "-j", "auto", "-d", str(folder / "doctrees")]
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder / "html")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_site_has_every_page_and_links_within_itself_alone(site: Path) -> None:
    built = {path.relative_to(site).with_suffix(".md").as_posix() for path in site.rglob("*.html")}
    assert all_pages() <= built
    assert {f"_repository/{path}.md" for path in linked() if (ROOT / path).is_file()} <= {
        path.relative_to(site).as_posix().removesuffix(".html") + ".md"
        for path in (site / "_repository").rglob("*.html")
    }
    assert "shock_response_spectrum" in (site / "searchindex.js").read_text(encoding="utf-8")
    assert "pyroshock.ingest.load" in (site / "genindex.html").read_text(encoding="utf-8")
    parts = re.compile(
        r"""<(?:script|link|img|iframe)[^>]*(?:src|href)=["']((?:https?:)?//[^"']+)"""
    )
    assert {
        found
        for page in site.rglob("*.html")
        for found in parts.findall(page.read_text(encoding="utf-8"))
    } == set()
    imported = re.compile(r"@import|url\(\s*[\"']?(?:https?:)?//")
    assert [
        path for path in site.rglob("*.css") if imported.search(path.read_text(encoding="utf-8"))
    ] == []
    missing = set()
    for page in site.rglob("*.html"):
        for target in re.findall(r'href="([^"#?]+)', page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:", target) and not (page.parent / target).exists():
                missing.add((page.relative_to(site).as_posix(), target))
    assert missing == set()


# --- every link of the Markdown leads to a file, and to a heading where it names one ---
@pytest.mark.parametrize(
    "page", links.pages(), ids=lambda page: page.relative_to(links.ROOT).as_posix()
)
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    assert list(links.wrong(page)) == []


def test_first_pages_are_looked_at_and_generated_headings_can_be_led_to() -> None:
    names = {page.relative_to(links.ROOT).as_posix() for page in links.pages()}
    assert names >= {
        "README.md",
        "CHANGELOG.md",
        "docs/index.md",
        "docs/reference/store.md",
        "docs/decisions/README.md",
    }
    assert "pyroshock-plan-lhs" in links.anchors(links.ROOT / "docs" / "reference" / "commands.md")


@pytest.mark.parametrize(("text", "told"), [
    ("[a](missing.md)", "missing.md: no such file"),
    ("text\n\n![a](missing.png)", "missing.png: no such file"),
    ("[a](#nowhere)", "#nowhere: no heading of this name; there are: a-title"),
    ("<a href='other.md#b'>b</a>",
     "other.md#b: no heading of this name; there are: one, one-1, the-store"),
    ("[a][b]\n\n[b]: gone/", "gone/: no such file"),
])  # fmt: skip
def test_a_link_to_nowhere_is_told(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "other.md").write_text("# The `store`\n\n## One\n\n## One\n")
    page = tmp_path / "page.md"
    page.write_text(f"# A title\n\n{text}\n")
    assert [line.split(": ", 1)[1] for line in links.wrong(page)] == [told]


@pytest.mark.parametrize("text", [
    "[a](other.md#one-1) [b](other.md) [c](.) [d](https://example.org/gone) [e](#a-title)",
    "`[a](missing.md)`",
    "```\n[a](missing.md)\n```",
])  # fmt: skip
def test_nothing_is_said_of_links_that_lead_somewhere(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.md").write_text("# One\n\n# One\n")
    page = tmp_path / "page.md"
    page.write_text(f"# A title\n\n{text}\n")
    assert list(links.wrong(page)) == []
