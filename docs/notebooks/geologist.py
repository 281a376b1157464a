"""
A geologist: sand at its angle of repose
========================================

A column of disks is let go, and its slope at rest is measured. The experiment is a scene file; it is small here, to
run in seconds.
"""

# %%
# The scene
# ---------

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

from pipelines.geology.run import run_geology

SCENE = """
[scene]
name = "A heap of disks"

[sample]
smallest = 0.4
largest = 0.6
density = 2800.0

[contact]
friction = 0.5

[time]
step = 0.02
steps = 400

[solver]
min_iterations = 20
max_iterations = 40

[repose]
length = 6.0
height = 6.0
rough = true

[output]
every = 10
fields_every = 400
"""
folder = TemporaryDirectory()
scene = Path(folder.name, "heap.toml")
scene.write_text(SCENE, encoding="utf-8")

# %%
# The run
# -------
# The first lines say how far the result can be trusted: overlaps of disks, and steps above the tolerance.

report = run_geology(scene, "repose", Path(folder.name, "heap"))
for name, value in report.summary["measures"].items():
    print(f"{name}: {value}")

# %%
# The heap
# --------

for picture in sorted(Path(folder.name, "heap").glob("*.png"))[:1]:
    figure, axes = plt.subplots(figsize=(7, 3))
    axes.imshow(plt.imread(picture))
    axes.set_axis_off()
folder.cleanup()
