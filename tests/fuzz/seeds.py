"""Kinds of input that the program takes: files that are right, how each is damaged, and the commands that read it."""

from __future__ import annotations

import io
import random
import shlex
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import mutations
import numpy as np
from mutations import Mutator

sys.path.append(str(Path(__file__).parents[1] / "machines"))

from tool_files import SPINDLE

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
RATE, COUNT = 1000.0, 64


@dataclass(frozen=True)
class Kind:
    """One kind of input."""

    name: str
    files: Mapping[str, Callable[[], bytes]]
    """Files that are damaged, one at a time, by name."""
    mutate: Mutator
    commands: tuple[str, ...]
    """Command lines that read the damaged file, ``{file}`` in them."""
    beside: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)
    """Files that stay whole, made by the name of the damaged one where that stands in them."""
    line: bool = False
    """Whether the command line is damaged and not the file."""


@dataclass(frozen=True)
class Input:
    """One damaged input: files by name, and the command line."""

    kind: str
    files: Mapping[str, bytes]
    line: tuple[str, ...]


@dataclass(frozen=True)
class Drawn:
    """What is damaged of a kind: one of its files, or its command line."""

    name: str
    """The file."""
    data: bytes
    line: tuple[str, ...]

    def damaged(self, kind: Kind, rng: random.Random) -> Drawn:
        """The same with one more damage."""
        if kind.line:
            return replace(self, line=(self.line[0], *mutations.words(rng, list(self.line[1:]))))
        return replace(self, data=kind.mutate(rng, self.data))

    def among(self, kind: Kind) -> Input:
        """It and the files beside it."""
        held = {other: make().replace(b"FILE", self.name.encode()) for other, make in kind.beside.items()}
        whole = {other: make() for other, make in kind.files.items()} if kind.line else {self.name: self.data}
        return Input(kind.name, {**held, **whole}, self.line)


def drawn(kind: Kind, rng: random.Random) -> Drawn:
    """One of the right inputs of a kind."""
    name = rng.choice(sorted(kind.files))
    command = rng.choice(kind.commands).replace("{file}", name).replace("{stem}", Path(name).stem)
    return Drawn(name, kind.files[name](), tuple(shlex.split(command)))


def damaged(kind: Kind, seed: int, number: int) -> Input:
    """The input of a number, the same for the same seed."""
    rng = random.Random(f"{kind.name} {seed} {number}")
    return drawn(kind, rng).damaged(kind, rng).among(kind)


def _signals() -> dict[str, np.ndarray]:
    t = np.arange(COUNT) / RATE
    return {"force": 10 * np.sin(60 * t), "acc_front": 0.3 * np.cos(60 * t)}


def _responses() -> dict[str, np.ndarray]:
    f = np.linspace(50.0, 500.0, 32)
    w = 2 * np.pi * f
    return {"frequency": f, "receptance": 1 / (4e7 - 40 * w**2 + 1j * 3000 * w)}


def _modes() -> dict[str, np.ndarray]:
    return {
        "frequency": np.array([120.0, 345.0]),
        "damping_ratio": np.array([0.01, 0.02]),
        "modal_mass": np.array([3.0, 2.0]),
        "shapes": np.array([[1.0, 0.5], [-0.25, 0.75]]),
    }


def _decay() -> dict[str, np.ndarray]:
    t = np.arange(10 * COUNT) / RATE
    return {"acc_front": np.exp(-3 * t) * np.cos(2 * np.pi * 90 * t), "force": np.cos(60 * t)}


def _matrix() -> np.ndarray:
    return np.array([[3e7, -1e7, 0.0], [-1e7, 2e7, -1e7], [0.0, -1e7, 1e7]])


def _states() -> dict[str, np.ndarray]:
    A = np.array([[0.0, 1.0], [-1e6, -20.0]])
    return {"A": A, "B": np.array([[0.0], [1.0]]), "C": np.array([[1.0, 0.0]]), "D": np.zeros((1, 1))}


@cache
def _npz(name: str) -> bytes:
    out = io.BytesIO()
    np.savez(out, **ARRAYS[name]())
    return out.getvalue()


@cache
def _mat(name: str, form: str = "5", packed: bool = False) -> bytes:
    from scipy.io import savemat

    out = io.BytesIO()
    savemat(out, ARRAYS[name](), format=form, do_compression=packed)
    return out.getvalue()


