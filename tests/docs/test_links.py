"""Every link of the repository's Markdown leads to a file, and to a heading where it names one."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("markdown_it", reason="no markdown-it-py: it comes with pyroshock[docs]")
pytest.importorskip("sphinx", reason="no Sphinx: it comes with pyroshock[docs]")

from tools import links


@pytest.mark.parametrize("page", links.pages(), ids=lambda page: page.relative_to(links.ROOT).as_posix())
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
    ("<a href='other.md#b'>b</a>", "other.md#b: no heading of this name; there are: one, one-1, the-store"),
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
