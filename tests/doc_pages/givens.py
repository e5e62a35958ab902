"""What a page takes for granted, by the names that its marks use: `folder hammer spring`,
`recording shot.csv`.

Each takes the place and the words after its name. A new one is a function here; its name is that of
the mark.
"""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable

import numpy as np
from support.records.campaigns import replace_in, write_runs
from support.records.plate_folders import small_plate, write_modes
from support.stores.hammer_stores import full_campaign
from support.stores.registries import fresh_registry
from support.stores.stores import opened

from .parsing import ROOT
from .running import Place

Given = Callable[..., None]


def prepare(words: str, place: Place) -> None:
    """Raises `KeyError` for a mark that nothing here makes."""
    name, *arguments = shlex.split(words)
    GIVENS[name](place, *arguments)


def folder(place: Place, kind: str, name: str) -> None:
    """A campaign's folder: `hammer` (4 configurations, 5 hits each), `gun` (the five measured
    shots), `ideal-gun`: the same without their factor of one half, so that there is something to
    explain.
    """
    FOLDERS[kind](place, name)


def ingested(place: Place, kind: str, name: str, store: str = "pyroshock.db") -> None:
    """A campaign's folder, unless it is there already, and its rows in the store."""
    if not (place.folder / name).exists():
        folder(place, kind, name)
    place.pyroshock("ingest", name, "--db", _address(place, store))


def virtual(place: Place, name: str, runs: str) -> None:
    """A gun campaign of so many shots, planned, played on the virtual bench and ingested."""
    place.pyroshock("plan", "lhs", name, "--runs", runs, "--repetitions", "1", "--seed", "1")
    place.pyroshock("simulate", name, "--out", name, "--jobs", "1")
    place.pyroshock("ingest", name, "--jobs", "1")


def fired(place: Place, cli: str, runs: str) -> None:
    """A folder of the first runs of a plan, each once, with velocities that somebody wrote down."""
    from pyroshock.doe.plans import read_plan

    with opened(_address(place, "pyroshock.db")) as store, store.reading() as session:
        planned = read_plan(session, cli).runs[: int(runs)]
    folder(place, "gun", cli)
    once = {"repetition": 1, "measured_velocity_m_s": 20.0}
    write_runs(
        place.folder / cli, [{"run": run.run, **run.row, **run.settings, **once} for run in planned]
    )


def afresh(place: Place) -> None:
    """A new folder, as at the beginning: a page's next part is about another laboratory.

    The old one stays: MLflow keeps its connection to a registry's file by path, and would not see
    that it is another.
    """
    links = [path for path in place.folder.iterdir() if path.is_symlink()]
    place.folder /= "afresh"
    place.folder.mkdir()
    for link in links:
        (place.folder / link.name).symlink_to(link.resolve())
    place.patch.chdir(place.folder)


def registry(place: Place, store: str = "pyroshock") -> None:
    """MLflow's empty tables beside the store, which take it seconds to make."""
    fresh_registry(place.folder, store)


def dataset(place: Place, name: str, campaign: str) -> None:
    place.pyroshock("dataset", "build", name, "--from", campaign)


def trainable(place: Place, name: str, store: str) -> None:
    """A dataset of that name, and the campaign that it is of, in a store that is not the page's
    first one."""
    address = _address(place, store)
    full_campaign(place.folder / "elsewhere" / name, name)
    place.pyroshock("ingest", f"elsewhere/{name}", "--db", address)
    place.pyroshock("dataset", "build", name, "--from", name, "--db", address)


def in_use(place: Place, campaign: str) -> None:
    """A quick model of a campaign's pulses, promoted."""
    place.pyroshock("dataset", "build", campaign, "--from", campaign)
    place.pyroshock("train", campaign, "--models", "linear", "--split", "configurations")
    place.pyroshock("promote", "linear", "1", "--force", "--reason", "to begin with")


def plan_table(place: Place, name: str) -> None:
    """Somebody else's plan, as CSV."""
    other = ("plan", "lhs", "other", "--runs", "12", "--seed", "2", "--db", "sqlite:///other.db")
    place.pyroshock(*other, "--out", name)


def window(place: Place, address: str) -> None:
    """The pages and the API, really served, under the address that the page writes."""
    from support.processes.browsers import served

    lab = served(_address(place, "pyroshock.db"), place.folder)
    place.names[address] = place.open_until_the_end.enter_context(lab).origin


