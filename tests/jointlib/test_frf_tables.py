"""Tables of frequency responses in the columns and units of analysers come back as the response that made them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from jointlib import InputError
from jointlib.frf import Quantity
from jointlib.io.frf_files import read_frf
from jointlib.lab.importing.responses import holds_responses
from jointlib.lab.open_file import open_lab_file

F = np.linspace(50.0, 400.0, 40)
S = 2j * np.pi * F
H = 1 / (S**2 + 2 * 0.02 * 1200 * S + 1200**2)
"""m/N"""
G = 9.80665


def write(path: Path, head: str, *columns: np.ndarray, separator: str = ",") -> Path:
    rows = "".join(separator.join(f"{v:.15g}" for v in row) + "\n" for row in zip(*columns, strict=True))
    path.write_text(f"{head}\n{rows}", encoding="utf-8")
    return path


def decibels(x: np.ndarray) -> np.ndarray:
    return 20 * np.log10(np.abs(x))


DEGREES, RADIANS = np.degrees(np.angle(H)), np.angle(H)
A, V = H * S**2, H * S
TABLES = {
    "f [Hz],Re [um/N],Im [um/N]": (F, H.real * 1e6, H.imag * 1e6),
    "Frequency (kHz),Real (m/s²/N),Imaginary (m/s²/N)": (F / 1e3, A.real, A.imag),
    "freq [Hz],magnitude [m/N],phase [deg]": (F, np.abs(H), DEGREES),
    "freq [Hz],amplitude [mm/N],phase [rad]": (F, np.abs(H) * 1e3, RADIANS),
    "f [rad/s],|H| [g/N],angle [deg]": (2 * np.pi * F, np.abs(A) / G, np.degrees(np.angle(A))),
    "Frequenz [Hz],Betrag [mm/s/N],Phase [°]": (F, np.abs(V) * 1e3, np.degrees(np.angle(V))),
    "frequency [Hz],mag [dB re 1 um/N],phase": (F, decibels(H * 1e6), DEGREES),
    "frequency [Hz],level [dB ref g/N],phase,coherence": (F, decibels(A / G), np.degrees(np.angle(A)), 0 * F + 1),
    "f [Hz],H1 real (g/N),H1 imag (g/N)": (F, A.real / G, A.imag / G),
    "f [rpm],Re [m/kN],Im [m/kN]": (60 * F, H.real * 1e3, H.imag * 1e3),
}


@pytest.mark.parametrize("head", TABLES)
def test_what_headings_say_is_read(tmp_path: Path, head: str) -> None:
    found = read_frf(write(tmp_path / "h.csv", head, *TABLES[head]), where="here")
    assert found.quantity is not None
    np.testing.assert_allclose(found.frequency, F, rtol=1e-12)
    np.testing.assert_allclose(found.value / found.quantity.per_receptance(F), H, rtol=1e-9)


def of_version_73(path: Path) -> None:
    """As MATLAB writes it: complex numbers in pairs, vectors as rows of one, 512 bytes in front."""
    h5py = pytest.importorskip("h5py")
    pairs = np.zeros((1, len(F)), dtype=[("real", float), ("imag", float)])
    pairs["real"], pairs["imag"] = H.real, H.imag
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("FRF", data=pairs)
        file.create_dataset("freq", data=F[None])
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


ARRAYS = {
    "as this program has them": lambda path: savemat(path, {"frequency": F, "H": H}),
    "a word for each": lambda path: savemat(path, {"freq": F[:, None], "FRF": H.reshape(-1, 1, 1), "fs": 2048.0}),
    "a structure": lambda path: savemat(path, {"Data": {"Frequency": F, "H11": H, "Coherence": 0 * F + 1}}),
    "version 7.3": of_version_73,
}


@pytest.mark.parametrize("told", ARRAYS)
def test_complex_numbers_beside_frequencies_are_a_response_whatever_their_names(tmp_path: Path, told: str) -> None:
    """``import`` took them for voltages, or wrote a measurement file that no verb read."""
    path = tmp_path / "h.mat"
    ARRAYS[told](path)
    assert holds_responses(open_lab_file(path))
    found = read_frf(path, where="here", quantity="receptance")
    np.testing.assert_allclose(found.frequency, F, rtol=1e-12)
    np.testing.assert_allclose(found.value, H, rtol=1e-12)


def test_two_complex_arrays_are_asked_about_by_their_names(tmp_path: Path) -> None:
    savemat(tmp_path / "h.mat", {"freq": F, "H11": H, "H21": H})
    with pytest.raises(InputError, match=r"holds freq, H11, H21, expected 'frequency' and one of H, .*one complex"):
        read_frf(tmp_path / "h.mat", where="here")


def test_a_deviation_is_in_the_unit_of_the_heading(tmp_path: Path) -> None:
    head = "f [Hz];Re [um/N];Im [um/N];deviation"
    path = write(tmp_path / "h.csv", head, F, H.real * 1e6, H.imag * 1e6, 0.01 + 0 * F, separator=";")
    found = read_frf(path, where="here")
    assert found.variance is not None
    np.testing.assert_allclose(found.variance, 1e-16, rtol=1e-12)


def test_without_units_the_record_says_them(tmp_path: Path) -> None:
    path = write(tmp_path / "h.csv", "f,mag,phase", F, np.abs(H) * 1e6, DEGREES)
    found = read_frf(path, where="here", quantity="receptance", unit="um/N")
    np.testing.assert_allclose(found.value, H, rtol=1e-9)
    decibel = write(tmp_path / "d.csv", "f,mag [dB],phase", F, decibels(A), np.degrees(np.angle(A)))
    np.testing.assert_allclose(read_frf(decibel, where="here", quantity="accelerance").value, A, rtol=1e-9)


def test_a_table_of_other_words_is_read_in_its_order(tmp_path: Path) -> None:
    path = write(tmp_path / "h.csv", "a,b,c", F, H.real, H.imag)
    np.testing.assert_allclose(read_frf(path, where="here", quantity="receptance").value, H, rtol=1e-12)


@pytest.mark.parametrize(
    ("head", "columns", "said"),
    [
        ("f,mag,phase", (F, np.abs(H), RADIANS), "may be degrees or radians"),
        ("f,mag,phase [gon]", (F, np.abs(H), DEGREES), "is in 'gon', expected deg or rad"),
        ("f,mag,phase [deg]", (F, decibels(H), DEGREES), "has values below 0, expected a magnitude"),
        ("f,Re [kg],Im [kg]", (F, H.real, H.imag), "expected motion over force"),
        ("f,Re [m/N],Im [um/N]", (F, H.real, H.imag), "have two units"),
        ("f [m],Re,Im", (F, H.real, H.imag), "expected Hz, kHz, rad/s or rpm"),
        ("f,Re [um/N],Im [um/N]", (F, H.real, H.imag), "unit is 'mm/N', but the headings"),
        ("f,a,b,c,d", (F, F, F, F, F), "headings that say frequency"),
    ],
)
def test_what_cannot_be_known_is_refused(tmp_path: Path, head: str, columns: tuple[np.ndarray, ...], said: str) -> None:
    path = write(tmp_path / "h.csv", head, *columns)
    with pytest.raises(InputError) as caught:
        read_frf(path, where="here", quantity=Quantity.RECEPTANCE.word, unit="mm/N")
    assert said in str(caught.value)


def test_a_force_that_is_told_by_its_rms_counts_by_its_peak(tmp_path: Path) -> None:
    """Levels of force are peaks; the rms of a sine is less by √2."""
    path = write(tmp_path / "a.csv", "f [Hz],Re [m/N],Im [m/N],Force rms [N]", F, H.real, H.imag, 0 * F + 2)
    assert read_frf(path, where="here").force == pytest.approx(2 * np.sqrt(2))
    path = write(tmp_path / "b.csv", "f [Hz],Re [m/N],Im [m/N],Force [N]", F, H.real, H.imag, 0 * F + 2)
    assert read_frf(path, where="here").force == pytest.approx(2.0)


def test_a_force_is_not_taken_for_a_variance(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "f [Hz],x [g/N],y [g/N],Force [N]", F, H.real, H.imag, 0 * F + 2)
    with pytest.raises(InputError, match=r"do not say which column is real .* and 'Force \[N\]' is no variance"):
        read_frf(path, where="here")
