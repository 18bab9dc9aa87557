"""
Find what the model lacks
=========================

The guide was shaken on a rig. The identified joint explains most of the force, not all of it. A trace finds the rest,
names it, and mends the joint. The records are simulated and hold an effect that the model does not.
"""

from importlib.resources import files

import matplotlib.pyplot as plt

from jointlib import read_joint, read_measurement, trace

LIBRARY = files("machines") / "library"

# %%
# Before: the joint as it was fitted to the static test.

rig = read_measurement(LIBRARY / "guide_mill" / "rig.measurement.toml")
report = trace(rig, read_joint(LIBRARY / "guide_mill" / "start.joint.toml"))
print(report.sentence)

# %%
# The error before and after, judged on records that taught nothing.

before, after = report.error_before["relative"], report.error_after["relative"]
print(f"{100 * before:.3g} % before, {100 * after:.3g} % after")

# %%
# The mended joint: what vibration does to its stiffness and its loss.

_, axes = plt.subplots()
_ = report.mended.plot(axes)