@cache
def _mat_structure() -> bytes:
    from scipy.io import savemat

    out = io.BytesIO()
    cells = np.array([np.arange(3.0), "text"], dtype=object)
    channel = {"time": np.arange(COUNT) / RATE, "y": _signals()["force"], "unit": "N", "more": cells}
    savemat(out, {"run": channel, "sample_rate": RATE, "flag": np.array([True, False]), "n": np.int16(3)})
    return out.getvalue()


@cache
def _mat_sparse() -> bytes:
    from scipy.io import savemat
    from scipy.sparse import csc_matrix

    out = io.BytesIO()
    savemat(out, {"K": csc_matrix(_matrix())})
    return out.getvalue()


ARRAYS = {
    "signals": lambda: {**_signals(), "fs": np.array(RATE)},
    "decay": _decay,
    "responses": _responses,
    "modes": _modes,
    "matrix": lambda: {"K": _matrix()},
    "states": _states,
}


def _by_file(suffix: str, write: Callable[[Path], object]) -> Callable[[], bytes]:
    """What a writer that takes a path writes."""

    @cache
    def made() -> bytes:
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"data{suffix}"
            write(path)
            return path.read_bytes()

    return made


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in _signals().items():
            item = file.create_dataset(name, data=values)
            item.attrs["unit"] = "N"
        file.attrs["sample_rate"] = RATE


def _hdf5_packed(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group.create_dataset(
            "table", data=np.column_stack(list(_signals().values())), compression="gzip", chunks=(16, 2)
        )
        row = np.array(list(zip(*_signals().values(), strict=True)), dtype=[("a", "f8"), ("b", "f8")])
        group.create_dataset("row", data=row)
        group.create_dataset("said", data="words")


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    with TdmsWriter(path) as writer:
        objects = [
            ChannelObject("run", name, values, properties={"wf_increment": 1 / RATE, "unit_string": "N"})
            for name, values in _signals().items()
        ]
        writer.write_segment([RootObject({"author": "lab"}), *objects])


def _universal(path: Path, binary: int = 0, func_type: int = 1) -> None:
    import pyuff

    f = _responses()
    held = _signals() if func_type == 1 else {"h": f["receptance"]}
    x = np.arange(COUNT) / RATE if func_type == 1 else f["frequency"]
    for number, (name, values) in enumerate(held.items(), 1):
        data = pyuff.prepare_58(
            binary=binary,
            func_type=func_type,
            rsp_node=number,
            rsp_dir=1,
            ref_node=1,
            ref_dir=1,
            data=values,
            x=x,
            id1=name,
            abscissa_spacing=1,
            ordinate_spec_data_type=8 if func_type == 4 else 13,
            orddenom_spec_data_type=13,
        )
        pyuff.UFF(str(path)).write_sets([data], "add")


def _universal_modes(path: Path) -> None:
    import pyuff

    modes, file = _modes(), pyuff.UFF(str(path))
    units = {"units_code": 9, "units_description": "own", "temp_mode": 1, "temp": 1.0, "temp_offset": 0.0}
    file.write_sets({"type": 164, **units, "length": 1000.0, "force": 1.0}, "add")
    for i in range(2):
        data = {"type": 55, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "load_case": 0, "mode_n": i + 1}
        data |= {"freq": modes["frequency"][i], "modal_m": 1.0, "modal_damp_vis": 0.01, "eig": 1j * 100.0}
        data |= {"node_nums": np.array([7, 12]), "r1": modes["shapes"][0], "r2": np.zeros(2), "r3": modes["shapes"][1]}
        file.write_sets(data, "add")


def _wav(path: Path) -> None:
    from scipy.io import wavfile

    samples = np.column_stack(list(_signals().values()))
    wavfile.write(path, int(RATE), np.round(samples / 16 * 2**15).astype("<i2"))


def _csv() -> bytes:
    rows = ["time [s],force [N],acc_front [m/s2]"]
    rows += [f"{i / RATE:.4f},{f:.6g},{a:.6g}" for i, (f, a) in enumerate(zip(*_signals().values(), strict=True))]
    return "\n".join(rows).encode() + b"\n"


def _european() -> bytes:
    rows = ["Messung 7;;", "Datum;23.11.2026;", "Zeit;Kraft;Weg", "s;N;mm"]
    rows += [
        f"{i / RATE:.4f};{f:.6g};{a:.6g}".replace(".", ",")
        for i, (f, a) in enumerate(zip(*_signals().values(), strict=True))
    ]
    return "\n".join(rows).encode() + b"\n"


def _frf_csv() -> bytes:
    held = _responses()
    rows = ["frequency [Hz],real [m/N],imag [m/N]"]
    rows += [f"{f:.6g},{h.real:.9e},{h.imag:.9e}" for f, h in zip(*held.values(), strict=True)]
    return "\n".join(rows).encode() + b"\n"


def _cutpro() -> bytes:
    held = _responses()
    rows = [f"{f:.10g}\t{h.real:.10e}\t{h.imag:.10e}" for f, h in zip(*held.values(), strict=True)]
    rows[0] += "\tFreq\tHz\tReal\tm/N\tImag\tm/N"
    return "\n".join(rows).encode() + b"\n"


def _lvm() -> bytes:
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "X_Columns\tOne",
        "***End_of_Header***\t",
        "\t",
        "Channels\t2\t\t",
        f"Samples\t{COUNT}\t{COUNT}\t",
        "Y_Unit_Label\tN\tg\t",
        f"Delta_X\t{1 / RATE}\t{1 / RATE}\t",
        "***End_of_Header***\t\t\t",
        "X_Value\tforce\tacc_front\tComment",
    ]
    rows = [f"{i / RATE:.6f}\t{f:.6g}\t{a:.6g}" for i, (f, a) in enumerate(zip(*_signals().values(), strict=True))]
    return "\n".join([*head, *rows]).encode() + b"\n"