def laboratory(place: Place, address: str) -> None:
    """The same, with a worker that goes on working: what a page asks for by HTTP is a job."""
    from pyroshock.app.jobs.worker import Worker

    work_once = Worker.run

    def work(self: Worker, *, once: bool = False) -> int:
        had = work_once(self)
        while not once and not self.bench.ending.wait(0.05):
            had += work_once(self)
        return had

    place.patch.setattr(Worker, "run", work)
    window(place, address)


def folders(place: Place, *paths: str) -> None:
    """Empty ones of this machine, which stand for a server's."""
    for path in paths:
        here = place.folder / "server" / path.strip("/")
        here.mkdir(parents=True)
        place.names[path] = str(here)


def recording(place: Place, name: str, channel: str = "acceleration_m_s2") -> None:
    """A half-sine of 1 ms and 300 g that rings on at 900 Hz, a tenth of a second at 50 kHz."""
    rate = 50_000.0
    time = np.arange(round(0.1 * rate)) / rate
    since = np.clip(time - 0.02, 0.0, None)
    pulse = np.where((since > 0) & (since < 1e-3), np.sin(np.pi * since / 1e-3), 0.0)
    ringing = np.sin(2 * np.pi * 900 * since) * np.exp(-since / 5e-3)
    values = 9.80665 * (300 * pulse + 200 * ringing)
    if name.endswith(".csv"):
        rows = "\n".join(f"{t:.6f},{a:.6g}" for t, a in zip(time, values, strict=True))
        (place.folder / name).write_text(f"time_s,{channel}\n{rows}\n", encoding="utf-8")
        return
    from scipy.io import savemat

    savemat(place.folder / name, {"fs": rate, channel: values})


def file(place: Place, name: str, source: str) -> None:
    """A file of the repository under another name."""
    shutil.copyfile(ROOT / source, place.folder / name)


def modal_table(place: Place, name: str) -> None:
    """Of a small plate with two sensors."""
    write_modes(place.folder / name, small_plate())


def databases(place: Place, *names: str) -> None:
    """Empty ones on the tests' PostgreSQL server, under the addresses that pages write:
    USER@server/NAME."""
    from support.stores.databases import fresh_database

    server = place.request.getfixturevalue("postgres_url")
    for name in names:
        address = place.open_until_the_end.enter_context(fresh_database(server))
        for user in ("lab", "anna", "pyroshock_lab", "pyroshock_owner"):
            place.names[f"postgresql+psycopg://{user}@server/{name}"] = address


def cluster(place: Place, address: str) -> None:
    """A Dask scheduler with two workers, which stands for the one at this address."""
    from support.processes.dask_clusters import dask_cluster

    home = place.folder / "cluster"
    home.mkdir()
    place.names[address] = place.open_until_the_end.enter_context(dask_cluster(home)).address


def few_models(place: Place, names: str) -> None:
    """What `train` makes where the page does not say which: all 22 take minutes, and registry.md
    has them all."""
    from pyroshock.app.operations.train.train import Training

    field = Training.model_fields["models"]
    place.patch.setattr(field, "default", tuple(names.split(",")))
    place.patch.setattr(Training, "__pydantic_complete__", False)
    Training.model_rebuild(force=True)


def _address(place: Place, store: str) -> str:
    return place.here(store) if "://" in store else f"sqlite:///{store}"


def _five_shots(place: Place, name: str) -> None:
    shutil.copytree(ROOT / "examples" / "first-shots", place.folder / name)
    replace_in(place.folder / name / "campaign.toml", 'name = "first-shots"', f'name = "{name}"')


def _five_shots_of_an_ideal_gun(place: Place, name: str) -> None:
    _five_shots(place, name)
    replace_in(place.folder / name / "campaign.toml", "efficiency = 0.5", "efficiency = 1.0")


FOLDERS: dict[str, Given] = {
    "hammer": lambda place, name: full_campaign(place.folder / name, name),
    "gun": _five_shots,
    "ideal-gun": _five_shots_of_an_ideal_gun,
}
GIVENS: dict[str, Given] = {
    each.__name__.replace("_", "-"): each
    for each in (
        *(
            afresh,
            folder,
            ingested,
            virtual,
            fired,
            registry,
            dataset,
            trainable,
            in_use,
            plan_table,
        ),
        *(
            recording,
            file,
            modal_table,
            databases,
            cluster,
            window,
            laboratory,
            folders,
            few_models,
        ),
    )
}
