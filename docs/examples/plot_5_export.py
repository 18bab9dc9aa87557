"""
Export a joint as an FMU
========================

A joint in a file that co-simulation tools read. Before it is written it is validated and replays a reference run; the
export says up to which step it can be trusted.
"""

from importlib.resources import files
from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

from fmu.export import export_fmu
from fmu.verify import verify_fmu
from jointlib import read_joint

LIBRARY = files("machines") / "library"

# %%
# With a C compiler the FMU holds native code, without one it runs in hosts that bring Python.

joint = read_joint(LIBRARY / "guide.joint.toml")
target = Path(mkdtemp()) / "guide.fmu"
done = export_fmu(joint, target)
print(done.runtime, done.verified_with, f"largest step {done.max_step * 1e6:.3g} µs")

# %%
# Anybody can check it again.

verify_fmu(target)
print(target.name, target.stat().st_size, "bytes")

# %%
# What it computes, beside the joint that it came from.

_, axes = plt.subplots()
_ = joint.plot(axes)
