"""How much sampling hides of a spectrum at most, from differences of the record: in one pass,
without a transform.

A band-limited record with second differences d2, taken as straight lines between its samples, loses
D(w) of content at w, and a peak lies at most half a sample beside a sample, where the response has
fallen by at most a2 / 8 for a2 the second derivative of the response in samples. Both follow from
d2: as time series, what one d2 contributes is at most

    line * (0.09 e(k) + rest)       e(k) = exp(-zeta line k) / sqrt(1 - zeta^2),

k samples later, line in rad a sample, for straight lines, 1.08 in place of 0.09 for a2, and the
parts that do not decay so add up to no more than the rests below. Where the record is slower than
the line, the response follows it, and d2 itself with the same sums over fourth differences d4 and 1
/ line in place of line is the smaller bound. Where it is faster, a2 follows from the equation of
the oscillator, a2 = line^2 (a - x) + 2 zeta line (a' - x'), and from Landau's inequality |x'|^2 <=
2 |x| |x''|.

The numbers hold for lines up to `MOST_LINE` and damping up to `MOST_DAMPING`;
`tests/signals/srs/test_difference_bound.py` transforms the functions of frequency and compares.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ...array_types import Floats
from .kernel import WIDTH, larger, load, magnitude, spread, store, total
from .resampling import continuation_taper

#: In rad a sample: a little more than ten samples a cycle.
MOST_LINE, MOST_DAMPING = 0.64, 0.1
#: Coefficients of the decaying parts, of straight lines and of a2, and the sums of the rests, of d2
#: and of d4.
STRAIGHT, BESIDE = 0.09, 1.08
STRAIGHT_REST, BESIDE_REST = 0.1, 1.2
STRAIGHT_REST_OF_D4, BESIDE_REST_OF_D4 = 0.006, 0.2
#: Images of a record about multiples of its sampling rate, over `line`, and of the record's second
#: derivative over d2.
IMAGES, DERIVATIVE = 0.05, 2.47
#: What straight lines lose over a2.
STRAIGHT_OF_A2 = 0.1
#: The record between its samples, over the largest d2.
_BETWEEN_SAMPLES = 0.5
#: The largest response between samples over that at samples; where the bound says more it says
#: nothing.
_MOST_GROWTH = 1.1
#: Sums decay from block to block of samples, at rates that cover so many octaves below the highest
#: line.
_OCTAVES = 4.0


def hidden_by_differences(
    records: Floats, sampling_rate_hz: float, lines_hz: Floats, zeta: float, maximax: Floats
) -> Floats:
    """What straight lines and peaks between samples hide at most of spectra `maximax` (k, f) of
    `records` (k, n), m/s2.

    Infinite where it says nothing: at lines above a tenth of the sampling rate, at higher damping,
    of short records.
    """
    line = 2 * np.pi / sampling_rate_hz * lines_hz
    hidden = np.full(maximax.shape, np.inf)
    highest = line.max(initial=0.0, where=line <= MOST_LINE)
    if zeta <= MOST_DAMPING and records.shape[-1] >= WIDTH and highest > 0:
        octaves = _OCTAVES * np.arange(WIDTH - 2, -1, -1) / (WIDTH - 2)
        rates = np.append(0.0, zeta * highest * 2.0**-octaves)
        taper = continuation_taper(records.shape[-1])
        work = np.empty(taper.size + 8), np.exp(-WIDTH * rates)[None], np.empty((7, WIDTH))
        _bound(records, taper, line, zeta, highest, rates, *work, maximax, hidden)
    return hidden


@njit("(f8[::1], f8[:, ::1], f8[:, ::1])", nogil=True, cache=True)
def _add_differences(series, decay, totals):  # type: ignore[no-untyped-def]
    """Takes in the differences about samples 2 to n - 3 of a series.

    Rows of `totals`: sums of d2 that decay, and the largest of each; of d4 likewise; the largest
    sample, d2 and d4.
    """
    two, four, six, decays = spread(2.0), spread(4.0), spread(6.0), load(decay, 0)
    sum_d2, most_sum_d2, sum_d4, most_sum_d4 = (
        load(totals, 0),
        load(totals, 1),
        load(totals, 2),
        load(totals, 3),
    )
    most, most_d2, most_d4 = load(totals, 4), load(totals, 5), load(totals, 6)
    count = series.size - 4
    for block in range(count // WIDTH):
        window = series[block * WIDTH :]
        middle, beside = load(window[2:], 0), load(window[1:], 0) + load(window[3:], 0)
        d2 = magnitude(beside - two * middle)
        d4 = magnitude(load(window, 0) + load(window[4:], 0) - (four * beside - six * middle))
        most, most_d2, most_d4 = (
            larger(magnitude(middle), most),
            larger(d2, most_d2),
            larger(d4, most_d4),
        )
        added = spread(total(d2))
        most_sum_d2, sum_d2 = larger(added + sum_d2, most_sum_d2), added + decays * sum_d2
        added = spread(total(d4))
        most_sum_d4, sum_d4 = larger(added + sum_d4, most_sum_d4), added + decays * sum_d4
    # A block that is not full decays by nothing.
    for i in range(2 + count - count % WIDTH, 2 + count):
        beside = series[i - 1] + series[i + 1]
        d2 = spread(abs(beside - 2 * series[i]))
        d4 = spread(abs(series[i - 2] + series[i + 2] - 4 * beside + 6 * series[i]))
        most, most_d2, most_d4 = (
            larger(spread(abs(series[i])), most),
            larger(d2, most_d2),
            larger(d4, most_d4),
        )
        sum_d2, sum_d4 = sum_d2 + d2, sum_d4 + d4
    most_sum_d2, most_sum_d4 = larger(sum_d2, most_sum_d2), larger(sum_d4, most_sum_d4)
    for row, value in enumerate((sum_d2, most_sum_d2, sum_d4, most_sum_d4, most, most_d2, most_d4)):
        store(totals, row, value)


@njit(nogil=True, cache=True)
def _bound(  # type: ignore[no-untyped-def]
    records, taper, line, zeta, highest, rates, end, decay, totals, maximax, hidden
):
    # Loops in place of slices and of max(), whose messages take two seconds to compile.
    n, continued = records.shape[1], taper.size
    growth = 1 / math.sqrt(1 - zeta**2)
    for row in range(len(records)):
        record = records[row]
        totals[:] = 0.0
        for k in range(4):
            end[k], end[4 + continued + k] = 0.0, record[k]
        for step in range(1, continued + 1):
            end[4 + continued - step] = (2 * record[0] - record[min(step, n - 1)]) * taper[step - 1]
        _add_differences(end, decay, totals)
        _add_differences(record, decay, totals)
        for k in range(4):
            end[k], end[4 + continued + k] = record[n - 4 + k], 0.0
        for step in range(1, continued + 1):
            end[3 + step] = (2 * record[n - 1] - record[max(n - 1 - step, 0)]) * taper[step - 1]
        _add_differences(end, decay, totals)
        most = most_d2 = most_d4 = 0.0
        for j in range(WIDTH):
            most, most_d2 = max(most, totals[4, j]), max(most_d2, totals[5, j])
            most_d4 = max(most_d4, totals[6, j])
        between = most + _BETWEEN_SAMPLES * most_d2
        slope = math.sqrt(2 * between * DERIVATIVE * most_d2)
        for i in range(line.size):
            theta, response = line[i], _MOST_GROWTH * maximax[row, i]
            if theta > highest:
                continue
            j = 0
            while j < WIDTH - 1 and rates[j + 1] <= zeta * theta * (1 + 1e-12):
                j += 1
            parts = (STRAIGHT + BESIDE / 8) * growth
            fast = theta * (parts * totals[1, j] + (STRAIGHT_REST + BESIDE_REST / 8) * most_d2)
            slow = (1 / 12 + 1 / 8 + IMAGES * theta) * most_d2 + (
                parts * totals[3, j] + (STRAIGHT_REST_OF_D4 + BESIDE_REST_OF_D4 / 8) * most_d4
            ) / theta
            free_square = theta**2 * (between + response) + 2 * zeta * theta * slope
            of_slope = 2 * zeta * theta * math.sqrt(2 * response)
            a2 = ((of_slope + math.sqrt(of_slope**2 + 4 * free_square)) / 2) ** 2
            stiff = (STRAIGHT_OF_A2 + 1 / 8) * a2 + IMAGES * theta * most_d2
            if stiff > (_MOST_GROWTH - 1) * maximax[row, i]:
                stiff = math.inf
            hidden[row, i] = min(fast, slow, stiff)
