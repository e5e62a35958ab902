"""In a browser, on a slow line: how long until the first chart is there, and what has been sent."""

from __future__ import annotations

import time
from typing import Any

import pytest
from support.processes.browsers import SLOW, page_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

#: A slow telephone: 1.6 Mbit/s down, 0.75 Mbit/s up, 300 ms to the server and back.
LINE = {
    "offline": False,
    "latency": 300,
    "downloadThroughput": 1.6e6 / 8,
    "uploadThroughput": 0.75e6 / 8,
}
FIRST_CHART_S, PAGE_BYTES = 4.0, 500_000


@pytest.mark.parametrize("name", ["home", "impact"])
def test_the_first_chart_of_a_page_is_there_in_seconds(
    browser: Any, lab: Any, address: Any, name: str
) -> None:
    with page_of(browser, lab) as page:
        page.goto(address(name))  # the server has read the store once
    with page_of(browser, lab) as page:
        session = page.context.new_cdp_session(page)
        session.send("Network.enable")
        session.send("Network.emulateNetworkConditions", LINE)
        sizes: list[float] = []
        session.on("Network.loadingFinished", lambda end: sizes.append(end["encodedDataLength"]))
        begun = time.monotonic()
        page.goto(address(name), wait_until="commit")
        page.wait_for_selector("[data-drawn=yes]")
        taken = time.monotonic() - begun
        page.wait_for_load_state("networkidle")
    print(f"{name}: first chart after {taken:.2f} s, {sum(sizes) / 1e3:.0f} kB in all")
    assert taken < FIRST_CHART_S * SLOW
    assert 0 < sum(sizes) < PAGE_BYTES
