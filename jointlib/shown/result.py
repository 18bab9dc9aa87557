"""The face of a result: a sentence where it is printed, a table in notebooks, a frame and a picture on demand."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, TypeAlias

import numpy as np

from jointlib.errors import InputError

Columns: TypeAlias = Mapping[str, tuple[Sequence[Any] | np.ndarray[Any, Any], str]]
"""Values of one length with their unit, by name; the unit is empty where there is none."""
_ROWS, _WIDTH = 12, 10
"""Rows and columns of a table in a notebook."""
_STYLE = "border-collapse:collapse;font-size:90%"


class Shown(ABC):
    """A result that says its finding; values are in SI, frequencies in Hz and speeds in rpm."""

    @abstractmethod
    def finding(self) -> str:
        """What was found, in a sentence or two."""

    @abstractmethod
    def columns(self) -> Columns:
        """The table of the result."""

    @abstractmethod
    def plot(self, ax: Any = None) -> Any:
        """Draw it on matplotlib Axes, new ones where none are given, and return them; ``.figure`` is their figure."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {self.finding()}"

    def to_dataframe(self) -> Any:
        """The table as a pandas DataFrame; ``attrs["units"]`` holds the unit of every column that has one."""
        columns = self.columns()
        frame = package("pandas", "to_dataframe").DataFrame({name: values for name, (values, _) in columns.items()})
        frame.attrs["units"] = {name: unit for name, (_, unit) in columns.items() if unit}
        return frame

    def _repr_html_(self) -> str:
        """The finding over the first rows and columns of the table."""
        every = self.columns()
        columns = dict(list(every.items())[:_WIDTH])
        heads = "".join(f"<th>{escape(n)}{f' [{escape(u)}]' if u else ''}</th>" for n, (_, u) in columns.items())
        rows = list(zip(*(values[:_ROWS] for values, _ in columns.values()), strict=True))
        body = "".join("<tr>" + "".join(f"<td>{escape(_word(v))}</td>" for v in row) + "</tr>" for row in rows)
        count = len(next((values for values, _ in columns.values()), ()))
        left = {"rows": count - _ROWS, "columns": len(every) - _WIDTH}
        more = "".join(f"<p>{number} more {what}</p>" for what, number in left.items() if number > 0)
        table = f'<table style="{_STYLE}"><tr>{heads}</tr>{body}</table>{more}' if rows else ""
        return f"<div><p><b>{escape(type(self).__name__)}</b>: {escape(self.finding())}</p>{table}</div>"


def package(name: str, asked: str) -> Any:
    """A package of the extra ``tables``, imported when it is asked for."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise InputError(f"{asked}: {name} is not installed, expected pip install 'jointlib[tables]'") from None


def _word(value: Any) -> str:
    if isinstance(value, complex | np.complexfloating):
        return f"{value:.4g}"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)
