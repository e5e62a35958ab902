"""The fonts of a PDF, which its file holds: DejaVu Sans (matplotlib brings it), and Noto Sans CJK
for Chinese, Japanese and Korean letters. No font of the machine is read, so that a report looks the
same wherever it is made.

ReportLab embeds quadratic outlines (TrueType) and Noto's are cubic ones of variable weight (CFF2):
the letters of a document are converted when its PDF begins.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from pathlib import Path
from threading import RLock
from typing import Any

import manimgx_fonts_cjk
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfbase.ttfonts import TTFont

REGULAR, BOLD = "DejaVuSans", "DejaVuSans-Bold"
_CJK_FILE = Path(str(manimgx_fonts_cjk.__file__)).with_name("NotoSansCJK-VF.otf.ttc")
#: Of the letters that DejaVu lacks, by the font that they stand beside.
_CJK_NAMES = {REGULAR: "NotoSansCJK", BOLD: "NotoSansCJK-Bold"}
_CJK_WEIGHTS = {REGULAR: 400, BOLD: 700}
#: The place of a letter that no font has.
PLACEHOLDER = "□"
#: Characters that a remark names before it counts.
_MOST_NAMED = 8
#: ReportLab keeps the fonts of a process by their names: one document at a time has letters under
#: these.
_CJK_IN_USE = RLock()


@cache
def fonts() -> tuple[str, str]:
    """The names of regular and bold, registered once: Latin, Greek, Cyrillic, ± and ≤ are in
    them."""
    import matplotlib

    for name in (REGULAR, BOLD):
        pdfmetrics.registerFont(
            TTFont(name, Path(matplotlib.get_data_path()) / "fonts" / "ttf" / f"{name}.ttf")
        )
    return REGULAR, BOLD


@contextmanager
def document_fonts(text: str) -> Iterator[None]:
    """Every font that `text` needs is registered within the block."""
    fonts()
    letters = _cjk_letters(text)
    if not letters:
        yield
        return
    with _CJK_IN_USE:
        faces = _converted(letters, _face(text))
        for font in faces:
            pdfmetrics.registerFont(font)
        try:
            yield
        finally:
            for font in faces:
                font.unregister()


def font_runs(text: str, font: str) -> list[tuple[str, str]]:
    """`text` in pieces with the font of each: `font` or, for letters that it lacks, another that
    has them. □ stands for a letter that none has; marks that only steer how others are drawn are
    left out then."""
    if text.isascii():
        return [(font, text)]
    beside = font if font in _CJK_NAMES else REGULAR
    runs: list[tuple[str, str]] = []
    for letter in unicodedata.normalize(
        "NFC", text
    ):  # names of files from a Mac have their accents apart
        name, shown = _font_of(letter, beside), letter
        if name is None:
            name, shown = beside, "" if _steers(letter) else PLACEHOLDER
        name = font if name == beside else name
        if runs and runs[-1][0] == name:
            runs[-1] = (name, runs[-1][1] + shown)
        else:
            runs.append((name, shown))
    return runs


def width_of(text: str, font: str, size: float) -> float:
    """Points that `text` is wide, each letter in the font that has it."""
    return float(sum(stringWidth(piece, name, size) for name, piece in font_runs(text, font)))


def marked_letters(markup: str, font: str) -> tuple[str, bool]:
    """Escaped text in which the letters that `font` lacks bear their own font, and whether there
    are any."""
    runs = font_runs(markup, font)
    marked = "".join(
        piece if name == font else f'<font name="{name}">{piece}</font>' for name, piece in runs
    )
    return marked, any(name != font for name, _ in runs)


def remarks_on_letters(text: str) -> list[str]:
    """What a reader must know of how the letters of `text` are shown, a sentence each."""
    if text.isascii():
        return []
    letters = sorted(set(unicodedata.normalize("NFC", text)))
    missing = [
        letter for letter in letters if _font_of(letter, REGULAR) is None and not _steers(letter)
    ]
    remarks = []
    if missing:
        names = [
            f"U+{ord(letter):04X} {unicodedata.name(letter, 'without a name')}"
            for letter in missing
        ]
        more = [f"and {len(names) - _MOST_NAMED} more"] if len(names) > _MOST_NAMED else []
        remarks.append(
            f"{PLACEHOLDER} stands in this PDF for characters that its fonts lack: "
            f"{', '.join([*names[:_MOST_NAMED], *more])}. The same report as HTML shows them."
        )
    if any(
        unicodedata.bidirectional(letter) in ("R", "AL")
        for letter in letters
        if letter not in missing
    ):
        remarks.append(
            "Arabic and Hebrew letters stand unjoined and from left to right in this PDF. The same "
            "report as HTML shows them joined and from right to left."
        )
    return remarks


def _steers(letter: str) -> bool:
    """Joiners, marks of direction and selectors of a variant, which have no picture of their
    own."""
    return unicodedata.category(letter) == "Cf" or "VARIATION SELECTOR" in unicodedata.name(
        letter, ""
    )


def _font_of(letter: str, beside: str) -> str | None:
    """The font of a letter that stands in a text of the font `beside`."""
    if ord(letter) <= 0x7E:
        return beside
    for name in (beside, REGULAR):
        if ord(letter) in _own_letters(name):
            return name
    return _CJK_NAMES[beside] if ord(letter) in _cjk_codes() else None


@cache
def _own_letters(name: str) -> frozenset[int]:
    fonts()
    return frozenset(pdfmetrics.getFont(name).face.charToGlyph)


@cache
def _cjk_codes() -> frozenset[int]:
    """All five faces of the file have the same letters, each in the shapes of its region."""
    from fontTools.ttLib import TTFont as SourceFont

    with SourceFont(_CJK_FILE, fontNumber=0, lazy=True) as source:
        return frozenset(source.getBestCmap())


def _cjk_letters(text: str) -> list[str]:
    """Those that a regular or a bold text takes from Noto Sans CJK."""
    letters = sorted(set(unicodedata.normalize("NFC", text)))
    return [
        letter
        for letter in letters
        if any(_font_of(letter, font) == name for font, name in _CJK_NAMES.items())
    ]


def _face(text: str) -> int:
    """Which face of the file has the shapes of the text's language: kana are Japanese, Hangul is
    Korean."""
    names = [unicodedata.name(letter, "") for letter in set(text)]
    japanese, korean, chinese = 0, 1, 2
    if any(name.startswith(("HIRAGANA", "KATAKANA")) for name in names):
        return japanese
    return korean if any(name.startswith("HANGUL") for name in names) else chinese


def _converted(letters: Sequence[str], face: int) -> list[TTFont]:
    """Fonts of `letters` alone, regular and bold."""
    from fontTools.ttLib import TTFont as SourceFont

    with SourceFont(_CJK_FILE, fontNumber=face, lazy=True) as source:
        by_code = source.getBestCmap()
        names = {ord(letter): by_code[ord(letter)] for letter in letters}
        return [
            TTFont(name, _truetype(source, names, _CJK_WEIGHTS[beside]))
            for beside, name in _CJK_NAMES.items()
        ]


def _truetype(source: Any, names: dict[int, str], weight: int) -> BytesIO:
    """The glyphs called `names` (by code point) of a font, at that weight (100 to 900), as a
    TrueType file."""
    from fontTools.fontBuilder import FontBuilder
    from fontTools.pens.cu2quPen import Cu2QuPen
    from fontTools.pens.ttGlyphPen import TTGlyphPen

    units, line = source["head"].unitsPerEm, source["hhea"]
    outlines, glyphs, advances = source.getGlyphSet(location={"wght": weight}), {}, {}
    for name in [".notdef", *dict.fromkeys(names.values())]:
        pen = TTGlyphPen(None)
        outlines[name].draw(Cu2QuPen(pen, max_err=units / 1000, reverse_direction=True))
        glyphs[name], advances[name] = pen.glyph(), round(outlines[name].width)
    family, style = "Noto Sans CJK", {400: "Regular", 700: "Bold"}[weight]
    builder = FontBuilder(units, isTTF=True)
    builder.setupGlyphOrder(list(glyphs))
    builder.setupCharacterMap(names)
    builder.setupGlyf(glyphs)
    table = builder.font["glyf"]
    builder.setupHorizontalMetrics(
        {name: (advances[name], getattr(table[name], "xMin", 0)) for name in glyphs}
    )
    builder.setupHorizontalHeader(ascent=line.ascent, descent=line.descent)
    builder.setupNameTable(
        {"familyName": family, "styleName": style, "psName": f"NotoSansCJK-{style}"}
    )
    builder.setupOS2(sTypoAscender=line.ascent, sTypoDescender=line.descent, usWeightClass=weight)
    builder.setupPost()
    builder.updateHead(created=0, modified=0)  # the same letters give the same bytes
    builder.font.recalcTimestamp = False
    file = BytesIO()
    builder.font.save(file)
    file.seek(0)
    return file
