"""Damage done to files and command lines with an eye for how they are built: keys, numbers, headers, members."""

from __future__ import annotations

import contextlib
import io
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable

Mutator = Callable[[random.Random, bytes], bytes]

NUMBERS = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "1e-6",
    "1e-300",
    "1e300",
    "1e308",
    "1e400",
    "-1e400",
    "NaN",
    "-nan",
    "inf",
    "-inf",
    "2147483647",
    "2147483648",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "1e6",
    "1e9",
    "999999999999",
    "0.1",
    "-0.5",
    "1_000",
    "0x10",
    "1e",
    "1e-",
    "--1",
    "+1",
    "²",
    "٣",
    "1.5D+03",
    "1,5",
    "0.10000000000000002",
    "1e75",
    "1e76",
    "5e-5",
    "64",
    "65536",
]
"""What stands in for a number in a text."""
UNITS = (
    *(f"1 {unit}" for unit in ("m)", "(m", "m**", "m^9999", "m/0", "N//m", "²", "m²²", "kg*s", "°", "%", "Hz", "um")),
    *(f"5 {unit}" for unit in ("mm", "m" * 500, "rpm", "degC", "delta_degC", "e", "1", "m.m", "m\\n", "lambda", "µ")),
    "1e400 N",
    "1 1 N",
    "NaN N",
    "-3 kg",
    "1e-400 m",
    "0 N",
    "1e-90 N",
    "1e40 N/m",
    "1 N/m " * 400,
)
WORDS = (
    "",
    " ",
    "x" * 4000,
    "a\\nb",
    "\\u0000",
    "\\u001b[31m",
    "../../../etc/passwd",
    "/dev/zero",
    "/proc/self/mem",
    ".",
    "..",
    "~",
    "ground",
    "unknown",
    "<script>alert(1)</script>",
    "${HOME}",
    "{0.__class__}",
    "%s%n",
    "NaN",
    "true",
    "jointlib/joint/1",
    "x.csv",
    "data.npz",
    "\\u202e",
    "e\\u0301",
    "'",
    "a.b.c",
)
TOML = (
    *("true", "false", "[]", "[[]]", "{}", "[{}]", "[1, 2]", "[[1, 2], [3]]", '["a", 1]', '""', '"x"', "1e400", "nan"),
    *("inf", "-inf", "-1", "0", "1e40", "1e6", "9223372036854775808", "1979-05-27T07:32:00Z", "07:32:00", "0x7f"),
    *("1" + "0" * 400, "5e-5", "0.10000000000000002", "[[[[[[[[1]]]]]]]]", "{a={b={c=1}}}", "[nan]", "[1e300, -1e300]"),
)
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
_STRING = re.compile(rb'"[^"\n]*"')
_VALUE = re.compile(rb"=\s*([^\n#]+)")
_INTEGERS = (0, 1, 2, -1, 127, 128, 255, 256, 32767, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1, 2**24, 1000)


def raw(rng: random.Random, data: bytes) -> bytes:
    """Bytes flipped, cut, doubled, moved; integers of all widths overwritten."""
    out = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        if not out:
            return bytes(out)
        # Headers are short and matter more than samples.
        reach = len(out) if rng.random() < 0.5 else min(len(out), 600)
        at = rng.randrange(reach)
        what = rng.randrange(8)
        if what == 0:
            out[at] ^= 1 << rng.randrange(8)
        elif what == 1:
            out[at] = rng.randrange(256)
        elif what == 2:
            del out[at:]
        elif what == 3:
            del out[at : at + rng.choice([1, 2, 4, 8, 64])]
        elif what == 4:
            out[at:at] = bytes(rng.randrange(256) for _ in range(rng.choice([1, 4, 8])))
        elif what == 5:
            other, length = rng.randrange(len(out)), rng.choice([4, 8, 64, 512])
            out[at : at + length] = out[other : other + length]
        else:
            width, order = rng.choice("bhiq"), rng.choice("<>")
            size, number = struct.calcsize(width), rng.choice(_INTEGERS)
            at -= at % min(size, 4)
            value = number & ((1 << 8 * size) - 1)
            out[at : at + size] = value.to_bytes(size, "little" if order == "<" else "big")
    return bytes(out)


