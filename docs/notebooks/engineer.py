"""
An engineer: does the bay stand, and what do its joints carry?
==============================================================

The stones of a survey become rigid bodies with dry joints, and come to rest under their own weight.
"""

# %%
# From the survey to a scene
# --------------------------
# The scene of the sample deforms all its stones. Rigid ones answer the same question about equilibrium within seconds.

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import moma
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import TimeSettings
from mechanics.scene.shapes import box

sample = Path("../../data/samples/window")
folder = TemporaryDirectory()
url = f"sqlite:///{folder.name}/window.db"
moma.ingest([sample / "window.moma"], url)
text = (sample / "window.toml").read_text(encoding="utf-8")
text = text.replace('default = "deformable"', 'default = "rigid"')
scene = Path(folder.name, "window.toml")
scene.write_text(text.partition("[output]")[0] + "[output]\npictures = []\n", encoding="utf-8")

# %%
# The run
# -------
# A notebook shows the verdict, what limits it, and the page of the run.

report = moma.run_scene(scene, url, Path(folder.name, "run"))
print(report.summary["headline"])
report

# %%
# Forces of the joints
# --------------------
# Results of stones are attributes like any other.

with moma.open_database(url) as database, database.session(read_only=True) as session:
    rows = moma.find_rows(session, "ashlar", columns=["code", "z", "joint_pressure"])
pressed = [(row["joint_pressure"] / 1e3, row["z"]) for row in rows if row["joint_pressure"] is not None]
figure, axes = plt.subplots(figsize=(5, 4))
axes.plot(*zip(*pressed, strict=True), "o", markersize=4)
axes.set_xlabel("largest pressure in a joint of the stone [kPa]")
axes.set_ylabel("height of the stone [m]")

# %%
# Blocks without a survey
# -----------------------
# A column on a tilting table tips over its edge at tan α = width / height.

stone = moma.Material("limestone", density=2350.0, young=12e9, poisson=0.2)
table = box("table", (-1, -1, -0.2), (2, 2, 0), stone, fidelity=moma.Fidelity.FIXED)
drum = box("drum", (0, 0, 0), (0.8, 0.8, 1.5), stone)
tilt = TiltingTable.at_rate_degrees((0.0, 1.0, 0.0), rate=10.0, limit=35.0)
column = moma.Scene(
    "column",
    (table, drum),
    time=TimeSettings(step=1e-2, theta=0.5, duration=3.5),
    loads=Loads(gravity=(tilt,)),
)
result = moma.simulate(column)
print(
    f"{result.outcome} at {10 * result.time:.0f}° of tilt; geometry: {np.degrees(np.arctan(0.8 / 1.5)):.0f}°"
)
folder.cleanup()
