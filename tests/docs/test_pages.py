"""Every command that a page shows: run, page by page, from top to bottom; what cannot be run here
is parsed."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import click
import pytest
from doc_pages.blocks import COMMANDS, PYTHON, Block, blocks_of, inline_statements, statements_of
from doc_pages.givens import GIVENS, prepare
from doc_pages.parsing import ROOT, check
from doc_pages.running import alike, missing, place_in, run_block

DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(p for p in DOCS.rglob("*.md") if "_build" not in p.parts)]
BLOCKS = {page: blocks_of(page) for page in PAGES}
#: Pages that take more than some seconds; the default tests run the others, and parse all.
SLOW = {
    "README.md",
    "docs/how-to/use-a-cluster.md",
    "docs/how-to/deploy-a-server.md",
    "docs/explanation/diagnosis.md",
    "docs/how-to/compare.md",
    "docs/how-to/diagnose.md",
    "docs/how-to/ingest.md",
    "docs/how-to/plan.md",
    "docs/explanation/plans.md",
    "docs/how-to/twin-from-python.md",
    "docs/how-to/use-a-server-from-python.md",
    "docs/how-to/use-from-python.md",
    "docs/explanation/registry.md",
    "docs/tutorial/start.md",
    "docs/measurements/studies.md",
    "docs/explanation/tuning.md",
    "docs/explanation/twin.md",
    "docs/explanation/virtual-bench.md",
    "docs/how-to/use-the-pages.md",
}
#: How many blocks may have a reason for not being run: one more is a choice that somebody makes
#: here.
NOT_RUN = 6


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def _marks(page: Path) -> list[pytest.MarkDecorator]:
    return [pytest.mark.slow, pytest.mark.timeout(600)] if name_of(page) in SLOW else []


RUN = [
    pytest.param(page, id=name_of(page), marks=_marks(page))
    for page, blocks in BLOCKS.items()
    if any(block.runs and not block.not_run for block in blocks)
]
SHOWN = [
    pytest.param(block, id=f"{name_of(page)}:{block.line}")
    for page, blocks in BLOCKS.items()
    for block in blocks
    if block.language == COMMANDS
]
LEFT_OUT = [block for blocks in BLOCKS.values() for block in blocks if block.not_run]


@pytest.mark.parametrize("page", RUN)
def test_page_runs_as_it_is_printed(
    page: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with place_in(tmp_path, request) as place:
        for block in BLOCKS[page]:
            for words in block.given:
                prepare(words, place)
            if block.runs and not block.not_run:
                run_block(block, place)


@pytest.mark.parametrize("block", SHOWN)
def test_commands_exist_with_their_options(block: Block, monkeypatch: pytest.MonkeyPatch) -> None:
    # files of the page's own are not here; that they must exist is not the question
    monkeypatch.setattr(click.Path, "convert", lambda self, value, *_: value)
    for statement in statements_of(block):
        check(statement)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_in_the_prose_exist_and_others_stand_in_blocks(
    page: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(click.Path, "convert", lambda self, value, *_: value)
    for statement in inline_statements(page):
        with contextlib.suppress(click.BadParameter):  # `pyroshock diagnose` alone; N for a number
            check(statement)
    # A block that tells no language is shown as it stands, and would be passed over here.
    others = [block for block in BLOCKS[page] if not block.runs]
    hidden = [
        block.line
        for block in others
        if re.search(r"^(\.venv/bin/)?(pyroshock|make|python) ", block.text, re.M)
    ]
    assert hidden == []


def test_what_is_not_run_has_its_reason_and_marks_name_what_can_be_prepared() -> None:
    told = "\n".join(f"{name_of(block.page)}:{block.line}: {block.not_run}" for block in LEFT_OUT)
    print(told)
    assert all(block.language in (COMMANDS, PYTHON) for block in LEFT_OUT), told
    assert len(LEFT_OUT) <= NOT_RUN, told
    given = {
        words.split()[0] for blocks in BLOCKS.values() for block in blocks for words in block.given
    }
    assert given == set(GIVENS)


# the tools themselves, for a test of pages that cannot fail holds nothing


def page_of(folder: Path, text: str) -> Path:
    (folder / "page.md").write_text(text, encoding="utf-8")
    return folder / "page.md"


def run(folder: Path, request: pytest.FixtureRequest, text: str) -> None:
    (block,) = blocks_of(page_of(folder, text))
    (folder / "place").mkdir()
    with place_in(folder / "place", request) as place:
        run_block(block, place)


@pytest.mark.parametrize(("text", "complaint"), [
    ("```sh\npyroshock campaigns\n```\n", "page.md:2"),  # there is no store
    ("```sh\npyroshock materials --db sqlite:///a.db --colour\n```\n", "page.md:2|no such option"),
    ("```sh\npyroshok init\n```\n", "no program"),
    ("```sh\nmake tea\n```\n", "tea"),
    ("```sh\npip install 'pyroshock[tea]'\n```\n", "tea"),
    ("```sh\npython -m benchmarks.tea\n```\n", "no such module"),
    ("<!-- exit code: 2 -->\n```sh\npyroshock init\n```\n", "ended with 0, not 2"),
    ("```sh\npyroshock init\n```\n\nsays\n\n```text\nstore ready: nowhere\n```\n",
     "does not print"),
    ("```python\nassert 1 == 2, 'sums'\n```\n", "sums"),
])  # fmt: skip
def test_wrong_pages_fail(
    text: str, complaint: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with pytest.raises((AssertionError, click.ClickException), match=f"(?i){complaint}"):
        run(tmp_path, request, text)


def test_right_page_passes_with_lines_in_their_order(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    run(
        tmp_path,
        request,
        "```sh\nexport PYROSHOCK_DB=sqlite:///a.db\npyroshock "
        "init\n```\n\n```text\nstore ready: …\n```\n",
    )
    assert missing("a\n…\nc\n", "a\nb\nc\n") is None and missing("c\na\n", "a\nb\nc\n") == "a"


@pytest.mark.parametrize(
    "text", ["```sh\npyroshock init\n", "<!-- given: file a b -->\n\nnothing\n"]
)
def test_page_that_does_not_end_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"page.md"):
        blocks_of(page_of(tmp_path, text))


@pytest.mark.parametrize(("wanted", "told", "are"), [
    ("peak 195.35 N", "peak 195.36 N", True),
    ("peak 195.35 N", "peak 205.35 N", False),
    ("5 shots", "6 shots", False),
    ("share 0.01", "share 0.02", True),  # the last digit
    ("share 0.01", "share 0.05", False),
    ("93 % of it", "92 % of it", True),
    ("93 % of it", "83 % of it", False),
    ("written: a …", "written: a, 3 lines", False),
    ("written: …", "written: b, 3 lines", True),
    ("force", "velocity", False),
])  # fmt: skip
def test_figures_may_differ_in_their_last_digits(wanted: str, told: str, are: bool) -> None:
    assert alike(wanted, told) is are
