"""What a joint that is not linear makes of a motion that is known in part: what is lost, and how noise is passed on."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import MemorylessLaw
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.spectra import OVERSAMPLING
from jointlib.loop.balance.steady import steady_force

_ROUNDS = 2
_CLEAR_OF_RESONANCE = 0.5
"""Nearer to the joint's resonance spring and mass cancel, and what is left of them is mostly error."""


def unseen_motion(observed: Observed, joint: Joint) -> ComplexArray | None:
    """Z on the period lines outside the excited band where it is lost in noise, or above the band; 0 elsewhere.

    A joint that is not linear moves the bodies on lines below the band, where integration drowns z in noise, and above
    it. Friction turns within a small part of a cycle, and there a few per cent of ż decide its force. The bodies' own
    equation tells that motion once the joint is about known, with μ = 1/m1 + 1/(m2 + m3) and the joint's linear part D:

        (−ω² + μ D) Z = P/m1 − μ (F − D Z).

    Not near the joint's resonance, where small errors of D would move z much. In m times samples of the oversampled
    period, one entry a line; None without a known driven mass, and for a joint that is linear, where nothing moves
    outside the band.
    """
    rig = observed.rig
    if rig.m1 is None or all(law.linear for law in joint.laws):
        return None
    z, _, step = observed.path
    omega: Array = np.asarray(2 * np.pi * np.fft.rfftfreq(len(z), step), dtype=float)
    lost, P = np.ones(len(omega), dtype=bool), np.zeros(len(omega), dtype=complex)
    lost[0] = False
    on = observed.on_period
    _, low, high, _ = observed.band
    excited = (observed.frequency >= low - 1e-9) & (observed.frequency <= high + 1e-9)
    lost[1 : on.sum() + 1] = ~(observed.kept | excited)[on]
    if rig.has_force:
        P[1 : on.sum() + 1] = observed.significant("P")[on] * (OVERSAMPLING / observed.spectra.periods)
    k, c = observed.linear_part(observed.model_force(joint))
    m1, carried = rig.two_sides(omega)
    D, mu = k + 1j * omega * c, 1 / m1 + 1 / carried
    dynamic = mu * D - omega**2
    lost &= np.abs(dynamic) > _CLEAR_OF_RESONANCE * np.maximum(np.abs(mu * D), omega**2)
    Z: ComplexArray = np.zeros(len(omega), dtype=complex)
    known = np.fft.rfft(z)
    for _ in range(_ROUNDS):
        path = known + Z
        z, v = np.fft.irfft(path, len(z)), np.fft.irfft(1j * omega * path, len(z))
        # Half the samples do for a force that is smooth within the band.
        F = np.fft.rfft(sum(steady_force(law, z[::2], v[::2], 2 * step) for law in joint.laws)) * 2
        beyond = np.zeros(len(omega), dtype=complex)
        beyond[: len(F)] = F
        Z = np.where(lost, (P / m1 - mu * (beyond - D * Z)) / np.where(lost, dynamic, 1.0), 0)
    return Z


def passed_on(observed: Observed, joint: Joint) -> Array | None:
    """Variance of the joint force on the lines because its tangent swings while the measured motion is noisy.

    h = ∂f/∂z and g = ∂f/∂ż swing along the path about their means, which the linear part of the covariance holds. With
    their Fourier coefficients H, G over a period and the noise S_z of z on the lines where it is measured,

        var F_l = Σ_m |H_(l−m) + jω_m G_(l−m)|² S_z(m),    H_0 = G_0 = 0.

    Dry friction reverses where ż is near 0: there a small error of ż is a large one of the force. In (N times
    samples)², on the lines of the record; None where no law without memory has a tangent that swings.
    """
    laws = [law for law in joint.laws if isinstance(law, MemorylessLaw) and not law.linear]
    if not laws:
        return None
    z, v, step = observed.path
    tangents = [law.slopes(z, v) for law in laws]
    H, G = (np.fft.fft(sum(t[i] for t in tangents)) / len(z) for i in (0, 1))
    H[0] = G[0] = 0.0
    on = observed.on_period
    count = int(on.sum())
    S = np.zeros(len(z))
    S[1 : count + 1] = np.where(observed.kept, observed.displacement_noise, 0)[on]
    S[-count:] = S[count:0:-1]
    omega = 2 * np.pi * np.fft.fftfreq(len(z), step)
    pairs = ((np.abs(H) ** 2, S), (np.abs(G) ** 2, omega**2 * S), (2 * (H.conj() * G).imag, -omega * S))
    total = np.fft.ifft(sum(np.fft.fft(a) * np.fft.fft(b) for a, b in pairs)).real
    out = np.zeros(len(on))
    out[on] = np.maximum(total[1 : count + 1], 0.0)
    return out
