"""With 100,000 impacts in the store no page takes longer than a second, the last of a listing no
longer than the first.

Held against the limit is the processor's time: the clock measures what else the machine does, too.
Both are told.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pyroshock.app.server.page_cache import PageCache
from support.processes.web_client import window
from support.stores.many_impacts import IMPACTS, fill_many

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
#: What the issue allows.
LIMIT_S = 1.0
RECORDED = IMPACTS + 1
PAGES = (
    "/", "/deleted", "/campaigns/campaign-0001/extract", "/campaigns/campaign-0001/export",
    "/campaigns/campaign-0001/archive",
    "/campaigns", "/campaigns?kind=hammer&name=005", "/campaigns?after=campaign-0040",
    "/campaigns/campaign-0001", "/campaigns/campaign-0050", "/campaigns/shots",
    "/impacts", "/impacts?after=50000", "/impacts?after=99900", "/impacts?campaign=campaign-0050",
    "/impacts?where=tip_material=steel", "/impacts?where=tip_material=steel&after=99000",
    "/impacts?where=tip_material=polyurethane", "/impacts?where=peak_force_n%3E2999",
    "/impacts?where=tip_radius_mm=30&where=hammer_speed=low&where=anvil_material=steel",
    "/impacts?sort=-peak_force_n", "/impacts?sort=quality",
    "/impacts?sort=tip_radius_m&offset=50000",
    "/impacts?sort=-campaign&where=tip_material=steel",
    "/impacts?where=peak_force_n%3E1e9", "/impacts?where=tip_material=glass",
    "/shots", "/shots?after=19000", "/shots?campaign=shots&where=tank_pressure_pa%3E119000",
    "/impacts/1", "/impacts/99999", f"/impacts/{RECORDED}",
    f"/impacts/{RECORDED}?preview=true&threshold=0.02",
    "/compare", "/compare?campaign=campaign-0030&factor=tip_radius",
    "/compare?where=tip_material=polyurethane",
    "/compare?where=peak_force_n%3E2990&normalised=true", "/compare/spectra",
    f"/compare/spectra?impacts={RECORDED}",
    "/models", "/twin?contact=hertz", "/plans", "/plans/new", "/plans/plan%2007",
    "/plans/a%20hundred%20runs",
    "/plans/a%20hundred%20runs/sheet", "/plans/a%20hundred%20runs/sheet.html", "/diagnoses",
    "/diagnoses?campaign=shots", "/diagnoses?after=60", "/diagnoses/7", "/ingest", "/jobs",
    "/reports/campaign/campaign-0007.html", "/reports/diagnosis/7.html",
    "/api/campaigns", "/api/campaigns/campaign-0003", "/api/impacts?limit=2000",
    "/api/impacts?limit=2000&after=90000",
    "/api/shots?limit=2000", f"/api/impacts/{RECORDED}", "/api/plans", "/api/diagnoses",
    "/api/channels/1",
)  # fmt: skip

#: 95 of a hundred requests of a list are answered within this time.
LISTED_S = 0.5
#: Lists; `{}` is another number in each request.
LISTINGS = (
    "/campaigns?after=campaign-00{:02.0f}", "/campaigns?name={:02.0f}",
    "/impacts?after={}", "/impacts?campaign=campaign-00{:02.0f}",
    "/impacts?where=tip_material=steel&after={}", "/impacts?where=peak_force_n%3E{}",
    "/impacts?where=tip_radius_mm=30&where=hammer_speed=low&after={}",
    "/impacts?sort=-peak_force_n&offset={}", "/impacts?sort=tip_radius_m&offset={}",
    "/impacts?sort=quality&offset={}", "/shots?after={}",
    "/shots?where=tank_pressure_pa%3E119000&after={}", "/plans?after={}", "/diagnoses?after={}",
    "/jobs?after={}", "/models?dataset={}", "/notes?after={}", "/search?words=campaign-00{:02.0f}",
    "/search?words=steel {}", "/audit?person={}",
)  # fmt: skip

#: Charts of every row of the store.
EXPLORED_S = 2.0
EXPLORED = (
    "/explore", "/explore?x=impact_velocity_m_s&y=peak_force_n&colour=tip_material",
    "/explore?kind=control&y=peak_force_n&colour=quality", "/explore?kind=levels&x=tip_radius_m",
    "/explore?kind=distribution&x=peak_force_n&colour=contact_time_s", "/explore?subject=shots",
    "/explore/selection?select_x=0.0005:0.0007&select_y=0:2000",
    "/api/explore?colour=findings&where=peak_force_n%3E1500&select_y=0:1e6",
)  # fmt: skip


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory, quick_plates: None) -> Iterator[Any]:
    """A window that keeps no answer: a page that is kept costs a millisecond whatever it shows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PageCache, "_keep", lambda *_: None)
        yield from _client(tmp_path_factory)


