"""Cutting and chatter, from the process to the depth that is told. The public names are in `machines.lobes`.

Its rooms in order: process, loops, cutters, rest, amplitude, in_time, forced. They import the tool and below.
"""
