"""Pages as Sphinx reads them: with what is generated from the code, the site's tree, and files of
the root."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from .. import notebooks
from ..reference.subjects import asked, filled
from .contents import with_contents

ROOT = Path(__file__).resolve().parents[2]
#: A page that stands for a file of the root holds this mark.
_FILE = re.compile(r"^<!-- the file (\w+\.md) -->$", re.MULTILINE)
_LINK = re.compile(r"\]\((?![a-z]+:|#)([^)\s]+)\)")


def setup(app: Sphinx) -> None:
    """Connects the events."""
    app.connect("source-read", _read)
    app.connect("env-get-outdated", _outdated)


def prepared(text: str) -> str:
    """A page's text, complete."""
    return with_contents(filled(_FILE.sub(lambda mark: of_root(mark[1]), text)))


def of_root(name: str) -> str:
    """A file of the root without its title, its links seen from the folder of the pages."""
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    return _LINK.sub(lambda link: f"]({_from_docs(link[1])})", text)


def _from_docs(target: str) -> str:
    path, sign, anchor = target.partition("#")
    return posixpath.relpath(path, "docs") + ("/" if path.endswith("/") else "") + sign + anchor


def _read(_: Sphinx, _name: str, source: list[str]) -> None:
    source[0] = notebooks.shown(prepared(source[0]))


def _outdated(_: Sphinx, env: BuildEnvironment, *_sets: set[str]) -> list[str]:
    """Pages that hang on more than their own file are read anew, whatever its age. Their notebooks
    run here, before the pages are shared among processes."""
    texts = {name: Path(env.doc2path(name)).read_text(encoding="utf-8") for name in env.found_docs}
    notebooks.run_at_once(texts.values())
    return [
        name
        for name, text in texts.items()
        if asked(text) or _FILE.search(text) or notebooks.MARK.search(text)
    ]
