"""What a person reads on a page, and the words of the command line in it."""

from __future__ import annotations

import re
from html.parser import HTMLParser

_SPOKEN = re.compile(r"(?<![\w-])--[a-z]{2,}|\bpyroshock (?:[a-z]+ )*[a-z]+")


class PageText(HTMLParser):
    """The texts of a page, without scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._inside: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("script", "style", "footer"):
            self._inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if self._inside and tag == self._inside[-1]:
            self._inside.pop()

    def handle_data(self, data: str) -> None:
        if not self._inside:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def command_words(text: str) -> list[str]:
    """Options and commands that a text names; the software's own name stands in the menu."""
    return [match[0] for match in _SPOKEN.finditer(text.replace("pyroshock Campaigns", ""))]