def _market(symmetric: bool = True, dense: bool = False) -> bytes:
    K = _matrix()
    if dense:
        rows = ["%%MatrixMarket matrix array real general", "% made", "3 3", *(f"{v:g}" for v in K.T.ravel())]
    else:
        pairs = [(i, j) for j in range(3) for i in range(3) if K[i, j] and (i >= j or not symmetric)]
        rows = [f"%%MatrixMarket matrix coordinate real {'symmetric' if symmetric else 'general'}", "%"]
        rows += [f"3 3 {len(pairs)}", *(f"{i + 1} {j + 1} {K[i, j]:g}" for i, j in pairs)]
    return "\n".join(rows).encode() + b"\n"


def _harwell_boeing() -> bytes:
    K = np.tril(_matrix())
    pointers, rows, values = [1], [], []
    for j in range(3):
        inside = [i for i in range(j, 3) if K[i, j]]
        rows += [i + 1 for i in inside]
        values += [K[i, j] for i in inside]
        pointers.append(len(rows) + 1)
    n = len(rows)
    head = [
        f"{'STIFFNESS MATRIX':<72}{'FULL':<8}",
        f"{4 + 2 * n:14d}{4:14d}{n:14d}{n:14d}{0:14d}",
        f"{'RSA':<14}{3:14d}{3:14d}{n:14d}{0:14d}",
        f"{'(1I14)':<16}{'(1I14)':<16}{'(1E25.15)':<20}{'(1E25.15)':<20}",
    ]
    body = [*(f"{p:14d}" for p in pointers), *(f"{r:14d}" for r in rows), *(f"{v:25.15E}" for v in values)]
    return "\n".join([*head, *body]).encode() + b"\n"


def _calculix() -> bytes:
    K = _matrix()
    pairs = [(i, j) for j in range(3) for i in range(j + 1) if K[i, j] or i == j]
    return "".join(f"{i + 1} {j + 1} {K[i, j]:20.13e}\n" for i, j in pairs).encode()


def _dmig() -> bytes:
    K = _matrix()
    rows = [f"DMIG    {'KAAX':<8}{0:8d}{6:8d}{2:8d}{0:8d}{'':16}{3:8d}"]
    for j in range(3):
        rows.append(f"DMIG*   {'KAAX':<16}{7:16d}{j + 1:16d}")
        rows += [f"*       {7:16d}{i + 1:16d}{K[i, j]:16.9E}".replace("E", "D") for i in range(j, 3) if K[i, j]]
    return "\n".join(rows).encode() + b"\n"


