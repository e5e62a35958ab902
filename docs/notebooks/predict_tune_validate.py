# %% [markdown]
# # Predict, tune and validate
#
# After this notebook you can predict a shot with 90 % bands, search the settings that give a
# prescribed shock response spectrum, and measure how far the predictions can be trusted on shots
# that the twin has not seen.

# %%
import itertools
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import pyroshock as ps

store = ps.open("lab.db")

# %% [markdown]
# ## Shots to learn from
#
# Twelve shots of a compressed-air gun on one plate, two tips, three bullets and two levels of
# velocity, recorded on the virtual bench, whose laws are not those of the twin. With a campaign of
# your own, these two cells are `store.ingest("FOLDER")`.

# %%
settings = itertools.product(["PLA", "steel"], [0.2, 0.5, 1.0], ["low", "medium"])
runs = pd.DataFrame(settings, columns=["tip_material", "bullet_mass_kg", "velocity_level"])
runs = runs.assign(
    plate_material="aluminum", anvil_material="steel", insulator="none", tip_radius_mm=45
)
runs["run"] = range(1, len(runs) + 1)
plan = store.plan.from_table("spring", table=runs, repetitions=1)

# %%
store.ingest(plan.simulate("spring", seed=1))

# %% [markdown]
# ## The twin
#
# A twin computes a shot from the tank pressure to the spectrum: gun, contact, plate, sensors. It is
# taught by the measured shots of its campaign. It says what it assumes, and what its bands rest on.

# %%
twin = store.twin(campaign="spring", frequencies="100:10000:3")
twin

# %% [markdown]
# ## Predict a shot
#
# An argument is a number in SI, or a text with a unit. Pressures are gauge pressures. Each number
# comes with a band that should hold 90 % of the shots that are fired with these settings.

# %%
shot = twin.predict(tank_pressure="1.2 bar", bullet_mass="0.5 kg", tip="steel", anvil="steel")
shot.to_frame()

# %%
_ = shot.plot()

# %% [markdown] Many shots are a DataFrame with a setting in each row; here the pressure is varied.
# The twin learned from low and medium velocities: `extrapolation` says where it is asked for more
# than that.

# %%
pressures = pd.DataFrame({"tank_pressure": [f"{tenth / 10} bar" for tenth in range(4, 22, 2)]})
table = twin.predict_many(pressures.assign(bullet_mass="0.5 kg", tip="steel", anvil="steel"))
table[["tank_pressure", "predicted_velocity_m_s", "predicted_peak_force_n", "extrapolation"]]

# %%
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
bar = table["tank_pressure"].str.removesuffix(" bar").astype(float)
force_kn = 1e-3 * table.filter(like="predicted_peak_force_n")
axes.plot(bar, force_kn["predicted_peak_force_n"])
axes.fill_between(
    bar, force_kn["predicted_peak_force_n_low"], force_kn["predicted_peak_force_n_high"], alpha=0.2
)
_ = axes.set(xlabel="tank pressure (bar)", ylabel="peak force (kN)", ylim=(0, None))

# %% [markdown]
# ## Tune: settings for a prescribed spectrum
#
# A customer prescribes a spectrum. Here it is one that this bench can give, that of the shot above;
# a file would be `twin.tune("spec.csv")`. Every line must lie within 6 dB. The settings come with
# the probability that the next shot does so.

# %%
prescribed = pd.Series(shot.srs.mean, index=shot.srs.x)
tuned = twin.tune(prescribed, tolerance="6 dB", bullet_mass=["0.2 kg", "0.5 kg", "1 kg"])
print(tuned.sentence)

# %%
columns = [
    "tank_pressure_pa",
    "bullet_mass_kg",
    "tip_material",
    "tip_radius_m",
    "anvil_material",
    "insulator",
]
tuned.to_frame()[["rank", "probability_within", *columns]].head()

# %%
_ = tuned.plot()

# %% [markdown] Not every spectrum can be had on every bench. For the example specification of a
# component no setting is found, and the search says what stands in the way.

# %%
specification = Path(ps.__file__).parent / "examples" / "specifications" / "component.csv"
print(twin.tune(specification, tolerance="6 dB", bullet_mass=["0.2 kg", "0.5 kg", "1 kg"]).sentence)

# %% [markdown]
# ## Validate
#
# Each measured shot is predicted by a twin that has not seen its settings, and compared with its
# band. The picture shows the share of shots inside the 90 % bands; the grey bar is how well so few
# shots determine that share.

# %%
validation = store.validate("spring")
print(validation.sentence)

# %%
_ = validation.plot()

# %%
velocities = validation.shots.query("quantity == 'velocity'").sort_values("predicted")
low, high = (
    velocities["predicted"] - velocities["low90"],
    velocities["high90"] - velocities["predicted"],
)
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
axes.errorbar(velocities["measured"], velocities["predicted"], yerr=[low, high], fmt="o", capsize=3)
axes.axline((10, 10), slope=1, color="0.7", zorder=0)
_ = axes.set(xlabel="measured velocity (m/s)", ylabel="predicted without this shot (m/s)")

# %%
store.close()
