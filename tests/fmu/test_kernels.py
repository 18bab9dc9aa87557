"""What holds for the C kernel of every law: the same mechanics as the law, in steps and under a solver."""

from __future__ import annotations

import dataclasses
import math
import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from kernel_library import SIGNATURES, Element, Point, compiled, kernel, words
from repeats import firsts, repeats
from samples import LAWS

from fmu.code import c_kernel
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.dahl import Dahl
from jointlib.laws.gap import Gap
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.tabulated import Tabulated
from jointlib.parameter import Role, parameters_of

LIMITS = (
    Stribeck(20.0, 30.0, 0.02),
    Stribeck(20.0, 20.0, 0.02, 0.0),
    Coulomb(0.0),
    Gap(6e8, 0.0),
    ContactLoss(3e8, 0.0, 1.0),
    ContactLoss(3e8, -1e-6, -1.0),
    Jenkins(4e7, 0.0),
    Jenkins(4e7, 0.0, 4e-7),
    Iwan((2e7,), (5.0,), 4e-7),
    Iwan((2e7, 1e7, 3e7), (0.0, 15.0, 1.0)),
    Dahl(4e7, 12.0, 9e-7),
    LuGre(4e7, 300.0, 36.0, 50.0, 0.02, 4e-7),
    LuGre(4e7, 0.0, 36.0, 36.0, 0.02, 1e-7),
    BoucWen(4e7, 12.0, 1.0, 0.0),
    BoucWen(4e7, 12.0, 1.0, 1.0, 3e-7),
    Tabulated((1e-6,), (6e8,), (500.0,)),
    Tabulated((4e-7, 1e-6), (-6e8, 5e8), (500.0, 0.0)),
)
SET = (*(law for law in LAWS if law.in_time), *LIMITS)


def name(law: JointLaw) -> str:
    """Short name for a test."""
    return f"{law.kind}-{SET.index(law)}"


every_law = pytest.mark.parametrize("law", SET, ids=name)
KINDS = firsts(SET, lambda law: law.kind)
"""One law of each kind; the others differ in their numbers."""


def some(laws: list[JointLaw], often: Callable[[JointLaw], bool] = lambda law: True) -> pytest.MarkDecorator:
    """Laws for what takes thousands of steps: a play and a slider always."""
    always = [law for law in KINDS if law.kind in ("gap", "jenkins")]
    return pytest.mark.parametrize("law", repeats(laws, always.__contains__, often), ids=name)


with_modes = some([law for law in SET if Element(law).modes], KINDS.__contains__)
one_of_each = some(list(SET), KINDS.__contains__)
passive_law = some([law for law in SET if law.passive], KINDS.__contains__)


def scattered(law: JointLaw, rng: np.random.Generator) -> JointLaw:
    """The law with other numbers, within their bounds."""
    joint, new = Joint((law,)), {}
    declared = {p.name: p for p in parameters_of(law)}
    for key, value in joint.parameters.items():
        p = declared[key.split(".")[1].split("[")[0]]
        if p.name == "side":
            continue
        if p.role is Role.CLEARANCE and law.states and rng.random() < 0.5:
            value = 3e-7
        new[key] = float(np.clip(value * np.exp(0.4 * rng.standard_normal()), p.lower, p.upper))
    static = next((key for key in new if key.endswith("static_force")), "")
    if static:
        new[static] = max(new[static], new[static.replace("static", "slip")])
    return joint.with_parameters(new).laws[0]


