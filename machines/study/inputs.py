"""The files that a study stands on."""

from __future__ import annotations

import hashlib
from pathlib import Path

from jointlib.errors import InputError
from jointlib.io.atomic import sha256

from ..model.named_files import documents_and_data, named_files
from .study import BASE, Study


def inputs(study: Study) -> tuple[Path, ...]:
    """Every file that the configurations are made from."""
    bases = [study.base, *(study.source.parent / str(v) for f in study.factors if f.path == BASE for v in f.choices)]
    for base in bases:
        if not base.is_file():
            raise InputError(f"{base}: no such file, expected a machine file")
    found = {file for base in bases for file in documents_and_data(base)}
    choices = [list(f.choices) for f in study.factors if f.path != BASE]
    named = {file for folder in {file.parent for file in found} for file in named_files(choices, folder)}
    found |= {file for path in named for file in documents_and_data(path)}
    return tuple(sorted(found))


def inputs_hash(study: Study) -> str:
    """One hash of them all."""
    return hashlib.sha256("".join(sha256(file) for file in inputs(study)).encode()).hexdigest()
