# %% [markdown]
# # Train, compare and promote contact models
#
# After this notebook you can freeze a dataset, train models of the contact force on it, compare
# their versions on pulses that none of them has seen, put one version in use with a reason, and
# predict pulses with it.

# %%
import pyroshock as ps

store = ps.open("lab.db")

# %% [markdown]
# ## A campaign to learn from
#
# Forty settings of an instrumented hammer, three hits each, recorded on the virtual bench. With a
# campaign of your own, this cell is `store.ingest("FOLDER")`.

# %%
plan = store.plan.lhs("spring", kind="hammer", runs=40, repetitions=3, seed=1)
store.ingest(plan.simulate("spring", seed=1))

# %% [markdown]
# ## A dataset
#
# A dataset holds the usable pulses of campaigns and never changes. Its hash says which pulses a
# model has learned from, also in ten years. A pulse has its predictors, its contact time, and its
# force at 20 points.

# %%
data = store.dataset("spring-1", campaigns=["spring"])
data

# %%
pulses = data.to_frame()
pulses[
    ["run", "repetition", "tip_material", "tip_radius_m", "impact_velocity_m_s", "contact_time_s"]
].head()

# %% [markdown] A model must be judged on pulses that it has not seen. The question decides what is
# held out: repetitions of known settings, whole settings, or a whole material.

# %%
data.splits()

# %% [markdown]
# ## Train
#
# Three models: a polynomial, a decision tree, and a physical pulse whose remainder is learned
# (`hybrid`). Each is trained once for each way of holding out, and registered as a version.
# `store.train(data)` without names trains the five usual models, and `models="all"` all.

# %%
runs = store.train(data, models=["linear", "tree", "hybrid"], splits=["configurations"])
runs.to_frame()[
    ["model", "split", "force_nrmse", "force_nrmse_low", "force_nrmse_high", "contact_time_error"]
]

# %%
_ = runs.plot()

# %% [markdown]
# ## Compare
#
# A comparison uses the held-out pulses that the versions have in common. It says whether a
# difference is beyond chance; the bars are 90 % intervals.

# %%
comparison = store.compare("hybrid@1", "tree@1", split="configurations")
for sentence in comparison.sentences():
    print(sentence)

# %%
_ = comparison.plot()

# %%
comparison.to_frame()

# %% [markdown]
# ## Promote
#
# The promoted version is the one that predictions use, for all benches of its kind. A candidate is
# judged on settings that it has not seen, against what is in use; as long as no model is in use,
# against a law of contact that was updated by the measured shots. Whether it is promoted or
# refused, the decision is kept with its reason and with the figures on which it was made.

# %%
decision = store.promote("hybrid@1", reason="the smallest error on settings that were held out")
print(decision)

# %% [markdown] The hybrid is the best of the three models. It is refused all the same: the updated
# law is as good, as far as 120 pulses can tell. A laboratory may decide otherwise, for which it
# must give a reason. `force=True` puts the version in use, and the record says that it was forced.

# %%
decision = store.promote(
    "hybrid@1", force=True, reason="to be watched in use until the next campaign"
)
print(decision)

# %%
store.models()[["model", "split", "in_use", "force_nrmse"]]

# %% [markdown]
# ## Predict with the model in use
#
# `hybrid@champion` is the version in use, under whatever number. A table of impacts goes in, and
# pulses with spreads come out. The columns are those of the dataset.

# %%
model = store.model("hybrid@champion")
model.columns

# %%
chosen = pulses.drop_duplicates("tip_material").set_index("tip_material", drop=False)
predicted = model.predict(chosen)
predicted.to_frame().iloc[:, :4]

# %% [markdown]
# The bands hold 90 % of new measurements. The dots are the measured points of these pulses.

# %%
axes = predicted.plot()
for line, (_, row) in zip(axes.lines[:], chosen.iterrows(), strict=True):
    points = row.filter(regex=r"^force_\d+_n$").to_numpy(dtype=float)
    time_ms = [
        1e3 * row["contact_time_s"] * place / (len(points) - 1) for place in range(len(points))
    ]
    axes.plot(time_ms, 1e-3 * points, ".", color=line.get_color())
_ = axes.legend(title="tip")
