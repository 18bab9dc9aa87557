"""
Compare designs
===============

How stiff should the mounts of a lathe be? Seven designs of the lathe, each coupled and cut.
"""

from importlib.resources import files

import matplotlib.pyplot as plt
import numpy as np

from machines import lobes_at_amplitude, read_machine

LIBRARY = files("machines") / "library"

# %%
# The mounts under the bed from half to four times their stiffness. A study file does the same with many factors, and
# says how sure its ranking is: ``jointlib study run``.

machine = read_machine(LIBRARY / "lathe.toml")
mounts = [c for c in machine.connections if c.name.startswith("mount_")]
speeds = np.linspace(*machine.cutting["speed"], 60)
shares = np.geomspace(0.5, 4, 7)
depths = []
for share in shares:
    design = machine
    for mount in mounts:
        stiffer = {"linear.stiffness": share * mount.joint.parameters["linear.stiffness"]}
        design = design.with_joint(mount.name, mount.joint.with_parameters(stiffer))
    depths.append(lobes_at_amplitude(design, speeds).minimum_depth)
best = int(np.argmax(depths))
print(f"{1e3 * depths[best]:.3g} mm with mounts {shares[best]:.3g} times as stiff, {1e3 * depths[0]:.3g} mm with half")

# %%

_, axes = plt.subplots()
axes.semilogx(shares, 1e3 * np.array(depths), "o-")
axes.set_xlabel("stiffness of the mounts over that of the file")
axes.set_ylabel("depth safe at every speed [mm]")
axes.grid(True)