def _op4() -> bytes:
    K = _matrix()
    rows = [f"{3:8d}{3:8d}{6:8d}{2:8d}{'KAA':<8}1P,3E22.15"]
    for j in range(3):
        rows += [f"{j + 1:8d}{1:8d}{6:8d}", "".join(f"{v:22.15E}" for v in K[:, j])]
    rows += [f"{4:8d}{1:8d}{1:8d}", f"{1.0:22.15E}"]
    return "\n".join(rows).encode() + b"\n"


def _op4_binary() -> bytes:
    import struct

    def record(body: bytes) -> bytes:
        return struct.pack("<i", len(body)) + body + struct.pack("<i", len(body))

    K = _matrix()
    out = record(struct.pack("<4i8s", 3, 3, 6, 2, b"KAA     "))
    for j in range(3):
        out += record(struct.pack("<3i", j + 1, 1, 6) + K[:, j].tobytes())
    return out + record(struct.pack("<3i", 4, 1, 1) + struct.pack("<d", 1.0))


def _stl(text: bool) -> bytes:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]], dtype="<f4") * 100
    if text:
        facets = [
            "facet normal 0 0 1\nouter loop\n"
            + "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in one)
            + "endloop\nendfacet"
            for one in corners
        ]
        return "\n".join(["solid a", *facets, "endsolid a"]).encode() + b"\n"
    out = b"\0" * 80 + (2).to_bytes(4, "little")
    for one in corners:
        out += np.zeros(3, "<f4").tobytes() + one.tobytes() + b"\0\0"
    return out


@cache
def _fmu() -> bytes:
    import zipfile

    description = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="joint" guid="{1}" numberOfEventIndicators="0">
<CoSimulation modelIdentifier="joint"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="input" variability="continuous"><Real start="0"/>
</ScalarVariable>
<ScalarVariable name="f" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        made.writestr("modelDescription.xml", description)
        made.writestr("binaries/linux64/joint.so", b"\x7fELF")
    return out.getvalue()


def _shipped(name: str) -> Callable[[], bytes]:
    return cache((LIBRARY / name).read_bytes)


def _machine(component: str, dof: str = "x") -> Callable[[], bytes]:
    text = f"""schema = "jointlib/machine/1"
[[component]]
name = "bed"
{component}
[tool]
x = "bed.{dof}"
"""
    return text.encode


HOSTS = {
    "frf.toml": _machine(
        'kind = "frf"\ndofs = ["x"]\n[[component.record]]\nfile = "FILE"\nresponse = "x"\ndrive = "x"\n'
        'quantity = "receptance"'
    ),
    "modes.toml": _machine('kind = "modal"\ndofs = ["x", "z"]\nfile = "FILE"'),
    "modes_at.toml": _machine('kind = "modal"\ndofs = ["x", "z"]\nat = ["7+X", "12+Z"]\nfile = "FILE"'),
    "states.toml": _machine('kind = "state-space"\ndofs = ["x"]\nfile = "FILE"'),
    "matrix.toml": _machine(
        'kind = "matrices"\nmass = "FILE"\nstiffness = "FILE"\ndamping_ratio = 0.02\n'
        '[[component.node]]\nname = "a"\nrows = { x = 1 }',
        "a.x",
    ),
    "outline.toml": _machine(
        'kind = "rigid"\nmass = 2.0\ninertia = [1, 1, 1]\noutline = "FILE"\n'
        '[[component.point]]\nname = "p"\nat = [0, 0, 0]',
        "p.x",
    ),
}
RECORD = ("inspect {file}", "import {file} -o out.measurement.toml")


def _host(name: str) -> dict[str, Callable[[], bytes]]:
    return {name: HOSTS[name]}


def _parts(*names: str) -> dict[str, Callable[[], bytes]]:
    return {name: _shipped(name) for name in names}


JOINTS = ("guide.joint.toml", "two_mass.joint.toml", "paper_sdof_hertz.joint.toml", "mount.joint.toml")
MACHINES = (
    "two_mass.toml",
    "two_mode_tool.toml",
    "carriage.toml",
    "lathe.toml",
    "guide_body.toml",
    "paper_sdof_hertz.toml",
)

