"""Labels under seal: their hashes are published before a diagnosis begins, their text is read after it has ended.

The salt of the hashes is the key of the cipher, and is kept apart from both.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import secrets
from collections.abc import Sequence
from pathlib import Path

from ...virtualbench.seal import SealError
from .case import Label

KEY_BYTES = 32


def new_key() -> bytes:
    """A key, of the operating system's randomness."""
    return secrets.token_bytes(KEY_BYTES)


def publish(labels: Sequence[Label], key: bytes) -> tuple[str, ...]:
    """Salted SHA-256 of each label: nothing can be learnt from it, and nothing changed after it is known."""
    return tuple(label.sha256(key) for label in labels)


def seal_labels(labels: Sequence[Label], path: Path, key: bytes) -> None:
    """Write labels that nobody reads without the key. Raises `SealError` where a file exists."""
    if path.exists():
        raise SealError(f"{path}: there are sealed labels already; expected a new name")
    text = json.dumps([label.as_json() for label in labels]).encode()
    nonce = hashlib.sha256(b"nonce" + key + text).digest()[:16]
    sealed = _crypt(text, key, nonce)
    table = {"nonce": nonce.hex(), "tag": _tag(sealed, key, nonce), "sealed": sealed.hex()}
    path.write_text(json.dumps(table), encoding="utf-8")


def open_labels(path: Path, key: bytes, published: Sequence[str] | None = None) -> list[Label]:
    """Read sealed labels, and compare them with what was published of them.

    Raises `SealError` for a wrong key, a changed file, and labels other than those published.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        nonce, sealed, tag = bytes.fromhex(table["nonce"]), bytes.fromhex(table["sealed"]), str(table["tag"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SealError(f"{path}: not sealed labels: {error}") from error
    if not hmac.compare_digest(tag, _tag(sealed, key, nonce)):
        raise SealError(f"{path}: the key does not fit, or the file was changed")
    labels = [Label.from_json(row) for row in json.loads(_crypt(sealed, key, nonce))]
    if published is not None and list(published) != list(publish(labels, key)):
        raise SealError(f"{path}: other labels than those whose hashes were published")
    return labels


def _crypt(text: bytes, key: bytes, nonce: bytes) -> bytes:
    """Exclusive or with SHAKE-256 of key and nonce: its own inverse."""
    stream = hashlib.shake_256(b"labels" + key + nonce).digest(len(text))
    return (int.from_bytes(text) ^ int.from_bytes(stream)).to_bytes(len(text))


def _tag(sealed: bytes, key: bytes, nonce: bytes) -> str:
    return hmac.new(b"tag" + key, nonce + sealed, "sha256").hexdigest()
