"""The site's tree, taken from the lists of links that readers see: a page is under the page that
lists it.

A page that ends with `<!-- contents -->` lists its children. Its headings become captions in the
site's margin.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

MARK = "<!-- contents -->"
_HEADING = re.compile(r"^## +(.+?)\s*$", re.MULTILINE)
_LINK = re.compile(r"\[[^\]]+\]\(([^)#:\s]+\.md)\)")


def with_contents(text: str) -> str:
    """A page with a hidden table of contents for each of its sections in the place of the mark."""
    if MARK not in text:
        return text
    trees = [_tree(caption, links) for caption, links in sections(text)]
    return text.replace(MARK, "\n\n".join(trees))


def sections(text: str) -> Iterator[tuple[str, list[str]]]:
    """Heading and listed pages (relative, as written) of each section that lists any; "" for what
    precedes them."""
    parts = _HEADING.split(text.split(MARK)[0])
    for caption, body in zip(["", *parts[1::2]], parts[0::2], strict=True):
        links = list(
            dict.fromkeys(link for link in _LINK.findall(body) if not link.startswith("../"))
        )
        if links:
            yield caption, links


def reachable(docs: Path, start: str = "index.md") -> set[str]:
    """Pages, relative to `docs`, that are reached by lists of contents from the first one, itself
    included."""
    found, waiting = {start}, [start]
    while waiting:
        page = waiting.pop()
        text = (docs / page).read_text(encoding="utf-8")
        if MARK not in text:
            continue
        listed = [
            posixpath.join(posixpath.dirname(page), link)
            for _, links in sections(text)
            for link in links
        ]
        waiting += [link for link in dict.fromkeys(listed) if link not in found]
        found |= set(listed)
    return found


def _tree(caption: str, links: list[str]) -> str:
    head = ["```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), ""]
    return "\n".join([*head, *(link.removesuffix(".md") for link in links), "```"])
