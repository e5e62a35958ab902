"""Links from pages to files and folders of the repository: on the site each has a page of its own.

On a repository host the same links lead to the files themselves.
"""

from __future__ import annotations

import html
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes  # type: ignore[import-untyped]  # it publishes no types
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

from .pages import ROOT

FOLDER = "_repository"
#: Files of the root that are pages of the site.
PAGES = {
    "README.md": "index",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "SECURITY.md": "security",
    "docs": "index",
}
_LINK = re.compile(r"\]\((?![a-z]+:|#)([^)#\s]+)")
_LANGUAGES = {".py": "python", ".sh": "bash", ".toml": "toml", ".yaml": "yaml", ".md": "markdown"}
_LEFT_OUT = ("__pycache__", "_build")


def setup(app: Sphinx) -> None:
    """Connects the transform and the pages of files."""
    app.add_transform(FileLinks)
    app.connect("html-collect-pages", _pages)


def linked() -> dict[str, Path]:
    """Path from the root -> file or folder, for all that pages and files of the root link to and
    that are no pages."""
    found: dict[str, Path] = {}
    docs = ROOT / "docs"
    of_root = [ROOT / name for name in PAGES if (ROOT / name).is_file()]
    for page in [*docs.rglob("*.md"), *of_root]:
        for target in _LINK.findall(page.read_text(encoding="utf-8")):
            if path := _inside(page.parent / target):
                found[path] = ROOT / path
    return found


def _inside(target: Path) -> str | None:
    """The path from the root of a text file or a folder that is no page of the site."""
    whole = target.resolve()
    if not whole.is_relative_to(ROOT) or not whole.exists():
        return None
    path = whole.relative_to(ROOT).as_posix()
    return None if _page(whole) or (whole.is_file() and _text(whole) is None) else path


def _page(whole: Path) -> str | None:
    """The page that a file or folder of the repository is; a folder's is its README."""
    path = whole.relative_to(ROOT).as_posix()
    if path in PAGES:
        return PAGES[path]
    if whole.is_dir():
        whole = whole / "README.md"
    in_docs = whole.is_relative_to(ROOT / "docs") and whole.suffix == ".md" and whole.is_file()
    return whole.relative_to(ROOT / "docs").with_suffix("").as_posix() if in_docs else None


class FileLinks(SphinxTransform):
    """Makes links to files lead to their pages, before anybody wonders what they are."""

    default_priority = 5

    def apply(self, **_: Any) -> None:
        """Links to pages, addresses and pictures stay as they are."""
        links = [
            *self.document.findall(addnodes.download_reference),
            *self.document.findall(addnodes.pending_xref),
        ]
        for link in links:
            if (target := self._target(link)) and (address := self._address(target)):
                link.replace_self(
                    nodes.reference("", "", *link.children, internal=False, refuri=address)
                )

    def _target(self, link: nodes.Element) -> Path | None:
        """The file or folder; None for what is no path. MyST takes a page outside of its folder for
        a document."""
        path = str(link.get("reftarget", "")).partition("#")[0]
        if not path or link.get("refdomain") not in (None, "", "doc"):
            return None
        if link.get("refdomain") == "doc":
            return Path(self.env.srcdir) / f"{path}.md"
        return Path(self.env.doc2path(self.env.docname)).parent / path

    def _address(self, target: Path) -> str | None:
        whole = target.resolve()
        if path := _inside(target):
            place = f"{FOLDER}/{path}/index" if whole.is_dir() else f"{FOLDER}/{path}"
        elif (
            whole.is_relative_to(ROOT)
            and (whole.is_dir() or whole.parent == ROOT)
            and (page := _page(whole))
        ):
            place = page
        else:
            return None
        return posixpath.relpath(f"{place}.html", posixpath.dirname(self.env.docname) or ".")


def _pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Of every file that is linked to, its text; of every folder, its files."""
    for path, place in sorted(linked().items()):
        if place.is_dir():
            body, name = _listing(place), f"{FOLDER}/{path}/index"
        else:
            text = _text(place) or ""
            language = {
                ".py": "python",
                ".sh": "bash",
                ".toml": "toml",
                ".yaml": "yaml",
                ".md": "markdown",
            }.get(place.suffix, "text")
            # Only builders of HTML have one.
            highlighter = getattr(app.builder, "highlighter")  # noqa: B009
            body, name = (
                highlighter.highlight_block(text, language, linenos=False),
                f"{FOLDER}/{path}",
            )
        yield name, {"title": path, "body": f"<h1>{html.escape(path)}</h1>{body}"}, "page.html"


def _listing(folder: Path) -> str:
    names = sorted(f"{each.name}/" if each.is_dir() else each.name for each in folder.iterdir())
    shown = [
        name for name in names if not name.startswith(".") and name.rstrip("/") not in _LEFT_OUT
    ]
    return f"<ul>{''.join(f'<li><code>{html.escape(name)}</code></li>' for name in shown)}</ul>"


def _text(place: Path) -> str | None:
    """None for what is no text."""
    try:
        return place.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None
