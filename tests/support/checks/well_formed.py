"""Pages as a browser reads them: every element closed where it should be."""

from __future__ import annotations

from html.parser import HTMLParser

_VOID = ("meta", "br", "link", "img", "input", "wbr")


class Page(HTMLParser):
    """Raises where elements do not nest; collects elements with their attributes, and words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(self.words)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        """The attributes of all elements of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]


def needs_nothing(page: Page) -> bool:
    """Whether a page fetches nothing and runs nothing."""
    tags = {tag for tag, _ in page.elements}
    pointing = {key for _, attributes in page.elements for key in attributes} & {
        "src",
        "href",
        "srcset",
        "action",
    }
    handlers = {
        key for _, attributes in page.elements for key in attributes if key.startswith("on")
    }
    return not (
        tags & {"script", "link", "img", "iframe", "object", "embed"} or pointing or handlers
    )