def _client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with window(fill_many(tmp_path_factory.mktemp("many"))) as (client, _):
        yield client


def seconds(client: Any, address: str, times: int = 3) -> tuple[float, float]:
    """Medians of the processor's time and of the clock's, warm."""
    taken = []
    for _ in range(times + 1):
        begun = time.process_time(), time.perf_counter()
        answer = client.get(address)
        taken.append((time.process_time() - begun[0], time.perf_counter() - begun[1]))
        assert answer.status_code == 200, (address, answer.text[:500])
    processor, clock = (statistics.median(each) for each in zip(*taken[1:], strict=True))
    return processor, clock


def test_no_page_takes_a_second(client: Any) -> None:
    rows = sorted(
        {address: seconds(client, address) for address in PAGES}.items(), key=lambda row: -row[1][0]
    )
    table = "\n".join(
        f"{cpu * 1e3:6.0f} ms {clock * 1e3:6.0f} ms  {address}" for address, (cpu, clock) in rows
    )
    print(table)
    assert rows[0][1][0] < LIMIT_S, table


def test_lists_are_answered_within_half_a_second(client: Any) -> None:
    rng = np.random.default_rng(1)
    lines, worst = [], 0.0
    for listing in LISTINGS:
        highest = 50 if ":02" in listing else 3000 if "%3E{" in listing else 19_000
        taken = []
        for number in rng.choice(np.arange(1, highest), 21, replace=False):
            begun = time.process_time(), time.perf_counter()
            answer = client.get(listing.format(int(number)))
            taken.append((time.process_time() - begun[0], time.perf_counter() - begun[1]))
            assert answer.status_code in (200, 404), (listing, answer.text[:500])
        processor, clock = np.percentile(taken[1:], 95, axis=0)  # the first request is not warm
        lines.append(f"{processor * 1e3:6.0f} ms {clock * 1e3:6.0f} ms  {listing}")
        worst = max(worst, float(processor))
    table = "\n".join(sorted(lines, reverse=True))
    print(table)
    assert worst < LISTED_S, table


def test_every_impact_is_explored_within_two_seconds(client: Any) -> None:
    processor_s = {}
    for address in EXPLORED:
        taken = []
        for limit in (100, 101, 102):
            begun = time.process_time()
            answer = client.get(f"{address}{'&' if '?' in address else '?'}limit={limit}")
            taken.append(time.process_time() - begun)
            assert answer.status_code == 200, (address, answer.text[:500])
        processor_s[address] = statistics.median(taken)
    print("\n".join(f"{cpu * 1e3:6.0f} ms  {address}" for address, cpu in processor_s.items()))
    assert max(processor_s.values()) < EXPLORED_S, processor_s


@pytest.mark.parametrize(
    ("listing", "last"),
    [("/impacts", 99_800), ("/shots", 19_800), ("/impacts?where=tip_material=steel", 99_000)],
)
def test_the_last_page_costs_as_much_as_the_first(client: Any, listing: str, last: int) -> None:
    first, _ = seconds(client, listing, 7)
    after = f"{listing}{'&' if '?' in listing else '?'}after={last}"
    deep, _ = seconds(client, after, 7)
    assert deep < 2 * first + 0.02, (first, deep)


def test_pages_go_through_all_impacts_once(client: Any) -> None:
    seen, after = 0, 0
    while rows := client.get(
        f"/api/impacts?limit=2000&after={after}" if after else "/api/impacts?limit=2000"
    ).json():
        assert rows[0]["id"] > after
        seen, after = seen + len(rows), rows[-1]["id"]
    assert seen == IMPACTS + 2