def lines(rng: random.Random, data: bytes) -> bytes:
    """Lines left out, doubled, exchanged, joined; numbers in them replaced; now and then bytes."""
    if rng.random() < 0.15:
        return raw(rng, data)
    for _ in range(rng.choice([1, 1, 2, 3])):
        rows = data.split(b"\n")
        head = rng.randrange(min(len(rows), 12)) if rng.random() < 0.5 else rng.randrange(len(rows))
        what = rng.randrange(9)
        if what == 0:
            del rows[head]
        elif what == 1:
            rows.insert(head, rows[rng.randrange(len(rows))])
        elif what == 2:
            other = rng.randrange(len(rows))
            rows[head], rows[other] = rows[other], rows[head]
        elif what == 3:
            rows[head - 1] += rows.pop() if head < len(rows) - 1 else b""
        elif what == 4:
            cells = rows[head].split(rng.choice([b",", b" ", b";", b"\t"]))
            rng.shuffle(cells)
            rows[head] = b",".join(cells)
        elif what == 5:
            rows[head] = rng.choice(WORDS).encode() + rows[head]
        else:
            rows[head] = _replaced(rng, rows[head], _NUMBER, rng.choice(NUMBERS).encode())
        data = b"\n".join(rows)
    return data


def _replaced(rng: random.Random, text: bytes, pattern: re.Pattern[bytes], new: bytes) -> bytes:
    found = list(pattern.finditer(text))
    if not found:
        return text + new
    match = rng.choice(found)
    return text[: match.start()] + new + text[match.end() :]


def toml(rng: random.Random, data: bytes) -> bytes:
    """Values replaced by others of the wrong kind, size, unit or letters; keys and tables left out or doubled."""
    if rng.random() < 0.1:
        return lines(rng, data)
    for _ in range(rng.choice([1, 1, 1, 2])):
        what = rng.randrange(10)
        if what <= 2:
            data = _replaced(rng, data, _NUMBER, rng.choice(NUMBERS).encode())
        elif what == 3:
            data = _replaced(rng, data, _NUMBER, f'"{rng.choice(UNITS)}"'.encode())
        elif what == 4:
            data = _replaced(rng, data, _STRING, f'"{rng.choice(WORDS + UNITS)}"'.encode())
        elif what <= 6:
            match = rng.choice(list(_VALUE.finditer(data)) or [None])
            if match is not None:
                data = data[: match.start(1)] + rng.choice(TOML).encode() + data[match.end(1) :]
        elif what == 7:
            strings = _STRING.findall(data) or [b'""']
            data = _replaced(rng, data, _STRING, rng.choice(strings))
        elif what == 8:
            rows = data.split(b"\n")
            rows[rng.randrange(len(rows))] = rng.choice(rows)
            data = b"\n".join(rows)
        else:
            rows = data.split(b"\n")
            del rows[rng.randrange(len(rows))]
            data = b"\n".join(rows)
    return data