def rich_path(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement (m), velocity (m/s), step (s): rest, reversals, stick-slip, creep, jumps, steps without duration."""
    t = np.linspace(0, 14, 160)
    z = np.concatenate(
        [
            np.zeros(4),
            6e-6 * np.sin(t) * np.cos(0.3 * t),
            np.full(4, 2e-6),
            2e-6 + np.cumsum(rng.normal(0, 3e-8, 120)),
            rng.uniform(-8e-6, 8e-6, 60),
            np.repeat(rng.uniform(-3e-6, 3e-6, 20), 3),
            np.cumsum(rng.normal(0, 3e-7, 120)),
        ]
    )
    h = rng.choice([1e-5, 1e-4, 0.0], z.size, p=[0.6, 0.3, 0.1])
    followed = np.diff(z, prepend=0.0) / np.where(h > 0, h, 1e-5)
    v = np.where(rng.random(z.size) < 0.5, followed, rng.normal(0, 0.05, z.size) * (rng.random(z.size) < 0.9))
    return z, v, h


def test_every_python_kernel_has_a_c_kernel() -> None:
    folder = Path(c_kernel.__file__).parents[1] / "python_kernels"
    assert words() == sorted(file.stem for file in folder.glob("*.py"))
    assert {law.kind.replace("-", "_") for law in SET} == set(words())


@pytest.mark.thorough
def test_all_kernels_live_in_one_translation_unit() -> None:
    together = compiled(*words())
    assert all(hasattr(together, f"show_{word}_force") for word in words())


@pytest.mark.parametrize("word", words())
def test_a_kernel_defines_what_its_first_comment_declares(word: str) -> None:
    read = kernel(word)
    folder = Path(c_kernel.__file__).parents[1] / "python_kernels"
    python = runpy.run_path(str(folder / f"{word}.py"))
    wanted = {"force", "partials"}
    wanted |= {"initial", "step", "step_partials"} if read.states else set()
    wanted |= {"rates"} if any(state.continuous for state in read.states) else set()
    wanted |= {"initial", "event"} if read.modes != "0" else set()
    wanted |= {"indicators"} if read.indicators != "0" else set()
    wanted |= {"check"} if f"{word}_check" in python else set()
    assert {purpose for purpose in SIGNATURES if read.has(purpose)} == wanted
    assert {s.name.removesuffix("[i]"): s.unit for s in read.states} == python.get(f"{word}_state_units", {})
    assert read.exchange
    assert (read.modes == "0") == (read.indicators == "0")


@pytest.mark.parametrize("law", repeats(SET, KINDS.__contains__), ids=name)
def test_steps_follow_the_law_through_rest_reversal_stick_and_slip(law: JointLaw) -> None:
    rng = np.random.default_rng(11)
    for each in (law, *(scattered(law, rng) for _ in range(3))):
        element, joint = Element(each), Joint((each,))
        z, v, h = rich_path(rng)
        state, s = joint.initial_state(z[0]), element.start(z[0]).s
        force, expected, off = [], [], 0.0
        for i in range(z.size):
            f, state = joint.step(Motion(z[i], v[i], h[i]), state)
            g, s = element.stepped(s, z[i], v[i], h[i])
            expected.append(float(f))
            force.append(g)
            off = max(off, np.max(np.abs(s[: state.size] - state), initial=0.0))
        peak = np.max(np.abs(expected))
        assert force == pytest.approx(expected, rel=0, abs=1e-12 * peak)
        assert off <= 1e-12 * np.max(np.abs(z))


@pytest.mark.parametrize(
    ("law", "entry"),
    [(Stribeck(20.0, 30.0, 0.02), 1), (LuGre(4e7, 300.0, 36.0, 50.0, 0.02), 3), (ContactLoss(3e8, 1e-6, 1.0), 2)],
    ids=["stribeck", "lugre", "contact-loss"],
)
def test_parameters_that_void_the_law_are_named(law: JointLaw, entry: int) -> None:
    element = Element(law)
    assert element.call["check"]() is None
    element.p[entry] = 0.5
    told = element.call["check"]().decode()
    field = parameters_of(law)[entry].name
    assert field in told
    assert "expected" in told


def test_iwan_lists_of_different_length_are_refused() -> None:
    element = Element(Iwan((2e7, 1e7), (1.0, 2.0)))
    assert element.call["check"]() is None
    element.n[1] = 1
    assert "slip_force" in element.call["check"]().decode()


def somewhere(element: Element, rng: np.random.Generator) -> tuple[Point, float, float]:
    """A point that the element can reach, and the motion there: z in m, v in m/s."""
    z, v = rng.uniform(-6e-6, 6e-6), rng.uniform(0.002, 0.1) * rng.choice([-1, 1])
    point = element.start(0.0)
    for target in (rng.uniform(-6e-6, 6e-6), z - rng.uniform(-1.5e-6, 1.5e-6), z):
        # Fine steps: the wanted point does not lie where a step puts it exactly on the edge of slip.
        for at in np.linspace(point.s[0] if element.states else 0.0, target, 7)[1:]:
            point.s = element.stepped(point.s, float(at), v, 1e-4)[1]
    return element.settle(point, z, v), z, v


@every_law
def test_partials_are_the_differences_of_force_and_rates(law: JointLaw) -> None:
    element, rng = Element(law), np.random.default_rng(7)
    size = len(element.states)
    scale = np.array([1e-6, 0.02, *[1e-6] * size])
    kept = 0
    for _ in range(60):
        point, z, v = somewhere(element, rng)

        def answer(move: np.ndarray, point: Point = point, z: float = z, v: float = v) -> np.ndarray:
            moved = point.copy()
            for i in range(size):
                moved.s[i] += move[2 + i]
            return np.array(
                [element.pull(moved, z + move[0], v + move[1]), *element.rate(moved, z + move[0], v + move[1])]
            )

        given = np.vstack(element.slopes(point, z, v))
        assert given.shape == (1 + size, 2 + size)
        peak = np.abs(answer(np.zeros(2 + size))) + np.array([1.0, *[abs(v)] * size])
        for j in range(2 + size):
            found, wide = (
                (answer(step * scale * np.eye(2 + size)[j]) - answer(-step * scale * np.eye(2 + size)[j])) / (2 * step)
                for step in (1e-4, 2e-4)
            )
            # A kink of the law within the difference shows in a wider one.
            smooth = np.abs(found - wide) <= 1e-5 * (np.abs(found) + peak)
            kept += np.sum(smooth)
            # Truncation 1e-8 of the third derivative over the scale, rounding 1e-16/1e-4 of the values.
            close = np.abs(given[:, j] * scale[j] - found) <= 2e-5 * (np.abs(found) + peak)
            assert np.all(close[smooth])
    assert kept >= 0.8 * 60 * (1 + size) * (2 + size)


@every_law
def test_step_partials_are_the_differences_of_a_step_without_duration(law: JointLaw) -> None:
    element, rng, kept = Element(law), np.random.default_rng(8), 0
    for _ in range(60):
        point, z, v = somewhere(element, rng)
        z += 10 ** rng.uniform(-10, -5.7) * rng.choice([-1, 1])

        def answer(a: float, b: float, point: Point = point, z: float = z, v: float = v) -> float:
            return element.stepped(point.s, z + a * 1e-11, v + b * 2e-6, 0.0)[0]

        for j, given in enumerate(np.array(element.step_slopes(point.s, z, v)) * [1e-11, 2e-6]):
            near, wide = ((answer(n * (1 - j), n * j) - answer(-n * (1 - j), -n * j)) / (2 * n) for n in (1, 2))
            # Rounding of the force, and of z against a reach of a micrometre; a kink shows in the wider difference.
            noise = 1e-5 * abs(near) + 1e-13 * abs(answer(0, 0)) + 1e-15
            if abs(near - wide) <= noise:
                kept += 1
                assert abs(given - near) <= 2 * noise
    assert kept >= 0.9 * 120


@every_law
def test_tangent_at_rest_between_steps_is_that_of_the_motion_to_come(law: JointLaw) -> None:
    # A master asks for derivatives after a step, where the position has not moved on: there laws with memory bend.
    element, rng = Element(law), np.random.default_rng(9)
    for _ in range(40):
        point, z, v = somewhere(element, rng)
        point.s = element.stepped(point.s, z, v, 1e-4)[1]
        ahead = np.copysign(1e-10, v)
        # From half the travel on: a LuGre element behind play has no damper in a step that does not move at all.
        force = [element.stepped(point.s, z + x * ahead, v, 0.0)[0] for x in (1e-3, 1.001)]
        given = element.step_slopes(point.s, z, v)[0]
        size = abs(force[0]) + abs(given) * 1e-10
        assert given * ahead == pytest.approx(force[1] - force[0], rel=2e-3, abs=1e-12 * size)


def clear_of_play(law: JointLaw, s: np.ndarray, z: float) -> bool:
    """Whether no play ends, and no contact closes, within a nanometre."""
    if not law.states:
        return all(abs(z - kink) > 1e-9 for kink in law.kinks()[0])  # type: ignore[attr-defined]
    clearance = getattr(law, "clearance", 0.0)
    stretch = s[1:] if law.states[0] == "position" else z - s
    slips_first = np.asarray(getattr(law, "slip_force", 1.0)) == 0
    return clearance == 0 or bool(np.all((np.abs(np.abs(stretch) - clearance) > 1e-9) | slips_first))


@every_law
def test_force_under_a_solver_changes_as_the_tangent_of_the_law_says(law: JointLaw) -> None:
    element, rng, used = Element(law), np.random.default_rng(10), 0
    for _ in range(80):
        point, z, v = somewhere(element, rng)
        # A slider that sits at the edge of slip is past it, or holds, after a travel of 1 pm.
        ahead = float(np.copysign(1e-12, v)) if law.states else 0.0
        s = np.array(point.s[: len(element.states)])
        point = element.settle(point, z + ahead, v) if law.kind in ("jenkins", "iwan") else point
        if not clear_of_play(law, s, z):
            continue
        used += 1
        if law.states[:1] == ("position",):
            s[0] = z
        motion = Motion(np.array(z + ahead), np.array(v), 0.0)
        force = float(law.step(motion, s)[0])
        stiffness, damping = (float(x) for x in law.jacobian(motion, s))
        dF, rate = element.slopes(point, z + ahead, v)[0], element.rate(point, z + ahead, v)
        expected = stiffness * v
        if isinstance(law, Maxwell):
            expected -= law.stiffness * force / law.damping
        # After 1 pm a tangent of 40 N/um has changed by about 1e-5 of it, and the force by as much as the travel.
        rel, travel = (1e-5, 2e-12) if law.states else (1e-12, 0.0)
        assert dF[0] * v + dF[2:] @ rate == pytest.approx(expected, rel=rel, abs=rel * abs(v) * 4e7)
        assert dF[1] == pytest.approx(damping, rel=2e-5, abs=1e-9)
        assert element.pull(point, z + ahead, v) == pytest.approx(force, rel=rel, abs=travel * 4e7 + 1e-9)
    assert used >= 40


def smooth_path(t: float) -> tuple[float, float]:
    """A cycle of 10 ms with reversals of many sizes, z in m and v in m/s."""
    w, x = 2 * np.pi * 100, 2 * np.pi * 100 * t + 0.7
    z = 3e-6 * (math.sin(x) - math.sin(2 * x) / 2 + 0.6 * (math.cos(3 * x) - math.cos(5 * x)))
    v = 3e-6 * w * (math.cos(x) - math.cos(2 * x) - 1.8 * math.sin(3 * x) + 3 * math.sin(5 * x))
    return z, v


def advanced(element: Element, point: Point, t: float, h: float) -> Point:
    """The point after one Runge-Kutta step, the modes as they are."""
    if "rates" not in element.call:
        return point
    stages: list[np.ndarray] = []
    for part in (0.0, 0.5, 0.5, 1.0):
        moved = point.copy()
        for i in range(len(moved.s)):
            moved.s[i] += h * part * stages[-1][i] if stages else 0.0
        stages.append(element.rate(moved, *smooth_path(t + part * h)))
    after = point.copy()
    for i in range(len(after.s)):
        after.s[i] += h / 6 * (stages[0][i] + 2 * stages[1][i] + 2 * stages[2][i] + stages[3][i])
    return after


@dataclasses.dataclass
class Course:
    """What a solver saw along :func:`smooth_path`."""

    force: np.ndarray
    modes: list[tuple[int, ...]]
    events: list[tuple[Point, float]]
    """Each event: the point at the begin of its step, and the time then."""


def under_a_solver(element: Element, t: np.ndarray) -> Course:
    """Runge-Kutta steps; at the end of each the modes are settled if an indicator changed its sign."""
    h, (z, v) = t[1] - t[0], smooth_path(t[0])
    point = element.settle(element.start(z), z, v)
    before = element.seen(point, z, v) > 0
    course = Course(np.empty(t.size), [], [])
    for i in range(t.size):
        if i:
            z, v = smooth_path(t[i])
            start, point = point, advanced(element, point, t[i - 1], h)
            if np.any((element.seen(point, z, v) > 0) != before):
                course.events.append((start, t[i - 1]))
                point = element.settle(point, z, v)
            before = element.seen(point, z, v) > 0
        course.force[i] = element.pull(point, z, v)
        course.modes.append(tuple(point.m))
    return course


def in_steps(element: Element, t: np.ndarray) -> np.ndarray:
    """Force along :func:`smooth_path` in co-simulation."""
    s, force = element.start(smooth_path(t[0])[0]).s, []
    for i, at in enumerate(t):
        f, s = element.stepped(s, *smooth_path(at), t[i] - t[max(i - 1, 0)])
        force.append(f)
    return np.array(force)


FINE = np.linspace(0.0, 0.02, 8001)


@one_of_each
def test_solver_and_steps_come_together_as_both_become_finer(law: JointLaw) -> None:
    element = Element(law)
    fine = np.linspace(FINE[0], FINE[-1], 16001)
    expected = in_steps(element, fine)
    peak = np.max(np.abs(expected)) or 1.0
    coarse, close = (
        np.mean(np.abs(under_a_solver(element, fine[::stride]).force - expected[::stride])) / peak for stride in (16, 4)
    )
    # Left over: the hysteresis of the indicators, 1e-6 of the edge, and the fine steps themselves.
    assert close <= max(0.4 * coarse, 3e-6)
    assert close <= 2e-3


@passive_law
def test_no_cycle_yields_energy_in_steps_or_under_a_solver(law: JointLaw) -> None:
    element, t = Element(law), FINE
    z = np.array([smooth_path(at)[0] for at in t])
    cycle = slice(t.size // 2, None)
    work = []
    for force in (in_steps(element, t), under_a_solver(element, t).force):
        work.append(np.sum((force[cycle][1:] + force[cycle][:-1]) / 2 * np.diff(z[cycle])))
    stored = np.max(np.abs(force)) * np.max(np.abs(z))
    # The trapezoid rule errs by stiffness·Δz²/8 at each kink, and Δz is up to 30 nm.
    assert min(work) >= -1e-4 * stored
    assert work[1] == pytest.approx(work[0], rel=5e-3, abs=1e-4 * stored)


@with_modes
def test_every_slip_reversal_and_lift_off_of_the_law_is_an_event(law: JointLaw) -> None:
    element, joint, t = Element(law), Joint((law,)), FINE[::2]
    modes = under_a_solver(element, t).modes
    state, expected = joint.initial_state(smooth_path(0.0)[0]), []
    for at in t:
        z, v = smooth_path(at)
        before, (_, state) = state, joint.step(Motion(np.array(z), np.array(v), t[1]), state)
        expected.append(modes_of(law, before, state, z, v))
    changes = [i for i in range(1, t.size) if expected[i] != expected[i - 1]]
    near = np.zeros(t.size, dtype=bool)
    for i in (0, *changes):
        near[max(i - 2, 0) : i + 3] = True
    assert np.mean(near) < 0.15
    # A change is seen at the end of its step, later by the hysteresis; in between the modes are those of the law.
    assert not np.any(np.array([m != e for m, e in zip(modes, expected, strict=True)]) & ~near)


def modes_of(law: JointLaw, before: np.ndarray, after: np.ndarray, z: float, v: float) -> tuple[int, ...]:
    """The modes that the law's own states show after a step."""
    clearance = float(getattr(law, "clearance", 0.0))

    def side(x: float) -> int:
        return int(x > clearance) - int(x < -clearance)

    if isinstance(law, Gap):
        return (side(z),)
    if isinstance(law, Tabulated):
        return (int(np.sign(z)) * int(np.searchsorted(law.onset[1:], abs(z), "right")),)
    if isinstance(law, ContactLoss):
        return (int(law.side * z > clearance),)
    if isinstance(law, Coulomb | Stribeck):
        return (int(np.sign(smooth_path(0.0)[1] if law.smoothing_velocity else v)),)
    if law.states[0] == "position":
        return (side(after[1]) if clearance else 0,)
    slips = np.where(np.abs(after - before) > 1e-14, 2 * np.sign(after - before), 0).astype(int)
    return tuple(int(slip) or (side(z - s) if clearance else 0) for slip, s in zip(slips, after, strict=True))


def test_a_play_without_width_never_pulls() -> None:
    element = Element(Gap(6e8, 0.0))
    for first in (0.0, 1e-6, -1e-6):
        point = element.settle(element.start(first), first, 0.0)
        assert [element.pull(point, z, 0.0) for z in (-2e-6, 0.0, 2e-6)] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("law", [Coulomb(20.0), Stribeck(20.0, 30.0, 0.02)], ids=["coulomb", "stribeck"])
def test_friction_without_smoothing_keeps_its_sign_at_rest_until_it_slides_back(law: JointLaw) -> None:
    element = Element(law)
    point = element.settle(element.start(0.0), 0.0, 0.0)
    assert element.pull(point, 0.0, 0.0) == 0.0
    point = element.settle(point, 0.0, 0.01)
    assert element.pull(point, 0.0, 0.0) > 0.0
    point = element.settle(point, 0.0, 0.0)
    assert element.pull(point, 0.0, 0.0) > 0.0
    assert element.pull(element.settle(point, 0.0, -0.01), 0.0, 0.0) < 0.0


@with_modes
def test_a_root_found_to_the_last_bit_settles_from_either_side(law: JointLaw) -> None:
    # A client stops at a root of an indicator, where it is about zero: the modes must change there and stay.
    element, t = Element(law), FINE[::2]
    course = under_a_solver(element, t)
    for start, begin in course.events:
        before = element.seen(start, *smooth_path(begin)) > 0
        low, high = 0.0, t[1]
        while np.nextafter(low, high) != high and high - low > 1e-15:
            middle = (low + high) / 2
            seen = element.seen(advanced(element, start, begin, middle), *smooth_path(begin + middle))
            low, high = (low, middle) if np.any((seen > 0) != before) else (middle, high)
        for h in (low, high):
            point, (z, v) = advanced(element, start, begin, h), smooth_path(begin + h)
            settled = element.settle(point, z, v)
            assert list(settled.m) != list(start.m)
            assert list(element.settle(settled, z, v).m) == list(settled.m)
            if law.kind not in ("coulomb", "stribeck", "lugre"):
                # Only friction that turns round, and a damper that meets its play, jump.
                change = element.pull(settled, z, v) - element.pull(point, z, v)
                assert abs(change) <= 1e-5 * (np.max(np.abs(course.force)) + 1.0)
