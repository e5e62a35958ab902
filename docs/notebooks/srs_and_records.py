# %% [markdown]
# # Spectra and records
#
# A store is made, one recorded hit of a modal hammer is ingested, looked at in SQL, and its shock response spectrum is
# drawn. Every number is SI.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import pyroshock
from pyroshock.app.cli.main import main

EXAMPLE = Path(pyroshock.__file__).parent / "examples" / "modal-hammer-hit"


def run(*words: object) -> None:
    """A command of pyroshock."""
    main(list(map(str, words)), standalone_mode=False)


# %% [markdown]
# ## A store with one hit

# %%
run("ingest", EXAMPLE, "--db", "sqlite:///lab.db")
run("impacts", "--db", "sqlite:///lab.db", "--columns", "campaign,peak_force_n,contact_time_s,impulse_n_s")

# %% [markdown]
# ## The same in SQL

# %%
run(
    "query",
    "select impact_id, peak_force_n, force_points_n from pulses",
    "--out",
    "pulses.json",
    "--db",
    "sqlite:///lab.db",
)
pulses = pd.read_json("pulses.json")
pulses[["impact_id", "peak_force_n"]]

# %% [markdown]
# ## The record
#
# The series leaves the store as a table, a row for each sample.

# %%
run("export", "series", "--out", "series.parquet", "--db", "sqlite:///lab.db")
series = pd.read_parquet("series.parquet")
series.groupby("channel").size()

# %%
figure, axes = plt.subplots(series["channel"].nunique(), sharex=True, squeeze=False)
for axis, (channel, samples) in zip(axes[:, 0], series.groupby("channel"), strict=True):
    axis.plot(1e3 * samples["time_s"], samples["value"])
    axis.set_ylabel(f"{channel} in {samples['unit'].iloc[0]}", fontsize=7)
_ = axes[-1, 0].set_xlabel("time in ms")

# %% [markdown]
# ## Its shock response spectrum

# %%
run("srs", EXAMPLE / "recordings" / "acceleration.lvm", "--frequencies", "100:5000:6", "--json", "srs.json")
spectrum = pd.read_json("srs.json", typ="series")

# %%
figure, axis = plt.subplots()
for kind in ("maximax", "positive", "negative"):
    axis.loglog(spectrum["frequency_hz"], spectrum[kind], label=kind)
axis.set_xlabel("natural frequency in Hz")
axis.set_ylabel("absolute acceleration in m/s²")
_ = axis.legend()
