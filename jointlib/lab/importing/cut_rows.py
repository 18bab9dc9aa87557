"""Rows of a shop's table of cuts as the ``[[cut]]`` of a measurement file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jointlib.cuts.tried_cut import ON_A_LINE
from jointlib.errors import InputError
from jointlib.lab.importing.cut_table import NONE, Column, CutRow, CutTable, verdicts
from jointlib.lab.importing.cut_words import SPEEDS, mode_of, plain_word
from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.lab.unit_words import unit_of
from jointlib.units import quantity

_PER = {
    "minute": r"/ ?min|\bipm\b|\bvf\b|minute|rate|geschwindigkeit",
    "revolution": r"/ ?(rev|u|tr|r|giro)\b|\bipr\b|revolution|umdrehung|\btour\b",
    "tooth": r"/ ?(tooth|z|zahn|dent|flute|dente)\b|\bipt\b|\bfz\b|tooth|zahn|\bdent\b|chip",
}
_SHOWN = 4


@dataclass
class _Rows:
    """A table on its way into a draft; what is known of all its cuts goes before what it does not say."""

    draft: Draft
    table: CutTable
    shared: Mapping[str, Any]
    guessed: set[str] = field(default_factory=set)

    @property
    def turning(self) -> bool:
        return self.shared.get("process", "milling") in ("turning", "boring")

    def guess(self, said: str) -> None:
        if said not in self.guessed:
            self.guessed.add(said)
            self.draft.guesses.append(said)

    def column(self, key: str) -> Column:
        return self.table.columns[key]

    def length(self, key: str) -> str:
        """The unit of a column of lengths."""
        column = self.column(key)
        said = re.sub(r"/.*", "", column.unit).strip()
        if not said:
            self.guess(f"{column.heading!r} is in mm is a guess: the heading says no unit; write it as 'ap [mm]'")
            return "mm"
        unit = {"ipm": "inch", "ipr": "inch", "ipt": "inch"}.get(said.casefold()) or unit_of(said)
        if unit not in ("m", "mm", "um", "inch", "thou"):
            raise InputError(f"{self.table.path}: {column.heading!r} is in {said!r}, expected mm, um, in or thou")
        return unit

    def whole(self, row: CutRow, key: str) -> float | None:
        """A number of the row, or that of all rows in SI."""
        if key in row.numbers:
            return row.numbers[key]
        value = self.shared.get(key)
        return None if value is None else quantity(value, "1", f"--set cutting.{key}")

    def diameter(self, row: CutRow) -> float | None:
        """In m."""
        if "diameter" in row.numbers:
            text = f"{row.numbers['diameter']:.9g} {self.length('diameter')}"
            return quantity(text, "m", str(self.table.path))
        value = self.shared.get("diameter")
        return None if value is None else quantity(value, "m", "--set cutting.diameter")

    def cut(self, row: CutRow, verdict: str | None) -> Table:
        """One ``[[cut]]``."""
        unit, heading = self.column("speed").unit.casefold(), self.column("speed").heading
        if unit not in SPEEDS or (not unit and re.search(r"[\[(]", heading)):
            raise InputError(f"{self.table.path}: {heading!r}, expected a spindle speed in rpm, 1/min or Hz")
        out: Table = {}
        if name := row.words.get("name"):
            out["name"] = Noted(name if re.search(r"[^\W\d_]", name) else f"cut {name}")
        speed = row.numbers["speed"] * SPEEDS[unit]
        out["speed"] = Noted(speed)
        out["depth"] = Noted(f"{row.numbers['depth']:.9g} {self.length('depth')}")
        if "teeth" in row.numbers:
            out["teeth"] = Noted(row.numbers["teeth"])
        if "diameter" in row.numbers:
            out["diameter"] = Noted(f"{row.numbers['diameter']:.9g} {self.length('diameter')}")
        self._arc(row, out)
        if "feed" in row.numbers and (feed := self._feed(row, speed)) is not None:
            out["feed"] = Noted(f"{feed:.6g} {self.length('feed')}")
        if file := row.words.get("file"):
            out["file"] = Noted(file)
        if verdict is None and not file:
            verdict = "unknown"
        if verdict is not None:
            out["verdict"] = Noted(verdict)
        self._frequency(row, speed, verdict, out)
        return out

    def _arc(self, row: CutRow, out: Table) -> None:
        if word := row.words.get("mode"):
            mode = mode_of(word)
            if mode is None:
                raise InputError(
                    f"{self.table.path}: line {row.line}: {self.column('mode').heading!r} is {word!r}, expected down "
                    "(climb, Gleichlauf, avalant), up (conventional, Gegenlauf, opposition) or slot"
                )
            out["mode"] = Noted(mode)
        if "immersion" not in row.numbers:
            return
        column, value = self.column("immersion"), row.numbers["immersion"]
        word = plain_word(column.heading)
        if column.unit == "%":
            value /= 100
        elif column.unit or not re.search(r"immersion|/ ?d", word):
            diameter = self.diameter(row)
            if diameter is None:
                raise InputError(
                    f"{self.table.path}: {column.heading!r} is a width, expected the diameter of the cutter with it: "
                    "--set cutting.diameter='12 mm'"
                )
            value = quantity(f"{value:.9g} {self.length('immersion')}", "m", str(self.table.path)) / diameter
        out["immersion"] = Noted(float(f"{value:.6g}"))

    def _feed(self, row: CutRow, speed: float) -> float | None:
        """Per tooth, in turning per revolution, in the unit of the column."""
        column, value = self.column("feed"), row.numbers["feed"]
        text = f"{plain_word(column.heading)} {column.unit.casefold()}"
        per = next((word for word, pattern in _PER.items() if re.search(pattern, text)), None)
        if per is None:
            per = "revolution" if self.turning else "tooth"
            self.guess(f"{column.heading!r} is per {per} is a guess: neither heading nor unit tells it")
        if per == "minute":
            value, per = value / speed, "revolution"
        if self.turning or per == "tooth":
            return value
        teeth = self.whole(row, "teeth")
        return None if not teeth else value / teeth

    def _frequency(self, row: CutRow, speed: float, verdict: str | None, out: Table) -> None:
        f = row.numbers.get("chatter_frequency", 0.0)
        f *= 1000 if self.table.columns.get("chatter_frequency", Column(0, "", "")).unit.casefold() == "khz" else 1
        name = f"line {row.line}"
        if not f > 0:
            return
        if verdict in ("stable", "unknown"):
            self.draft.guesses.append(f"{name}: {f:g} Hz of a cut that is {verdict} is left out")
            return
        teeth = 1.0 if self.turning else self.whole(row, "teeth")
        order = f / (teeth * speed / 60) if teeth and speed > 0 else 0.5
        if round(order) >= 1 and abs(order - round(order)) < ON_A_LINE:
            told = f"harmonic {round(order)} of the teeth, at which a stable cut vibrates too, and is left out"
            self.draft.guesses.append(f"{name}: {f:g} Hz is {told}")
            return
        out["chatter_frequency"] = Noted(f"{f:g} Hz")


def fill_cuts(draft: Draft, table: CutTable, shared: Mapping[str, Any], said: Mapping[str, str], home: str) -> None:
    """Fill ``draft.cuts`` from a table.

    ``shared`` is what is known of all cuts, ``said`` the verdict that a word means, ``home`` the folder of the table
    seen from the measurement file.
    """
    rows = _Rows(draft, table, shared)
    used = table.rows
    if not rows.turning and "teeth" not in {*table.columns, *shared}:
        raise InputError(
            f"{table.path}: no column of teeth, expected --set cutting.teeth=4, or cutting.process=turning"
        )
    if "tool" not in table.columns and "tool" in shared:
        raise InputError(f"{table.path}: no column of tools, expected no cutting.tool")
    if "tool" in table.columns:
        used = _of_one_tool(table, shared.get("tool"))
    found = dict(zip((row.line for row in table.rows), verdicts(table, said), strict=True))
    lost = [row.line for row in used if not {"speed", "depth"} <= set(row.numbers)]
    if lost:
        draft.guesses.append(f"{_lines(lost)} without speed or depth: left out")
    for row in used:
        if row.line not in lost:
            cut = rows.cut(row, found[row.line])
            if "file" in cut:
                cut["file"] = Noted((Path(home) / str(cut["file"].value)).as_posix())
            draft.cuts.append(cut)
    silent = [row.line for row in used if found[row.line] is None and not row.words.get("file")]
    if silent:
        draft.guesses.append(f"{_lines(silent)} without a verdict: unknown, which tells nothing")
    if table.left_out:
        draft.guesses.append(f"columns left out: {', '.join(table.left_out)}")


def _of_one_tool(table: CutTable, wanted: Any) -> tuple[CutRow, ...]:
    """The rows of the tool that is asked for, or of the only one."""
    tools = list(dict.fromkeys(word for row in table.rows if (word := row.words["tool"]).casefold() not in NONE))
    if wanted is None and len(tools) > 1:
        shown = ", ".join(map(repr, tools[:_SHOWN]))
        raise InputError(f"{table.path}: cuts of {len(tools)} tools ({shown}), expected --set cutting.tool={tools[0]}")
    if wanted is not None and str(wanted) not in tools:
        raise InputError(f"--set cutting.tool: {str(wanted)!r}, expected one of {', '.join(map(repr, tools))}")
    return tuple(row for row in table.rows if wanted is None or row.words["tool"] == str(wanted))


def _lines(lines: Sequence[int]) -> str:
    shown = ", ".join(map(str, lines[:_SHOWN])) + (" …" if len(lines) > _SHOWN else "")
    return f"line{'s' * (len(lines) > 1)} {shown}"
