"""
Identify a joint
================

A test pulled a guide with known forces and read how far it gave way. Which preload and which stiffness constant fit?
The records are simulated; they stand in for a lab's.
"""

from importlib.resources import files

import matplotlib.pyplot as plt

from jointlib import identify, read_joint, read_measurement

LIBRARY = files("machines") / "library"

# %%
# The measurement file says what each column is, in which unit, at which position. The start gives the parts of the law.

records = [read_measurement(LIBRARY / "guide_mill" / f"{name}.measurement.toml") for name in ("static", "rig")]
found = identify(records, start=read_joint(LIBRARY / "guide_mill" / "start.joint.toml"))
for name, parameter in found.parameters.items():
    print(f"{name:28} {parameter.value:12.5g} {parameter.unit:10} {parameter.status}")

# %%
# What the joint does to a vibration: its describing function, stiffness and loss over amplitude.

_, axes = plt.subplots()
_ = found.joint.plot(axes)
