"""Many tools at once: each has the limits that it has alone, to the last bit whoever stands beside it."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.errors import InputError
from machines.cutting.loops.regeneration import Loops, lowest_depth, trace
from machines.cutting.process.turning import minimum_depth_of_mode
from machines.cutting.rest.together import limits, peak_receptance, static_compliance
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel, ToolModels

SPEEDS = np.linspace(2000, 9000, 40)
TURNING = Cutting(process="turning", specific=1.5e9)


def tools(count: int, axes: tuple[str, ...], seed: int = 0) -> list[ToolModel]:
    """Tools of one to seven modes in random directions; some modes hardly show."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        m = int(rng.integers(1, 8))
        frequency, zeta = np.sort(rng.uniform(80, 900, m)), rng.uniform(0.005, 0.06, m)
        mass, shapes = rng.uniform(0.5, 30, m), rng.normal(size=(len(axes), m))
        found.append(ToolModel.from_modes(frequency, zeta, mass, shapes, axes))
    return found


def cuts(count: int, process: str) -> list[Cutting]:
    if process == "turning":
        return [Cutting(process="turning", specific=1e9 * (1 + i), feed_direction=0.1 * i) for i in range(count)]
    pressures = {"tangential": 6e8, "normal": 2e8}
    return [
        Cutting(process="milling", teeth=2 + i % 4, mode="down", immersion=0.2 + 0.7 * i / count, **pressures)
        for i in range(count)
    ]


@pytest.mark.parametrize(("process", "axes"), [("turning", ("x",)), ("milling", ("y",)), ("milling", ("x", "y"))])
def test_each_of_many_tools_has_the_limits_that_it_has_alone(process: str, axes: tuple[str, ...]) -> None:
    models = tools(30, axes)
    cuttings = cuts(30, process) if len(axes) == 2 or process == "milling" else [TURNING] * 30
    method = "turning" if process == "turning" else "zero-order"
    found = limits(models, cuttings, method, np.tile(SPEEDS, (30, 1)))
    for i, (model, cutting) in enumerate(zip(models, cuttings, strict=True)):
        chart = stability_lobes(model, cutting, SPEEDS, method)
        # Both close the same roots to 1e-13 of a wave, on sums over modes that are rounded in another order.
        np.testing.assert_allclose(found.depth[i], chart.depth, rtol=1e-9)
        assert found.minimum_depth[i] == pytest.approx(chart.minimum_depth, rel=1e-12)


@pytest.mark.parametrize("process", ["turning", "milling"])
def test_who_stands_beside_a_tool_changes_no_bit_of_its_limits(process: str) -> None:
    models, cuttings = tools(37, ("x", "y"), seed=3), cuts(37, process)
    method = "turning" if process == "turning" else "zero-order"
    speeds = np.linspace(1500, 9000, 37)[:, None] + np.linspace(0, 5000, 23)
    whole = limits(models, cuttings, method, speeds)
    sizes, compliance = peak_receptance(models), static_compliance(models)
    for part in (slice(0, 1), slice(1, 12), slice(12, 37)):
        alone = limits(models[part], cuttings[part], method, speeds[part])
        assert np.array_equal(alone.depth, whole.depth[part])
        assert np.array_equal(alone.minimum_depth, whole.minimum_depth[part])
        assert np.array_equal(peak_receptance(models[part]), sizes[part])
        assert np.array_equal(static_compliance(models[part]), compliance[part])


def test_single_modes_have_the_closed_forms_of_turning() -> None:
    frequency, zeta, mass = np.array([120.0, 333.0, 900.0]), np.array([0.003, 0.03, 0.2]), np.array([4.0, 1.0, 0.2])
    stiffness = mass * (2 * np.pi * frequency) ** 2
    models = [
        ToolModel.from_modes([f], [z], [m], [[1.0]], ("x",)) for f, z, m in zip(frequency, zeta, mass, strict=True)
    ]
    found = limits(models, [TURNING] * 3, "turning", np.zeros((3, 0)))
    expected = minimum_depth_of_mode(stiffness, zeta, TURNING.specific or 0.0)
    np.testing.assert_allclose(found.minimum_depth, expected, rtol=1e-12)
    assert found.depth.shape == (3, 0)
    np.testing.assert_allclose(static_compliance(models), 1 / stiffness, rtol=1e-12)
    peak = 1 / (2 * stiffness * zeta * np.sqrt(1 - zeta**2))
    np.testing.assert_allclose(peak_receptance(models), peak, rtol=1e-12)


