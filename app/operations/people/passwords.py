"""Passwords: what is taken as one, and their Argon2id hashes."""

from __future__ import annotations

import unicodedata
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, StringConstraints, ValidationInfo

from ..fields import Presentation, request_field

if TYPE_CHECKING:
    from argon2 import PasswordHasher

SHORTEST, LONGEST = 12, 1_000
#: Long ones that many people choose; shorter ones are refused for their length.
COMMON = frozenset(
    (
        "administrator", "adminadminadmin", "changemechangeme", "correcthorsebatterystaple",
        "iloveyou1234", "iloveyouiloveyou", "letmeinletmein", "loginloginlogin",
        "monkeymonkey12", "p@ssw0rd1234", "pass1234pass", "password1234", "password12345",
        "password123456", "password2026", "passwordpassword", "princess1234", "pyroshock123",
        "pyroshock1234", "pyroshock2026", "pyroshockpyroshock", "q1w2e3r4t5y6", "qazwsxedcrfv",
        "qwerty123456", "qwertyqwerty", "qwertyuiop12", "qwertyuiop123", "qwertyuiopasdfghjkl",
        "secretsecret", "sunshine1234", "test12345678", "testtesttest", "trustno1trustno1",
        "welcome12345", "welcomewelcome", "zaq12wsxcde3",
    )
)  # fmt: skip
#: So many different characters at the least: "aaaaaaaaaaaa" and "121212121212" are none.
_DIFFERENT = 5


class PasswordError(ValueError):
    """A text that is not taken as a password. The message does not repeat it."""


def check_password(password: str, name: str = "") -> None:
    """Refuse a password that is short or is tried first by who guesses.

    Parameters:
        password: The text, of `SHORTEST` to `LONGEST` characters.
        name: The name of the person, which must not be all of it.

    Raises:
        PasswordError: It says what is expected, and does not repeat the password.
    """
    words = password.casefold()
    if not SHORTEST <= len(password) <= LONGEST:
        raise PasswordError(
            f"the password has {len(password)} characters; expected {SHORTEST} to {LONGEST:,}"
        )
    runs = ("0123456789" * 3, "abcdefghijklmnopqrstuvwxyz" * 2)
    is_run = any(words in run or words[::-1] in run for run in runs)
    without_name = words.replace(name.casefold(), "") if name else words
    if words in COMMON or is_run or len(set(words)) < _DIFFERENT or len(without_name) < 4:
        raise PasswordError(
            "the password is one of those that are guessed first; expected another, such as four "
            "words that have nothing to do with each other"
        )


def hash_password(password: str) -> str:
    """The Argon2id hash, with its salt and its parameters, as it is stored."""
    return _hasher().hash(_normal(password))


def is_password(argon2: str, password: str) -> bool:
    """Whether a password belongs to a hash; takes about as long for every text."""
    from argon2.exceptions import InvalidHashError, VerificationError

    try:
        return _hasher().verify(argon2, _normal(password[: LONGEST + 1]))
    except (VerificationError, InvalidHashError):  # another password, or no hash at all
        return False


@cache
def hash_of_nobody() -> str:
    """What the password of an unknown name is held against, so that the answer takes as long."""
    return hash_password("a person who is not there")


@cache
def _hasher() -> PasswordHasher:
    """With the parameters of the package, which are those of RFC 9106 for a server with little
    memory: 64 MiB and three passes."""
    from argon2 import PasswordHasher

    return PasswordHasher()


def _normal(password: str) -> str:
    """One form for letters that keyboards write in several (NIST SP 800-63B, 3.1.1.2)."""
    return unicodedata.normalize("NFKC", password)


def _is_text(value: Any, info: ValidationInfo) -> Any:
    if not isinstance(value, str):
        raise PasswordError(f"{info.field_name} is no text; expected a text")
    return value


#: The type of a password: kept as it was typed, with the blanks around it.
Password = Annotated[str, StringConstraints(strip_whitespace=False), BeforeValidator(_is_text)]


def password_field(words: str) -> Any:
    """A field of a request that is neither shown nor kept."""
    return request_field(help=words, presentation=Presentation(secret=True))
