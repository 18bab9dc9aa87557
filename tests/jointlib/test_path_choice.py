"""Which effects of a composition are believed: sizes that are told from nothing, refits that do not run away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prepared import prepared

from jointlib.effects.coulomb import CoulombFriction
from jointlib.effects.cubic import CubicStiffness
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.path.columns import ColumnStore, law_forces
from jointlib.loop.path.composed.choice import as_left_out, stands
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, fit
from jointlib.loop.path.repeats import repeat_floor
from jointlib.loop.path.steps import Composition, Row, Step, Term, deciding_excess, rank
from jointlib.loop.path.strokes import divide

RATE, TONES = 400.0, ((2.0, 0.05), (4.0, 0.08), (8.0, 0.12))


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    """A spring and a damper on records of both with dry friction of 30 N, three tones (Hz, m/s)."""
    folder, rng = tmp_path_factory.mktemp("tones"), np.random.default_rng(5)
    lines = f'schema = "jointlib/measurement/1"\nkind = "path"\ncarriage = "2 kg"\nsample_rate = {RATE}\n'
    lines += '[[channel]]\nname = "z"\nquantity = "displacement"\nunit = "m"\n'
    lines += '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\n'
    t = np.arange(round(4 * RATE)) / RATE
    for tone, speed in TONES:
        w = 2 * np.pi * tone
        z, v = speed / w * np.sin(w * t), speed * np.cos(w * t)
        force = (2e4 - 2 * w**2) * z + 200 * v + 30 * v / np.hypot(v, 2e-3) + rng.standard_normal(len(t))
        np.savez(folder / f"{tone:g}.npz", z=z, F=force)
        lines += f'[[record]]\nfile = "{tone:g}.npz"\n'
    (folder / "tones.measurement.toml").write_text(lines)
    runs = tuple(prepared(folder / "tones.measurement.toml"))
    division = divide(runs)
    evidence = Evidence(runs, None, division, repeat_floor(runs, division), law_forces(runs))
    return fit(evidence, Model(Joint((Linear(1e4), Viscous(100.0)))))


@pytest.fixture(scope="module")
def rows(start: Fitted) -> tuple[Row, ...]:
    effects = (CoulombFriction(), CubicStiffness())
    return rank(start, effects, ColumnStore(start.evidence.recorded), 0)


def composed(start: Fitted, rows: tuple[Row, ...]) -> Composition:
    """Friction, and a cubic spring that is not there."""
    friction, cubic = sorted(rows, key=lambda row: row.entry.family)
    assert friction.entry.best.model is not None
    joint = CubicStiffness().apply(np.array([1e3]), cubic.entry.best.shape, friction.entry.best.model.joint)
    assert joint is not None
    terms = tuple(Term(r.entry.effect, r.entry.best, r.assessment) for r in (friction, cubic))
    return Composition((Step(None, start), Step(terms[1], fit(start.evidence, Model(joint)))), terms)


def test_a_size_within_its_own_error_of_nothing_is_no_effect_of_a_composition(
    start: Fitted, rows: tuple[Row, ...]
) -> None:
    both = composed(start, rows)
    assert [stands(both, term) for term in both.terms] == [True, False]


def test_a_size_that_does_nothing_is_no_effect_of_a_composition(start: Fitted, rows: tuple[Row, ...]) -> None:
    """A slip of 1e-16 N/m, which has no error, stood beside friction that falls with speed."""
    both = composed(start, rows)
    names = tuple(n for n in both.fitted.names if not n.startswith("coulomb."))
    idle = replace(both, steps=(*both.steps[:-1], replace(both.steps[-1], fitted=replace(both.fitted, names=names))))
    assert [stands(both, both.terms[0]), stands(idle, both.terms[0])] == [True, False]


def test_a_refit_that_runs_away_where_a_level_is_left_out_is_judged_by_the_contest(
    start: Fitted, rows: tuple[Row, ...]
) -> None:
    entry = next(row.entry for row in rows if row.entry.family == "coulomb")
    assert entry.best.model is not None
    refitted = fit(start.evidence, entry.best.model)
    assert refitted.condition_loss is not None
    assert as_left_out(refitted, entry) is refitted
    away = replace(refitted, condition_loss=100 * refitted.condition_loss)
    assert deciding_excess(as_left_out(away, entry)) == pytest.approx(
        deciding_excess(replace(away, condition_loss=entry.deciding_loss))
    )
    assert deciding_excess(as_left_out(away, entry)) < 0.5 * deciding_excess(away)