LINES = (
    "inspect two_mass.toml",
    "inspect two_mass.toml -o picture.svg --mode 1",
    "df guide.joint.toml --amplitude 1um --frequency 500 --json",
    "df guide.joint.toml --amplitude 1um,3um --frequency 500Hz",
    "frf two_mass.toml --force 10 --frequency 1kHz:2kHz:20 -o out.npz",
    "frf two_mass.toml --force 10 50N --frequency 1kHz:2kHz:20 --harmonics 1,3 -o out.csv",
    "frf two_mass.toml --force 10 --frequency 1000:2000:20 --samples 40 -o out.frf",
    "modes two_mass.toml --amplitude 1um",
    "check two_mass.toml --frequency 100:500:20",
    "lobes two_mode_tool.toml --speed 3000rpm 6000rpm",
    "lobes two_mode_tool.toml --speed 3000 6000 -o out.csv --amplitude 1um",
    "new machine -o new.toml",
    "new joint -o new.joint.toml",
    "new study --machine two_mass.toml -o new.study.toml",
    "import static.csv --kind static --set channel.load.unit=kN -o x.measurement.toml",
    "identify static.measurement.toml --law hertz-guide -o j.joint.toml",
    "compare two_mass.toml two_mode_tool.toml",
    "laws --json",
    "study run nothing.study.toml -o out",
    "estimate hits.measurement.toml -o out.measurement.toml",
    "inspect static.csv",
    "fmu guide.joint.toml -o 1.fmu --fmi 4",
)

DECAY = """schema = "jointlib/measurement/1"
kind = "ringdown"
sample_rate = "1 kHz"
modal_mass = "2 kg"
[[channel]]
name = "acc_front"
quantity = "acceleration"
unit = "m/s^2"
[[record]]
file = "a.npz"
"""
PATH = """schema = "jointlib/measurement/1"
kind = "path"
sample_rate = "1 kHz"
carriage = "25 kg"
[[channel]]
name = "acc_front"
quantity = "displacement"
unit = "mm"
[[channel]]
name = "force"
quantity = "force"
unit = "N"
[[record]]
file = "a.npz"
condition = "slow"
"""


def _text(words: str) -> Callable[[], bytes]:
    return words.encode


def _sheet() -> bytes:
    """As a lab writes it: names over units, thousands apart by dots, decimals by commas, notes behind."""
    rows = ["Prüfstand 3;Datum: 03.11.2026;;", "Abtastrate;1 000 Hz;;", "", "t;F;s;Bemerkung", "ms;kN;\xb5m;"]
    for i, (f, a) in enumerate(zip(*_signals().values(), strict=True)):
        line = f"{1e3 * i / RATE:.1f};{f / 1e3:.6f};{1e4 * a:,.3f}"
        rows.append(line.replace(",", " ").replace(".", ",") + (";Stoß" if i == 7 else ";"))
    return "\r\n".join(rows).encode("latin-1") + b"\r\n"


