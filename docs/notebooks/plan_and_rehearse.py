# %% [markdown]
# # Plan a campaign and rehearse it
#
# After this notebook you can plan the 105 runs of a campaign, judge the design, print its run
# sheet, and rehearse a campaign on the virtual bench: fire it, ingest it, and compare what was
# planned with what was achieved. A rehearsal finds mistakes of names, units and ranges before the
# first real shot.

# %%
import matplotlib.pyplot as plt
import pyroshock as ps

store = ps.open("lab.db")

# %% [markdown]
# ## The 105 runs
#
# A Latin hypercube over the factors of the gun: plate, anvil, insulator, tip, mass of the bullet
# and level of velocity. The levels, and pairs and triples of levels, appear as equally often as 105
# runs allow. The same seed gives the same plan.

# %%
campaign = store.plan.lhs("main-campaign", runs=105, seed=1)
campaign.to_frame().head()

# %%
_ = campaign.plot()

# %% [markdown] The picture shows the level of each factor from run to run, the lowest dark and the
# highest bright. The order saves work at the bench: the plate is changed once, the anvil and the
# insulator change rarely, and everything else is at random within these blocks.

# %% [markdown]
# ## How good the design is
#
# A share is the number of runs that a level, or a pair of levels, would have in perfect balance.
# `worst_pair` is the largest difference of any pair from its share, in runs, and
# `largest_correlation` is the largest one between two factors.

# %%
quality = campaign.quality()
quality.to_frame()

# %% [markdown] The picture has a cell for every pair of levels. No pair is a whole run above or
# below its share; levels of one factor exclude each other and are grey.

# %%
_ = quality.plot()

# %% [markdown]
# ## The run sheet
#
# The suffix of the file decides: `.csv`, `.xlsx`, or `.html` to print. The person at the bench
# fills in the empty columns.

# %%
path = campaign.sheet("main-campaign.xlsx")
print(path, f"{path.stat().st_size / 1000:.0f} kB")
print("\n".join(campaign.sheet().splitlines()[:4]))

# %% [markdown]
# ## A rehearsal on the virtual bench
#
# Eight runs are enough to see whether everything fits together. `simulate` writes a folder with
# recordings, `runs.csv` and `campaign.toml`, as a real bench would leave it. Options are those of
# `pyroshock simulate`; here the projectile leaks twice as much air as usual. What was really set
# and what happened is beside the folder in `rehearsal.sealed.json`.

# %%
rehearsal = store.plan.lhs("rehearsal", runs=8, repetitions=1, seed=2)
folder = rehearsal.simulate("rehearsal", seed=2, effects={"gun.blow_by": 2.0})
sorted(file.name for file in folder.iterdir())

# %%
report = store.ingest(folder)
report

# %% [markdown] The findings say which recordings cannot be used, and why. Here one bullet stays in
# the barrel ("no passage" of the laser), and the accelerometers' range of 10,000 g is too small for
# hard contacts. A rehearsal tells that before the first real shot.

# %%
findings = report.to_frame()
for _, finding in findings[findings["severity"] != "note"].iterrows():
    print(
        f"{finding['severity']}: {finding['recording']}, {finding['channel']}: {finding['message']}"
    )

# %% [markdown]
# ## Planned and achieved
#
# An ingest links each recording to its planned run. A recording whose settings do not belong to its
# run would be listed as a mismatch and would not count as done.

# %%
store.plan.list()[["name", "method", "runs", "planned", "done"]]

# %%
planned = store.plan.open("rehearsal").to_frame()
planned[
    [
        "run",
        "status",
        "recorded",
        "plate_material",
        "tip_material",
        "bullet_mass_kg",
        "velocity_level",
    ]
]

# %% [markdown] The plan has levels of velocity, which the nominal gun turns into pressures. The
# virtual gun has a valve, a leak and friction, which the nominal gun lacks, and its shots are
# slower. A diagnosis says which effect is missing; another notebook shows it. Run 7 has no
# velocity, since its bullet did not leave the barrel.

# %%
shots = store.shots(campaign="rehearsal").merge(planned[["run", "velocity_level"]], on="run")
shots = shots.sort_values("predicted_velocity_m_s", ignore_index=True)
columns = ["run", "velocity_level", "tank_pressure_pa", "bullet_mass_kg", "predicted_velocity_m_s"]
shots[[*columns, "measured_velocity_m_s"]]

# %%
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
axes.plot(
    shots.index,
    shots["predicted_velocity_m_s"],
    "_",
    ms=20,
    mew=2,
    label="planned, by the nominal gun",
)
axes.plot(shots.index, shots["measured_velocity_m_s"], "o", label="measured on the virtual bench")
axes.set_xticks(
    shots.index, [f"run {shot.run}\n{shot.velocity_level}" for shot in shots.itertuples()]
)
axes.set(ylabel="velocity (m/s)", ylim=(0, None))
_ = axes.legend(frameon=False)

# %%
store.close()
