"""Pictures in the size of pages and reports: upright, small, and never unpacked beyond a limit."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from pyroshock.app.common.reduced_pictures import PictureError, reduced_picture
from pyroshock.schema.attached_files import MOST_SHOWN_PIXELS
from support.records.attached_files import picture, png_of_size


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "GIF", "WEBP"])
def test_a_picture_keeps_its_shape_and_colour(kind: str) -> None:
    content, width, height = reduced_picture(picture(kind, (800, 600), "lime"), 400)
    with Image.open(BytesIO(content)) as image:
        assert image.format == "JPEG" and image.size == (width, height) == (400, 300)
        assert np.allclose(np.asarray(image)[150, 200], (0, 255, 0), atol=15)


def test_a_small_picture_is_not_enlarged() -> None:
    assert reduced_picture(picture("PNG", (30, 20)), 400)[1:] == (30, 20)


def test_a_picture_of_a_turned_camera_stands_upright() -> None:
    image = Image.new("RGB", (60, 40), "blue")
    image.paste("red", (0, 0, 30, 40))
    exif = Image.Exif()
    exif[0x0112] = 6  # what is at the left of the file is on top of the scene
    into = BytesIO()
    image.save(into, "JPEG", exif=exif, quality=95)
    content, width, height = reduced_picture(into.getvalue(), 400)
    with Image.open(BytesIO(content)) as upright:
        assert (width, height) == (40, 60)
        assert upright.getpixel((20, 5))[0] > 200 and upright.getpixel((20, 55))[2] > 200


def test_transparent_parts_are_white() -> None:
    into = BytesIO()
    Image.new("RGBA", (20, 20), (255, 0, 0, 0)).save(into, "PNG")
    content, *_ = reduced_picture(into.getvalue(), 400)
    with Image.open(BytesIO(content)) as image:
        assert min(image.getpixel((10, 10))) > 250


@pytest.mark.parametrize("content", [
    png_of_size(40_000, 30_000), png_of_size(2**31 - 1, 2**31 - 1),
    png_of_size(MOST_SHOWN_PIXELS + 1, 1),
])  # fmt: skip
def test_a_bomb_is_refused_before_it_is_unpacked(content: bytes) -> None:
    with pytest.raises(PictureError):
        reduced_picture(content, 400)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "GIF", "WEBP"])
def test_a_damaged_picture_is_drawn_or_refused_in_words(kind: str) -> None:
    whole = picture(kind, (200, 100))
    for content in (whole[: len(whole) // 2], whole[:40] + bytes(60) + whole[100:], b"x" + whole):
        try:
            reduced_picture(content, 100)
        except PictureError as error:
            assert "cannot be drawn" in str(error)


def test_other_formats_that_pillow_knows_are_not_read() -> None:
    with pytest.raises(PictureError, match="cannot be drawn"):
        reduced_picture(picture("TIFF"), 400)
