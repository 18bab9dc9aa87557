"""A measured circuit that is a mass on a hardening spring: ten realisations of an odd random multisine."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from jointlib import read_measurement
from jointlib.estimation.estimate import estimate
from jointlib.estimation.result import Estimate
from jointlib.modal_fit.fit import fit_modes
from jointlib.modal_fit.responses import Responses

DATA = Path(os.environ.get("JOINTLIB_DATA", "data")) / "silverbox" / "SNLS80mV.csv"
RATE, PERIOD = 1e7 / 2**14, 8192
ENDS = (49166, 57860, 66553, 75245, 83939, 92629, 101321, 110013, 118706, 127399)
"""Just before the input of each realisation falls silent; the period before it is steady."""


def estimated(folder: Path, chosen: range) -> Estimate:
    """The response from some realisations; volts stand for newtons and metres."""
    table = np.genfromtxt(DATA, delimiter=",", skip_header=1, usecols=(0, 1))
    text = f'schema = "jointlib/measurement/1"\nkind = "shaker"\nsample_rate = {RATE!r}\nperiod = {PERIOD}\n'
    for name, quantity, unit in (("V1", "force", "N"), ("V2", "displacement", "m")):
        text += f'[[channel]]\nname = "{name}"\nquantity = "{quantity}"\nunit = "{unit}"\ndof = "box.x"\n'
    for k in chosen:
        part = table[ENDS[k] - PERIOD + 1 : ENDS[k] + 1]
        np.savez(folder / f"r{k}.npz", V1=part[:, 0], V2=part[:, 1])
        text += f'[[record]]\nfile = "r{k}.npz"\n'
    (folder / "box.toml").write_text(text + '[estimate]\nsignal = "multisine"\n')
    return estimate(read_measurement(folder / "box.toml"))


@pytest.fixture(scope="module")
def halves(tmp_path_factory: pytest.TempPathFactory) -> tuple[Estimate, Estimate]:
    if not DATA.is_file():
        pytest.skip(f"{DATA} is not there (set JOINTLIB_DATA)")
    folder = tmp_path_factory.mktemp("silverbox")
    return estimated(folder, range(5)), estimated(folder, range(5, 10))


def test_two_halves_of_the_realisations_differ_as_their_variance_says(halves: tuple[Estimate, Estimate]) -> None:
    """The spring makes realisations differ by far more than noise; their number decides how well the line is known."""
    (a,), (b,) = (half.frfs for half in halves)
    _, i, k = np.intersect1d(a.frequency, b.frequency, return_indices=True)  # some lines are hardly excited
    assert len(i) > 0.99 * len(a.frequency)
    odd = np.round(a.frequency * PERIOD / RATE).astype(int)
    assert np.mean(odd % 2 == 1) > 0.99
    assert a.frequency[-1] == pytest.approx(200.0, rel=0.01)
    assert a.variance is not None
    assert b.variance is not None
    ratio = np.abs(a.value[i] - b.value[k]) ** 2 / (a.variance[i] + b.variance[k])
    assert np.mean(ratio) == pytest.approx(1.25, abs=0.3)  # F(2, 16) has a mean of 8/7


@pytest.mark.slow
def test_its_one_mode_is_where_the_phase_turns(halves: tuple[Estimate, Estimate]) -> None:
    found = []
    for half in halves:
        (frf,) = half.frfs
        assert frf.deviation_together is not None
        low = frf.frequency < 160
        fit = fit_modes(
            Responses(
                frf.frequency[low], frf.receptance[None, low], frf.deviation_together[None, low], ((0, 0),), ("x",)
            )
        )
        strongest = int(np.argmax(np.abs(fit.residues[0]) / fit.damping_ratio))
        turned = np.interp(-90.0, np.degrees(np.angle(frf.receptance[low]))[::-1], frf.frequency[low][::-1])
        assert fit.frequency[strongest] == pytest.approx(turned, rel=0.01)
        found.append((fit.frequency[strongest], fit.damping_ratio[strongest]))
        assert fit.fit_error < 0.05
    (f, zeta), (g, other) = found
    assert f == pytest.approx(g, rel=2e-3)
    assert zeta == pytest.approx(other, rel=0.03)