def test_the_lowest_depth_is_that_of_a_dense_search() -> None:
    """−1/(2·min Re K_s·G) of the sum over modes itself, at lines a hundred thousandth of the resonance apart."""
    for model in tools(5, ("x",), seed=11):
        loops = Loops(ToolModels([model]), np.array([[[1e9]]]), model.lines, np.zeros(len(model.lines), dtype=np.intp))
        found = lowest_depth(loops, trace(loops))
        lines = found.frequency[0] * (1 + np.linspace(-0.2, 0.2, 40001))
        everywhere = np.concatenate([lines, np.linspace(model.lines[0], model.lines[-1], 200001)])
        depth = -0.5 / np.min((1e9 * model(everywhere)[:, 0, 0]).real)
        assert found.depth[0] == pytest.approx(depth, rel=1e-6)
        assert found.depth[0] <= depth * (1 + 1e-12)


def test_a_sum_over_modes_of_several_tools_is_that_of_each() -> None:
    models = tools(9, ("x", "y"), seed=5)
    several = ToolModels(models)
    frequency, tool = np.linspace(1, 2000, 9000), np.arange(9000) % 9
    found = several(frequency, tool)
    for i, model in enumerate(models):
        G = model(frequency[tool == i])
        scale = np.max(np.abs(G), axis=(1, 2), keepdims=True)
        assert np.all(np.abs(found[tool == i] - G) <= 1e-13 * scale)


def test_states_are_decomposed_together_as_one_by_one() -> None:
    rng = np.random.default_rng(2)
    natural, shapes = 2 * np.pi * np.array([50.0, 120.0, 300.0]), rng.normal(size=(3, 2))
    zero = np.zeros((3, 3))
    A = np.array([
        np.block([[zero, np.eye(3)], [-np.diag(natural**2 * scale), -np.diag(0.02 * natural)]])
        for scale in rng.uniform(0.5, 2.0, 6)
    ])  # fmt: skip
    B, C = np.concatenate([zero[:, :2], shapes]), np.concatenate([shapes.T, zero[:2]], axis=1)
    D = np.zeros((2, 2))
    for together, alone in zip(ToolModel.several(A, B, C, D, ("x", "y")), A, strict=True):
        one = ToolModel.from_states(alone, B, C, D, ("x", "y"))
        for key in ("poles", "inputs", "outputs", "direct"):
            assert np.array_equal(getattr(together, key), getattr(one, key))


def test_a_tool_that_does_not_stand_by_itself_is_refused_among_others() -> None:
    """A negative static stiffness: the same sentence as of that tool alone."""
    good = ToolModel.from_modes([100.0], [0.02], [1.0], [[1.0]], ("x",))
    soft = ToolModel(good.poles, -good.inputs, good.outputs, good.direct, good.axes)
    for refused in (
        lambda: stability_lobes(soft, TURNING, SPEEDS, "turning"),
        lambda: limits([good, soft, good], [TURNING] * 3, "turning", np.tile(SPEEDS, (3, 1))),
    ):
        with pytest.raises(InputError, match=r"tool point x: .*sign reversed|negative static stiffness"):
            refused()


def test_tools_that_never_chatter_have_no_limit() -> None:
    """A cut that pushes along one axis only what moves along the other."""
    across = Cutting(process="turning", specific=1e9, feed_direction=np.pi / 2)
    model = ToolModel.from_modes([100.0], [0.02], [1.0], [[1.0], [0.0]], ("x", "y"))
    other = ToolModel.from_modes([100.0], [0.02], [1.0], [[0.3], [1.0]], ("x", "y"))
    found = limits([model, other], [across] * 2, "turning", np.tile(SPEEDS, (2, 1)))
    # The rounding of cos 90° leaves the first an axis of 6e-17, and so a depth beyond any machine.
    assert found.minimum_depth[0] > 1e6 > found.minimum_depth[1]
    assert np.all(found.depth[0] > 1e6)
