"""Texts that a cell, a key or a value should not hold."""

from __future__ import annotations

NASTY = (
    *("", " ", "nan", "NaN", "inf", "-inf", "infinity", "1e400", "-1e400", "1e-400", "5e-324", "1e308", "-1e308"),
    *(
        "-1",
        "0",
        "-0",
        "0.0",
        "1",
        "2",
        "1.5",
        "1,5",
        "1.5.2",
        "1_0",
        "0x1p3",
        "0x10",
        "1 000",
        "+1",
        ".5",
        "5.",
        "1e5",
    ),
    *("١٢٣", "１２", "²", "½", "−1", "\u2028", "\ufeff1", "\x85", "\u202e", "e\u0301", "\U0001f528", "\ufffd"),
    *("9" * 400, "9" * 5000, "x" * 499, "x" * 501, "x" * 5000, "x" * 140_000),
    *('"', '""', '"a', 'a"b', "'", "\\", "\\u0000", "\x00", "\x01", "\x1f", "\x7f", "\r", "\t", "\n", ";", ",", "|"),
    *("true", "None", "null", "=1+1", "%s%n", "{0}", "$HOME", "<b>", "--", "#", "#1", "//", "[N]", "(s)", "force [N]"),
    *("2147483647", "2147483648", "9223372036854775808", "-9223372036854775809"),
    *("..", "../x.npz", "/dev/zero", "/dev/stdin", "C:\\x", "a" * 256 + ".npz", "recordings", ".", "x\x00.npz"),
    *("N", "kN", "g", "m/s2", "m/s**2", "N*", "N**", "N**9", "N**999999999", "9**9**9**9", "m**-1e9", "degC", "V/N"),
    *("10**100000000", "N" * 2000, "(" * 500, "1e99999 N", "N/0", "0 N", "nan N", "-N", "kg*m/s^2", "dB", "%", "1"),
    *("steel", "none", "aluminum", "PLA", "free", "low", "polymeric", "hammer", "gun", "force", "fs", "time", "t"),
)
#: Whole files' encodings, as spreadsheets and editors save them.
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1", "cp1252", "utf-7")
