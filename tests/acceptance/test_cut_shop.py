"""Simulated test cuts against exact lobes, which share nothing with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cut_shop import drawn
from cut_table import machine_of, told_of, walked

from jointlib.cuts.heard import told_by
from jointlib.cuts.sound import Sound, listen
from machines import lobes_at_amplitude


@pytest.mark.slow
def test_cuts_in_time_sing_beyond_the_exact_border_and_not_before() -> None:
    c = drawn(3, "")
    true = replace(c, told=c.mill, speeds=c.speeds[2:6])
    (told,) = told_of([true])
    chart = lobes_at_amplitude(machine_of(true), true.speeds)
    clear = 0
    for rungs, border, f in zip(told, chart.depth, chart.chatter_frequency, strict=True):
        for depth, sound in zip(true.depths, rungs, strict=True):
            h = told_by(sound)
            apart = np.log(border / depth)
            if 0.1 < abs(apart) < 0.6:
                clear += 1
                assert (h.verdict == "stable") == (apart > 0), (depth, border, h)
            if h.chatter_frequency and -0.15 < apart < 0:
                tooth = true.mill.teeth * h.speed / 60
                beside = (h.chatter_frequency - f) % tooth, (h.chatter_frequency + f) % tooth
                assert min(min(d, tooth - d) for d in beside) < 0.01 * h.chatter_frequency
    assert clear > 5


def test_the_shop_stops_at_a_speed_where_the_verdict_turns() -> None:
    c = drawn(5, "coefficient")
    told = [[_sound(n, c.mill.teeth, 0.0 if k < 5 else 1.0) for k in range(9)] for n in c.speeds]
    m = walked(c, told)
    assert 0 < len(m.cuts) <= c.cuts
    for n in c.speeds:
        verdicts = [cut.verdict for cut in sorted(m.cuts, key=lambda cut: cut.depth) if cut.speed == n]
        assert verdicts == sorted(verdicts, reverse=True)  # stable below, chatter above


def _sound(speed: float, teeth: int, chatter: float) -> Sound:
    t = np.arange(0, 40 * 60 / speed, 60 / speed / 100)
    tooth = 2 * np.pi * teeth * speed / 60
    return listen(np.sin(tooth * t) + chatter * np.sin(1.31 * tooth * t), 100 * speed / 60, speed, teeth, "cut")
