"""
How deep can it cut?
====================

A slender tool with two modes. The chart says at which depth chatter begins, for every spindle speed, and where it pays
to cut.
"""

from importlib.resources import files

import matplotlib.pyplot as plt
import numpy as np

from machines import lobes_at_amplitude, read_machine

LIBRARY = files("machines") / "library"

# %%
# The exact method for milling keeps every harmonic of the tooth frequency.

machine = read_machine(LIBRARY / "two_mode_tool.toml")
chart = lobes_at_amplitude(machine, np.linspace(4000, 25000, 80))
print(chart)

# %%

_, axes = plt.subplots()
_ = chart.plot(axes)

# %%
# The same numbers as a table, with their units.

table = chart.to_dataframe()
print(table.head())
print(table.attrs["units"])
