"""Whether every link in the Markdown of the repository leads somewhere, anchors included: `make
links`.

Files, folders and headings of the repository alone; addresses elsewhere are asked for by `make
docs-links`.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).resolve().parents[1]
_ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)
_HTML_LINK = re.compile(r"""(?:href|src)=["']([^"']+)["']""")
_GENERATED = re.compile(r"^<!-- (?:generated: [a-z ]+|the file \w+\.md) -->$", re.MULTILINE)


def pages(root: Path = ROOT) -> list[Path]:
    """The Markdown that readers see: files of the root, and all pages of `docs`, `examples` and
    `deploy`."""
    below = [
        path for folder in ("docs", "examples", "deploy") for path in (root / folder).rglob("*.md")
    ]
    return [
        *sorted(root.glob("*.md")),
        *sorted(path for path in below if "_build" not in path.parts),
    ]


def wrong(page: Path) -> Iterator[str]:
    """A line for each link of a page that leads nowhere."""
    for line, target in links(page.read_text(encoding="utf-8")):
        if reason := objection(page, target):
            yield f"{page}:{line}: {target}: {reason}"


def links(text: str) -> Iterator[tuple[int, str]]:
    """Line and target of every link and picture of a page, those to other hosts left out."""
    for token, line in _tokens(text):
        found = [token.attrs.get("href"), token.attrs.get("src")]
        if token.type in ("html_inline", "html_block"):
            found = list(_HTML_LINK.findall(token.content))
        yield from (
            (line, str(target)) for target in found if target and not _ELSEWHERE.match(str(target))
        )


def objection(page: Path, target: str) -> str | None:
    """Why a link of `page` leads nowhere; None where it does."""
    path, _, anchor = target.partition("#")
    there = (page.parent / path).resolve() if path else page.resolve()
    if not there.exists():
        return "no such file"
    if anchor and there.suffix == ".md" and anchor not in anchors(there):
        return f"no heading of this name; there are: {', '.join(sorted(anchors(there)))}"
    return None


@cache
def anchors(page: Path) -> frozenset[str]:
    """Names of a page's headings, as repository hosts make them; what is generated on the site is
    counted in."""
    text = page.read_text(encoding="utf-8")
    if _GENERATED.search(text):
        from tools.site.pages import prepared

        text = prepared(text)
    names: Counter[str] = Counter()
    found = set()
    for heading in _headings(text):
        slug = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        found.add(f"{slug}-{names[slug]}" if names[slug] else slug)
        names[slug] += 1
    return frozenset(found)


def _tokens(text: str) -> Iterator[tuple[Token, int]]:
    line = 1
    for token in MarkdownIt("commonmark").enable("table").parse(text):
        line = token.map[0] + 1 if token.map else line
        yield token, line
        yield from ((child, line) for child in token.children or ())


def _headings(text: str) -> Iterator[str]:
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    for before, token in pairwise(tokens):
        if before.type == "heading_open":
            yield "".join(
                child.content
                for child in token.children or ()
                if child.type in ("text", "code_inline")
            )


def main() -> int:
    """0: all lead somewhere; 1: some do not, a line each."""
    found = pages()
    lines = [line for page in found for line in wrong(page)]
    for line in lines:
        print(line.replace(f"{ROOT}/", ""), file=sys.stderr)
    print(f"links: {len(found)} pages, {len(lines)} links lead nowhere")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
