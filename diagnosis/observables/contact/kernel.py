"""The compiled search for the instants at which pulses cross a level."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def crossings(force, top, level, steps):  # type: ignore[no-untyped-def]
    """Into `steps` (2, n): where pulses (n, m) cross `level` of their peak at `top` (n,), before and behind it."""
    for i in range(len(force)):
        row, threshold, last = force[i], level * force[i, top[i]], force.shape[1] - 1
        before, after = top[i] - 1, top[i] + 1
        while before >= 0 and not row[before] < threshold:
            before -= 1
        while after <= last and not row[after] < threshold:
            after += 1
        steps[0, i] = 0.0 if before < 0 else _crossing(row, before, threshold)
        steps[1, i] = last if after > last else _crossing(row, after - 1, threshold)


@njit(cache=True, nogil=True, error_model="numpy")
def _crossing(row, left, threshold):  # type: ignore[no-untyped-def]
    """Straight between two points; the first of them where both are alike."""
    here, there = row[left], row[left + 1]
    return left + (threshold - here) / (there - here) if there != here else float(left)
