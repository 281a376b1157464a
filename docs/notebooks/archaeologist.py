"""
An archaeologist: what is known of a wall, and from whom
========================================================

A survey goes into a database, what is known besides it is recorded, and questions are asked of both. The window bay
and all that is recorded of it are invented.
"""

# %%
# The survey and the records
# --------------------------
# Nothing is ever overwritten: what is recorded later stands beside what was there, with its author and source.

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

import moma

sample = Path("../../data/samples/window")
folder = TemporaryDirectory()
url = f"sqlite:///{folder.name}/window.db"
moma.ingest([sample / "window.moma"], url)
moma.record([sample / "knowledge.toml"], url)
database = moma.open_database(url)

# %%
# Questions
# ---------
# A kind includes its subkinds, and conditions ask for attributes, marks, relations and history.

with database.session(read_only=True) as session:
    for stone in moma.find(session, "ashlar", ["has_mark()"]):
        print(stone.code, stone.kind)
    rows = moma.find_rows(
        session, "ashlar", columns=["code", "kind", "phase", "material", "x", "z", "length", "height"]
    )

# %%
# The elevation by building phase
# -------------------------------
# Stones without a phase stay grey: that nobody has dated them is an answer too.

phases = sorted({str(row["phase"]) for row in rows if row["phase"] is not None})
colours = {phase: plt.cm.tab10(number) for number, phase in enumerate(phases)}
figure, axes = plt.subplots(figsize=(6, 5))
for row in rows:
    corner = (row["x"] - row["length"] / 2, row["z"] - row["height"] / 2)
    colour = colours.get(str(row["phase"]), "lightgrey")
    axes.add_patch(plt.Rectangle(corner, row["length"], row["height"], facecolor=colour, edgecolor="black"))
for phase, colour in colours.items():
    axes.plot([], [], "s", color=colour, label=f"phase {phase}")
axes.autoscale_view()
axes.set_aspect("equal")
axes.set_xlabel("x [m]")
axes.set_ylabel("height [m]")
axes.legend()

# %%
# One stone and its history
# -------------------------

with database.session(read_only=True) as session:
    for event in moma.history(session, "W12-04"):
        print(event)
database.close()
folder.cleanup()