KINDS = {
    kind.name: kind
    for kind in (
        Kind(
            "command line",
            {
                **_parts(*JOINTS[:2], *MACHINES[:2]),
                "static.csv": _shipped("guide_mill/static.csv"),
                "static.measurement.toml": _shipped("guide_mill/static.measurement.toml"),
            },
            mutations.raw,
            LINES,
            line=True,
        ),
        Kind(
            "joint",
            _parts(*JOINTS),
            mutations.toml,
            (
                "inspect {file}",
                "df {file} --amplitude 1um --frequency 500",
                "df {file} --amplitude 1e-7 1e-4 --frequency 500 --json",
            ),
        ),
        Kind(
            "machine",
            _parts(*MACHINES),
            mutations.toml,
            ("inspect {file}", "inspect {file}", "inspect {file} -o out.svg", "modes {file}"),
            _parts(*JOINTS),
        ),
        Kind(
            "machine computed",
            _parts("two_mass.toml", "two_mode_tool.toml", "paper_sdof_hertz.toml"),
            mutations.toml,
            (
                "frf {file} --frequency 1kHz:2kHz:12 --force 10 --harmonics 1 -o out.npz",
                "check {file} --frequency 1kHz:2kHz:12",
                "modes {file} --amplitude 1um",
            ),
            _parts(*JOINTS),
        ),
        Kind(
            "measurement",
            {
                "static.measurement.toml": _shipped("guide_mill/static.measurement.toml"),
                "tip.measurement.toml": _shipped("three_joints/tip.measurement.toml"),
                "rig.measurement.toml": _shipped("guide_mill/rig.measurement.toml"),
                "hits.measurement.toml": _shipped("tap_test/hits.measurement.toml"),
            },
            mutations.toml,
            ("inspect {file}", "inspect {file}", "identify {file} --law hertz-guide -o out.joint.toml"),
            {
                "static.csv": _shipped("guide_mill/static.csv"),
                **{f"tip_{n}N.csv": _shipped(f"three_joints/tip_{n}N.csv") for n in (1, 3, 8, 15, 20)},
            },
        ),
        Kind(
            "study",
            {
                "guide_mill.study.toml": _shipped("guide_mill.study.toml"),
                "column_mill.study.toml": _shipped("column_mill.study.toml"),
            },
            mutations.toml,
            ("inspect {file}",),
            {
                **_parts("guide_mill.toml", "column_mill_a.toml", "column_mill_b.toml", *JOINTS),
                "column_mill/modules.toml": _shipped("column_mill/modules.toml"),
                "guide_mill/start.joint.toml": _shipped("guide_mill/start.joint.toml"),
            },
        ),
        Kind(
            "tool",
            {
                "a.tool.toml": _shipped("tools/end_mill_16.tool.toml"),
                "shrink_fit.holder.toml": _shipped("tools/collet.holder.toml"),
            },
            mutations.toml,
            ("inspect mill.toml", "modes mill.toml", "lobes mill.toml --speed 9000 --method zero-order"),
            {
                "mill.toml": _text(SPINDLE.format(top='tool = "a.tool.toml"', parts="", tool="", teeth=2)),
                "a.tool.toml": _shipped("tools/end_mill_16.tool.toml"),
                "shrink_fit.holder.toml": _shipped("tools/collet.holder.toml"),
            },
        ),
        Kind(
            "component",
            {"bar.component.toml": _shipped("bar.component.toml")},
            mutations.toml,
            ("inspect {file}", "uncouple bar.measurement.toml --remove {file} -o out.component.toml"),
            {
                "bar.measurement.toml": _shipped("bar.measurement.toml"),
                **{f"bar/{path.name}": _shipped(f"bar/{path.name}") for path in (LIBRARY / "bar").iterdir()},
            },
        ),
        Kind(
            "cuts",
            {"cuts.measurement.toml": _shipped("end_mill_cuts/cuts.measurement.toml")},
            mutations.toml,
            ("inspect {file}",),
        ),
        Kind(
            "cutting forces",
            {"forces.measurement.toml": _shipped("end_mill_forces/forces.measurement.toml")},
            mutations.toml,
            ("inspect {file}", "identify {file} -o out.cutting.toml"),
            {
                path.name: _shipped(f"end_mill_forces/{path.name}")
                for path in (LIBRARY / "end_mill_forces").glob("*.csv")
            }
            | {
                path.name: _shipped(f"end_mill_forces/{path.name}")
                for path in (LIBRARY / "end_mill_forces").glob("*.npz")
            },
        ),
        Kind(
            "decay and path",
            {"decay.measurement.toml": _text(DECAY), "path.measurement.toml": _text(PATH)},
            mutations.toml,
            ("inspect {file}", "identify {file} -o out.joint.toml", "identify {file} --law linear -o out.joint.toml"),
            {"a.npz": lambda: _npz("decay")},
        ),
        Kind("sheet", {"a.csv": _sheet}, mutations.lines, RECORD),
        Kind("csv", {"a.csv": _csv, "b.csv": _european, "c.txt": _frf_csv}, mutations.lines, RECORD),
        Kind(
            "csv response",
            {"h.csv": _frf_csv, "h.frf": _cutpro},
            mutations.lines,
            ("inspect frf.toml",),
            _host("frf.toml"),
        ),
        Kind("lvm", {"a.lvm": _lvm}, mutations.lines, RECORD),
        Kind("npz", {"a.npz": lambda: _npz("signals"), "b.npz": lambda: _npz("responses")}, mutations.archive, RECORD),
        Kind(
            "npz response",
            {"h.npz": lambda: _npz("responses")},
            mutations.archive,
            ("inspect frf.toml",),
            _host("frf.toml"),
        ),
        Kind(
            "npz modes",
            {"h.npz": lambda: _npz("modes")},
            mutations.archive,
            ("inspect modes.toml",),
            _host("modes.toml"),
        ),
        Kind(
            "npz states",
            {"h.npz": lambda: _npz("states")},
            mutations.archive,
            ("inspect states.toml",),
            _host("states.toml"),
        ),
        Kind(
            "npz matrix",
            {"h.npz": lambda: _npz("matrix")},
            mutations.archive,
            ("inspect matrix.toml",),
            _host("matrix.toml"),
        ),
        Kind(
            "mat",
            {
                "a.mat": lambda: _mat("signals"),
                "b.mat": lambda: _mat("signals", "5", True),
                "c.mat": lambda: _mat("signals", "4"),
                "d.mat": _mat_structure,
            },
            mutations.matlab,
            RECORD,
        ),
        Kind(
            "mat response",
            {"h.mat": lambda: _mat("responses"), "i.mat": lambda: _mat("responses", "4")},
            mutations.matlab,
            ("inspect frf.toml",),
            _host("frf.toml"),
        ),
        Kind(
            "mat matrix",
            {"h.mat": lambda: _mat("matrix"), "i.mat": lambda: _mat("matrix", "4"), "j.mat": _mat_sparse},
            mutations.matlab,
            ("inspect matrix.toml",),
            _host("matrix.toml"),
        ),
        Kind("hdf5", {"a.h5": _by_file(".h5", _hdf5), "b.h5": _by_file(".h5", _hdf5_packed)}, mutations.raw, RECORD),
        Kind("tdms", {"a.tdms": _by_file(".tdms", _tdms)}, mutations.raw, RECORD),
        Kind(
            "universal",
            {"a.uff": _by_file(".uff", _universal), "b.uff": _by_file(".uff", lambda p: _universal(p, 1))},
            mutations.lines,
            RECORD,
        ),
        Kind(
            "universal response",
            {
                "h.uff": _by_file(".uff", lambda p: _universal(p, 0, 4)),
                "i.unv": _by_file(".unv", lambda p: _universal(p, 1, 4)),
            },
            mutations.lines,
            ("inspect frf.toml",),
            _host("frf.toml"),
        ),
        Kind(
            "universal modes",
            {"h.uff": _by_file(".uff", _universal_modes)},
            mutations.lines,
            ("inspect modes_at.toml",),
            _host("modes_at.toml"),
        ),
        Kind("wav", {"a.wav": _by_file(".wav", _wav)}, mutations.raw, RECORD),
        Kind(
            "matrix market",
            {"a.mtx": _market, "b.mtx": lambda: _market(False), "c.mtx": lambda: _market(False, True)},
            mutations.lines,
            ("inspect matrix.toml",),
            _host("matrix.toml"),
        ),
        Kind(
            "harwell-boeing", {"a.hb": _harwell_boeing}, mutations.lines, ("inspect matrix.toml",), _host("matrix.toml")
        ),
        Kind("calculix", {"a.sti": _calculix}, mutations.lines, ("inspect matrix.toml",), _host("matrix.toml")),
        Kind("dmig", {"a.pch": _dmig}, mutations.lines, ("inspect matrix.toml",), _host("matrix.toml")),
        Kind(
            "op4",
            {"a.op4": _op4, "b.op4": _op4_binary},
            mutations.lines,
            ("inspect matrix.toml",),
            _host("matrix.toml"),
        ),
        Kind("op4 binary", {"b.op4": _op4_binary}, mutations.raw, ("inspect matrix.toml",), _host("matrix.toml")),
        Kind(
            "stl",
            {"a.stl": lambda: _stl(True)},
            mutations.lines,
            ("inspect outline.toml -o out.svg",),
            _host("outline.toml"),
        ),
        Kind(
            "stl binary",
            {"a.stl": lambda: _stl(False)},
            mutations.raw,
            ("inspect outline.toml -o out.svg",),
            _host("outline.toml"),
        ),
        Kind("fmu", {"a.fmu": _fmu}, mutations.archive, ("inspect {file}",)),
    )
}
