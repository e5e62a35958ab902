"""Attached pictures in the size in which pages and reports show them.

A picture comes from a stranger. Only four formats are read, what its header declares is looked at
before anything is decoded, and whatever the decoder refuses is told as one error.
"""

from __future__ import annotations

from io import BytesIO

from ...schema.attached_files import MOST_SHOWN_PIXELS

#: Pixels of the longer side: on a page with several beside each other, and printed across a page.
PREVIEW_PX, PRINTED_PX = 640, 1400
#: What a reduced picture is.
MEDIA_TYPE = "image/jpeg"
_FORMATS = ("JPEG", "PNG", "GIF", "WEBP")
_QUALITY = 85


class PictureError(ValueError):
    """A picture cannot be drawn; the message says why."""


def reduced_picture(content: bytes, largest_side_px: int) -> tuple[bytes, int, int]:
    """A picture as a JPEG of at most this size, upright, transparent parts on white.

    Parameters:
        content: The file. Of an animation its first frame is taken.
        largest_side_px: Pixels of the longer side.

    Returns:
        The new file, its width and its height in pixels.

    Raises:
        PictureError: For a picture that is damaged or has too many pixels.

    Source:
        Exif 2.32, tag 0x0112 (orientation).
    """
    import struct

    from PIL import Image, ImageOps

    try:
        with Image.open(BytesIO(content), formats=_FORMATS) as image:
            if image.width * image.height > MOST_SHOWN_PIXELS:
                raise PictureError(
                    f"a picture of {image.width} × {image.height} pixels is too large to be drawn"
                )
            # a JPEG is decoded at a fraction of its size, where that is large enough
            image.draft("RGB", (largest_side_px, largest_side_px))
            upright = ImageOps.exif_transpose(image)
            upright.thumbnail((largest_side_px, largest_side_px))
            flat = Image.new("RGB", upright.size, "white")
            drawn = upright.convert("RGBA")
            flat.paste(drawn, mask=drawn)
            into = BytesIO()
            flat.save(into, "JPEG", quality=_QUALITY)
            return into.getvalue(), flat.width, flat.height
    except PictureError:
        raise
    # what Pillow's readers raise of damaged files: UnidentifiedImageError and truncation (OSError),
    # chunks out of order (SyntaxError), declared sizes (DecompressionBombError is an Exception of
    # its own), fields that are too short (struct.error, IndexError, EOFError)
    except (
        *(OSError, SyntaxError, ValueError, TypeError, EOFError, LookupError, struct.error),
        *(OverflowError, MemoryError, Image.DecompressionBombError, Image.DecompressionBombWarning),
    ) as error:
        why = " ".join(str(error).split())
        raise PictureError(f"the picture is damaged and cannot be drawn: {why:.200}") from error
