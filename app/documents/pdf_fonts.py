"""The fonts of a PDF, which its file holds: DejaVu Sans (matplotlib brings it), and Noto Sans CJK
for Chinese, Japanese and Korean letters. No font of the machine is read, so that a report looks the
same wherever it is made."""

from __future__ import annotations

import struct
import unicodedata
from functools import cache
from pathlib import Path

import manimgx_fonts_cjk

#: The place of a letter that no font has.
PLACEHOLDER = "□"
#: Characters that a remark names before it counts.
_MOST_NAMED = 8
_CJK_FILE = Path(str(manimgx_fonts_cjk.__file__)).with_name("NotoSansCJK-VF.otf.ttc")
_NAMES = {"regular": "DejaVuSans.ttf", "bold": "DejaVuSans-Bold.ttf"}
#: The faces of the collection, by the language whose shapes they have.
_FACES = {"ja": 0, "ko": 1, "zh": 2}


def font_file(name: str) -> bytes:
    """The font "regular" or "bold", or the collection with the face "ja", "ko" or "zh" first.

    A style cannot choose among the faces of a collection, and a reader takes the first.
    """
    if name in _NAMES:
        return _dejavu(name).read_bytes()
    content = bytearray(_CJK_FILE.read_bytes())
    (first,) = struct.unpack_from(">I", content, 12)
    (face,) = struct.unpack_from(">I", content, 12 + 4 * _FACES[name])
    struct.pack_into(">I", content, 12, face)
    struct.pack_into(">I", content, 12 + 4 * _FACES[name], first)
    return bytes(content)


def _dejavu(name: str) -> Path:
    import matplotlib as mpl

    return Path(mpl.get_data_path()) / "fonts" / "ttf" / _NAMES[name]


def language_of(text: str) -> str:
    """Which shapes the shared letters of `text` have: kana are Japanese, Hangul is Korean."""
    names = [unicodedata.name(letter, "") for letter in set(text)]
    if any(name.startswith(("HIRAGANA", "KATAKANA")) for name in names):
        return "ja"
    return "ko" if any(name.startswith("HANGUL") for name in names) else "zh"


def needs_cjk(text: str) -> bool:
    """Whether `text` has letters that only the collection has."""
    return any(ord(letter) in _cjk_codes() - _latin_codes() for letter in set(text) if letter > "~")


def printable(text: str) -> str:
    """`text` with its accents joined (names of files from a Mac have them apart) and □ for each
    letter that no font has. Marks that only steer how those are drawn are left out."""
    if text.isascii():
        return text
    text = unicodedata.normalize("NFC", text)
    return text.translate(
        {ord(letter): "" if _steers(letter) else PLACEHOLDER for letter in _missing(text)}
    )


def remarks_on_letters(text: str) -> list[str]:
    """What a reader must know of how the letters of `text` are shown, a sentence each."""
    missing = [letter for letter in _missing(text) if not _steers(letter)]
    if not missing:
        return []
    names = [
        f"U+{ord(letter):04X} {unicodedata.name(letter, 'without a name')}" for letter in missing
    ]
    more = [f"and {len(names) - _MOST_NAMED} more"] if len(names) > _MOST_NAMED else []
    return [
        f"{PLACEHOLDER} stands in this PDF for characters that its fonts lack: "
        f"{', '.join([*names[:_MOST_NAMED], *more])}. The same report as HTML shows them."
    ]


def _missing(text: str) -> list[str]:
    letters = {letter for letter in unicodedata.normalize("NFC", text) if letter > "~"}
    return sorted(
        letter
        for letter in letters
        if ord(letter) not in _latin_codes() and ord(letter) not in _cjk_codes()
    )


def _steers(letter: str) -> bool:
    """Joiners, marks of direction and selectors of a variant, which have no picture of their
    own."""
    return unicodedata.category(letter) == "Cf" or "VARIATION SELECTOR" in unicodedata.name(
        letter, ""
    )


@cache
def _latin_codes() -> frozenset[int]:
    return _codes(_dejavu("regular"))


@cache
def _cjk_codes() -> frozenset[int]:
    """All faces of the collection have the same letters, each in the shapes of its region."""
    return _codes(_CJK_FILE)


def _codes(font: Path) -> frozenset[int]:
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(font)).get_charmap())
