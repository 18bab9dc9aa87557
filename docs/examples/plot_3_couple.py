"""
Couple parts into a machine
===========================

Two masses, a joint with a spring that softens, and a force. With the joint as a describing function the answer depends
on the force: the peak bends over, and there are three answers at one frequency.
"""

from importlib.resources import files

import matplotlib.pyplot as plt

from machines import AmplitudeMap, read_machine, response

LIBRARY = files("machines") / "library"

# %%
# A machine file names parts, joints, and where it is driven.

machine = read_machine(LIBRARY / "two_mass.toml")
print(machine)

# %%
# Every branch of the response, its folds, and whether each motion would last.

found = response(machine, [1.0, 10.0, 100.0], method=AmplitudeMap())
print(found)

# %%

_, axes = plt.subplots()
_ = found.plot(axes)
