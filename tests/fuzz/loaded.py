"""Loads once what inputs need, for all the children that run them."""

import importlib
import pkgutil

import h5py  # noqa: F401
import matplotlib.figure  # noqa: F401
import scipy.interpolate
import scipy.io
import scipy.signal
import scipy.stats  # noqa: F401
import seeds  # noqa: F401

import fmu
import jointlib
import machines
from jointlib.units import scale

scale("furlong", "m", "")  # the table of units is read at the first one that is not common
for package in (jointlib, machines, fmu):
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
