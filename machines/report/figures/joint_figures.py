"""Pictures of a joint: its static fit, its force surface, its describing function."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointlib.arrays import Array
from jointlib.describing import DescribingFunction
from jointlib.identification.result import draw_static
from jointlib.joint import Joint
from jointlib.shown.pictures import draw_stiffness, shades

from ..drawing import AFTER, BEFORE, MEASURED, sheet, thin
from ..page import Figure


def static_fit(joint: Joint, displacement: Array, load: Array, preloads: Array, rms: Array, best: float) -> Figure:
    """Load over deflection with the fitted curve and its misfit, and the misfit over the preload of the sweep."""
    with sheet(3, width=11.0, height=3.4) as paper:
        curve, misfit, sweep = paper.axes
        draw_static(curve, joint, displacement, load)
        curve.set(title="Static curve")
        curve.legend()
        misfit.axhline(0, color="#57606a", linewidth=0.8)
        error = load - joint.force_along(displacement, 0 * displacement)
        misfit.plot(displacement * 1e6, error, ".", color=MEASURED, markersize=4)
        misfit.set(xlabel="deflection [µm]", ylabel="load − fit [N]", title="What the fit leaves")
        sweep.loglog(preloads, rms, color=AFTER)
        sweep.plot([best], [np.interp(best, preloads, rms)], "o", color=BEFORE)
        sweep.set(xlabel="preload of the sweep [N]", ylabel="rms [N]", title="Misfit over preload")
    return Figure(
        paper.svg,
        "Static loading curve, what the fitted Hertz guide leaves of it, and the root mean square misfit "
        f"when the preload is swept with the best kappa at each (minimum at {best:.0f} N).",
    )


def surface(displacement: Array, velocity: Array, force: Array, joint: Joint, stiffness: float) -> Figure:
    """Restoring force over displacement and velocity, less a straight spring: measured samples and the model."""
    z, v, f = thin(displacement, velocity, force, most=3000)
    x, y = np.meshgrid(np.linspace(z.min(), z.max(), 60), np.linspace(v.min(), v.max(), 60))
    smooth = Joint(tuple(law for law in joint.laws if not law.states))
    model = smooth.force_along(x.ravel(), y.ravel()).reshape(x.shape) - stiffness * x
    limit = float(np.percentile(np.abs(f - stiffness * z), 99.5))
    with sheet(2, width=11.0, height=4.0, sharex=True, sharey=True) as paper:
        left, right = paper.axes
        options = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
        dots = left.scatter(z * 1e6, v, c=f - stiffness * z, s=5, linewidths=0, rasterized=True, **options)
        right.pcolormesh(x * 1e6, y, model, shading="gouraud", rasterized=True, **options)
        left.set(xlabel="displacement [µm]", ylabel="velocity [m/s]", title="From the records")
        right.set(xlabel="displacement [µm]", title="Identified, parts without memory")
        for axes in paper.axes:
            axes.grid(False)
        left.figure.colorbar(dots, ax=paper.axes, label=f"force − {stiffness / 1e6:.0f} N/µm · displacement [N]")
    return Figure(
        paper.svg,
        "Restoring-force surface, the straight part taken off so that the rest can be seen: samples of the "
        "records (left) and the identified model (right).",
    )


def gain(joints: Mapping[str, Joint], amplitude: Array, frequency: float) -> Figure:
    """Equivalent stiffness and damping over amplitude at one frequency (Hz), one curve per joint."""
    omega = 2 * np.pi * frequency
    with sheet(2, width=9.5, height=3.4) as paper:
        left, right = paper.axes
        for (name, joint), colour in zip(joints.items(), (BEFORE, AFTER)[-len(joints) :], strict=True):
            G = DescribingFunction(joint)(amplitude, omega)
            style = "--" if colour == BEFORE else "-"
            draw_stiffness(left, amplitude, G, linestyle=style, color=colour, label=name)
            right.plot(amplitude * 1e6, G.imag / omega, style, color=colour, label=name)
            high = joint.validity.get("amplitude", (0.0, np.inf))[1]
            if high < amplitude[-1]:
                for axes in paper.axes:
                    axes.axvspan(high * 1e6, amplitude[-1] * 1e6, color="#f3f4f6", zorder=0)
        left.set(xlabel="amplitude [µm]", ylabel="Re G [N/µm]", title="Equivalent stiffness")
        right.set(xlabel="amplitude [µm]", ylabel="Im G/ω [N s/m]", title="Equivalent damping")
        left.legend()
    return Figure(
        paper.svg,
        f"Describing function at {frequency:.0f} Hz over the amplitude of the relative motion. Grey: beyond "
        "the amplitudes of the records.",
    )


def gain_over_frequency(joint: Joint, amplitudes: Array, band: tuple[float, float]) -> Figure:
    """Size of G at several amplitudes, over the band it is used in and the one it was identified in (Hz)."""
    first, last = joint.validity.get("frequency", band)
    frequency = np.geomspace(min(first, band[0]), max(last, band[1]), 120)
    with sheet(width=6.5, height=3.4) as paper:
        for A, colour in zip(amplitudes, shades(len(amplitudes)), strict=True):
            G = DescribingFunction(joint)(A, 2 * np.pi * frequency)
            paper.axes.loglog(frequency, np.abs(G) / 1e6, color=colour, label=f"{A * 1e6:.3g} µm")
        for low, high in ((frequency[0], first), (last, frequency[-1])):
            if low < high:
                paper.axes.axvspan(low, high, color="#f3f4f6", zorder=0)
        paper.axes.set(xlabel="frequency [Hz]", ylabel="|G| [N/µm]")
        paper.axes.legend(title="amplitude")
    beyond = " Grey: beyond the frequencies of the records." if "frequency" in joint.validity else ""
    return Figure(paper.svg, f"Size of the describing function over frequency.{beyond}")
