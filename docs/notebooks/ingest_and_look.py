# %% [markdown]
# # Ingest a campaign and look at it
#
# After this notebook you can read a campaign into a store, list its shots and impacts by condition,
# draw a pulse, read a part of a recording, compute a shock response spectrum, and see what the
# quality checks say. Every number is in SI units, and pressures are gauge pressures.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import pyroshock as ps

EXAMPLES = Path(ps.__file__).parent / "examples"

# %% [markdown]
# ## Ingest
#
# The store of this notebook is a file. A laboratory with a server writes its address there, such as
# `postgresql+psycopg://USER@HOST/NAME`. Two campaigns ship with the software: five shots of a
# compressed-air gun, whose velocities were written down, and one hit of a modal hammer with its
# recording. The report of an ingest says what was added.

# %%
store = ps.open("lab.db")
store.ingest(EXAMPLES / "first-shots")

# %%
store.ingest(EXAMPLES / "modal-hammer-hit")

# %% [markdown] An ingest that is repeated adds nothing, so that a folder to which recordings are
# still being added can be ingested every evening.

# %%
store.ingest(EXAMPLES / "first-shots").added

# %% [markdown] A third campaign has more impacts: six settings of an instrumented hammer, four hits
# each, recorded on the virtual bench. The virtual bench writes the files that a real bench would
# write.

# %%
plan = store.plan.lhs("six-settings", kind="hammer", runs=6, repetitions=4, seed=1)
report = store.ingest(plan.simulate("six-settings", seed=1))
report

# %%
store.campaigns()

# %% [markdown]
# ## Shots and impacts by condition
#
# A condition is a text. The names of the columns end with their unit, and `.attrs["units"]` lists
# the units.

# %%
shots = store.shots(
    campaign="first-shots", where="measured_velocity_m_s > 12", sort="tank_pressure_pa"
)
shots[["run", "tank_pressure_pa", "measured_velocity_m_s", "predicted_velocity_m_s"]]

# %%
hard = store.impacts(
    campaign="six-settings", where=["tip_material = aluminum", "peak_force_n > 500"]
)
hard[
    [
        "id",
        "run",
        "tip_radius_m",
        "impact_velocity_m_s",
        "contact_time_s",
        "peak_force_n",
        "quality",
    ]
]

# %% [markdown] The result is an ordinary pandas DataFrame, which matplotlib draws. The softer the
# tip, the longer the contact and the smaller the peak.

# %%
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for tip, hits in store.impacts(campaign="six-settings").groupby("tip_material"):
    axes.plot(1e3 * hits["contact_time_s"], hits["peak_force_n"], "o", label=tip)
axes.set(xlabel="contact time (ms)", ylabel="peak force (N)", xlim=(0, None), ylim=(0, None))
_ = axes.legend(title="tip")

# %% [markdown]
# ## A pulse
#
# The pulse is the part of the record in which the hammer touches. The line is a smoothing spline;
# the marks are the 20 points from which contact models learn.

# %%
(impact,) = store.impacts(campaign="modal-hammer-hit")["id"]
pulse = store.pulse(impact)
pulse

# %%
_ = pulse.plot()

# %% [markdown]
# ## A part of a recording
#
# A recording gives its channels by name, and reads nothing yet. `between` reads only the samples
# that it needs: here 2 ms before the peak of the force and 8 ms after it, or as much of that as was
# recorded.

# %%
recording = store.recording(impact)
recording

# %%
force = recording["Force (Trigger)"]
peak_s = force.time_s[force.values.argmax()]
window = force.between(peak_s - 0.002, peak_s + 0.008)
print(
    len(window),
    "of",
    len(force),
    "samples, from",
    f"{window.index[0]:.4f} s to {window.index[-1]:.4f} s",
)

# %%
_ = recording.plot(start_s=peak_s - 0.002, stop_s=peak_s + 0.008)

# %% [markdown]
# ## A shock response spectrum
#
# A channel of acceleration has a spectrum. `ps.srs` computes the same for any array or pandas
# Series.

# %%
spectrum = recording["Acceleration (Trigger)"].srs(q=10, frequencies="100:10000:6")
print(f"largest: {spectrum.max():.0f} m/s2 at {spectrum.idxmax():.0f} Hz")

# %%
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
axes.loglog(spectrum.index, spectrum)
_ = axes.set(
    xlabel="natural frequency (Hz)", ylabel="maximax acceleration (m/s2)", title="SRS, Q = 10"
)

# %% [markdown]
# ## What the quality checks say
#
# The checks look at every recording: saturation, noise, drift, plausible impulses and more. A
# finding is a note, a warning, or a reason to reject; what is rejected trains no model. The page
# "How a number came out of a recording" lists the checks.

# %%
findings = report.to_frame()
findings.groupby(["severity", "check"]).size()

# %%
for _, finding in findings.drop_duplicates("check").iterrows():
    print(
        f"{finding['severity']}: {finding['recording']}, {finding['channel']}: {finding['message']}"
    )

# %% [markdown] Each impact bears the gravest verdict about it, so that a condition selects those
# without any objection.

# %%
store.impacts(campaign="six-settings")["quality"].value_counts()

# %%
store.close()