def archive(rng: random.Random, data: bytes) -> bytes:
    """A zip archive with a damaged member under a right checksum, or damaged itself."""
    if rng.random() < 0.3:
        return raw(rng, data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as held:
            members = [(info.filename, held.read(info)) for info in held.infolist()]
    except Exception:  # it is damaged already
        members = []
    if not members:
        return raw(rng, data)
    at = rng.randrange(len(members))
    name, inside = members[at]
    what = rng.randrange(8)
    if what <= 3 and name.endswith(".npy"):
        members[at] = name, _npy(rng, inside)
    elif what == 4:
        del members[at]
    elif what == 5:
        members.append((rng.choice([name, *WORDS]), inside))
    elif what == 6:
        members[at] = rng.choice(WORDS).encode().decode("unicode_escape") + ".npy", inside
    else:
        members[at] = name, (lines if name.endswith(".xml") else raw)(rng, inside)
    out = io.BytesIO()
    import warnings

    with warnings.catch_warnings(), zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        warnings.simplefilter("ignore")
        for name, inside in members:
            made.writestr(name.split("\0")[0] or "_", inside)
    return out.getvalue()


def _npy(rng: random.Random, data: bytes) -> bytes:
    """The header of an array says another type, order or shape."""
    end = 10 + int.from_bytes(data[8:10], "little")
    head = data[10:end].decode("latin-1")
    what = rng.randrange(5)
    if what == 0:
        head = re.sub(r"'descr': '[^']*'", f"'descr': {rng.choice(_DESCRIPTIONS)}", head)
    elif what == 1:
        shape = rng.choice(["(1000000000000,)", "()", "(-1,)", "(2, 2)", "(0,)", "(1.5,)", "None", "(2147483648, 2)"])
        head = re.sub(r"'shape': \([^)]*\)", f"'shape': {shape}", head)
    elif what == 2:
        head = rng.choice(["{", "", "(", "{'descr': '<f8'}", "[" * 100, "{'a': 1}", "'x", "lambda: 0", head + "\\"])
    elif what == 3:
        values = rng.choice([b"\x00\x00\x00\x00\x00\x00\xf0\x7f", b"\xff" * 8, b"\x00\x00\x00\x00\x00\x00\xf0\xff"])
        at = end + 8 * rng.randrange(max(1, (len(data) - end) // 8))
        return data[:at] + values + data[at + 8 :]
    else:
        return raw(rng, data)
    text = head.encode("latin-1").rstrip(b"\n") + b"\n"
    return data[:8] + len(text).to_bytes(2, "little") + text + data[end:]


_DESCRIPTIONS = (
    "'<f4'",
    "'>f8'",
    "'<i8'",
    "'<c16'",
    "'|O'",
    "'<U5'",
    "'<m8'",
    "'V8'",
    "'zz'",
    "5",
    "[('a', '<f8')]",
    "'|b1'",
)


def matlab(rng: random.Random, data: bytes) -> bytes:
    """A MATLAB 5 file whose compressed elements are damaged inside; others as bytes."""
    if rng.random() < 0.5:
        return raw(rng, data)
    out, at = bytearray(data[:128]), 128
    while at + 8 <= len(data):
        kind, size = struct.unpack_from("<II", data, at)
        inside = data[at + 8 : at + 8 + size]
        if kind == 15 and rng.random() < 0.7:
            with contextlib.suppress(zlib.error):  # where it is damaged already
                inside = zlib.compress(raw(rng, zlib.decompress(inside)))
        out += struct.pack("<II", kind, len(inside)) + inside
        at += 8 + size
    return bytes(out) if len(out) > 128 and bytes(out) != data else raw(rng, data)


def words(rng: random.Random, line: list[str]) -> list[str]:
    """A command line with words left out, doubled, exchanged, or their numbers replaced."""
    line = list(line)
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = rng.randrange(len(line))
        what = rng.randrange(8)
        if what == 0 and len(line) > 1:
            del line[at]
        elif what == 1:
            line.insert(at, rng.choice(line))
        elif what == 2:
            line[at] = _decoded(rng.choice(WORDS))
        elif what == 3:
            line[at] = _decoded(rng.choice(UNITS)).replace(" ", "")
        else:
            new = rng.choice([*NUMBERS, *UNITS])
            line[at] = _replaced(rng, line[at].encode(), _NUMBER, new.encode()).decode()
    return [word.replace("\0", "\\0") for word in line]


def _decoded(word: str) -> str:
    return word.replace("\\n", "\n").replace("\\u0000", "\\0").replace("\\u001b", "\x1b").replace("\\u202e", "\u202e")
