"""What a file is follows from its bytes: pictures that Pillow writes, documents of other programs,
and what only pretends."""

from __future__ import annotations

import struct
from io import BytesIO

import openpyxl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from pyroshock.files.media_types import MediaType, MediaTypeError, media_type_of
from support.records.attached_files import HTML, PDF, SVG, picture, png_of_size, zipped

_PICTURES = {"JPEG": "image/jpeg", "PNG": "image/png", "GIF": "image/gif", "WEBP": "image/webp"}


@pytest.mark.parametrize("kind", _PICTURES)
@pytest.mark.parametrize("size", [(1, 1), (64, 48), (1999, 3)])
def test_a_picture_is_known_with_the_size_that_another_program_gave_it(
    kind: str, size: tuple[int, int]
) -> None:
    assert media_type_of(picture(kind, size)) == MediaType(_PICTURES[kind], *size)


@pytest.mark.parametrize("options", [
    {"format": "JPEG", "progressive": True, "comment": b"x" * 60_000},
    {"format": "WEBP", "lossless": True},
    {"format": "WEBP", "exif": b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x00\x00\x00\x00\x00"},
    {"format": "PNG", "interlace": 1},
], ids=["progressive", "lossless", "extended", "interlaced"])  # fmt: skip
def test_the_size_is_found_in_every_layout_of_a_format(options: dict) -> None:
    into = BytesIO()
    Image.new("RGB", (321, 123)).save(into, **options)
    kind = media_type_of(into.getvalue())
    assert (kind.width_px, kind.height_px) == (321, 123)


def test_office_files_are_known_by_what_is_in_them() -> None:
    into = BytesIO()
    openpyxl.Workbook().save(into)
    office = "application/vnd.openxmlformats-officedocument."
    assert media_type_of(into.getvalue()).name == f"{office}spreadsheetml.sheet"
    word = zipped(**{"[Content__Types]_xml": b"<x/>", "word__document_xml": b"<x/>"})
    assert media_type_of(word).name == f"{office}wordprocessingml.document"
    text = b"application/vnd.oasis.opendocument.text"
    assert media_type_of(zipped(mimetype=text, content_xml=b"<x/>")).name == text.decode()
    assert media_type_of(zipped(mimetype=b"text/html", a_txt=b"x")).name == "application/zip"


@pytest.mark.parametrize("content", [
    b"time_s,force_n\n0,1\n", "Prüfstand, 3 µm\n".encode(), "Prüfstand, 3 µm\n".encode("latin-1"),
    "Kraft;Zeit\n".encode("utf-16"), b"# Title\n\na <b>word</b>\n", b"\xef\xbb\xbfa,b\n", b"\n",
])  # fmt: skip
def test_texts_are_texts_in_the_encodings_that_instruments_write(content: bytes) -> None:
    assert media_type_of(content) == MediaType("text/plain")


def test_a_pdf_is_known_by_its_mark() -> None:
    assert media_type_of(PDF) == MediaType("application/pdf")


@pytest.mark.parametrize(("content", "words"), [
    (b"", "empty"),
    (HTML, "HTML, SVG or XML"), (SVG, "HTML, SVG or XML"), (b"  \n\t" + HTML, "HTML, SVG or XML"),
    (b"\xef\xbb\xbf" + HTML, "HTML, SVG or XML"), (HTML.decode().encode("utf-16"), "HTML, SVG"),
    (b"<?xml version='1.0'?><?xml-stylesheet href='x'?><a/>", "HTML, SVG or XML"),
    (b"<!--x--><SCRIPT>1</SCRIPT>", "HTML, SVG or XML"),
    (b"MZ\x90\x00" + bytes(200), "no kind that is known"), (b"\x7fELF\x02\x01", "no kind"),
    (bytes(64), "no kind that is known"), (b"\xff\xfe\x00", "no kind that is known"),
    (b"\x89PNG\r\n\x1a\n", "no whole picture"), (b"\xff\xd8\xff\xe0\x00\x10JFIF", "no whole"),
    (b"\xff\xd8\xff\xe0\x00\x00" + bytes(50), "no whole"), (b"GIF89a\x01", "no whole picture"),
    (b"GIF89a\x00\x00\x00\x00", "no whole picture"), (b"RIFF\x00\x00\x00\x00WEBPVP8 ", "no whole"),
    (b"PK\x03\x04" + bytes(40), "cannot be read"), (png_of_size(0, 5), "no whole picture"),
    (png_of_size(2**31, 5), "no whole picture"),
])  # fmt: skip
def test_what_may_run_and_what_is_not_known_is_refused_in_words(content: bytes, words: str) -> None:
    with pytest.raises(MediaTypeError, match=words):
        media_type_of(content)


def test_a_wave_is_no_picture() -> None:
    with pytest.raises(MediaTypeError, match="no kind that is known"):
        media_type_of(b"RIFF" + struct.pack("<I", 36) + b"WAVEfmt " + bytes(24))


def test_a_picture_of_a_thousand_million_pixels_is_only_read_by_its_header() -> None:
    kind = media_type_of(png_of_size(40_000, 30_000))
    assert (kind.width_px, kind.height_px, kind.pixels) == (40_000, 30_000, 1_200_000_000)


_BEGINNINGS = (b"", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"GIF89a", b"RIFF0000WEBP", b"PK\x03")


@given(beginning=st.sampled_from(_BEGINNINGS), rest=st.binary(max_size=200))
@settings(max_examples=300, deadline=None)
def test_any_bytes_are_known_or_refused(beginning: bytes, rest: bytes) -> None:
    try:
        kind = media_type_of(beginning + rest)
    except MediaTypeError:  # a refusal is right for any bytes; another error is not
        return
    assert kind.name.partition("/")[0] in ("image", "text", "application")


@pytest.mark.parametrize("kind", _PICTURES)
def test_a_cut_picture_is_known_or_refused(kind: str) -> None:
    content = picture(kind)
    for length in range(len(content)):
        try:
            found_size = media_type_of(content[:length])
        except MediaTypeError:  # a refusal is right for a cut file; another error is not
            continue
        assert (found_size.width_px, found_size.height_px) in ((64, 48), (None, None))
