"""The report: one file, nothing fetched, no text taken for markup, same bytes for same data."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from samples import KAPPA

from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous
from machines import linear_check, read_machine, response
from machines.report import Page, Section
from machines.report.joint_figures import gain, static_fit, surface
from machines.report.sections import check_section, parameter_table, response_section

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
GUIDE = Joint((HertzGuide(630.0, KAPPA), Viscous(503.0)), validity={"amplitude": (0.0, 4e-6)})


def page(*sections: Section) -> Page:
    return Page(
        title="A <machine> & its guide",
        finding="Found nothing <b>new</b>.",
        numbers=[("error", "1 %")],
        sections=sections,
        inputs=[("r<1>.csv", "00ff")],
        assumptions=["none"],
        warnings=["mind the <gap>"],
        command="jointlib run x.toml -o out",
        version="0",
    )


def sections() -> list[Section]:
    machine = read_machine(LIBRARY / "two_mass.toml")
    return [response_section(response(machine, [10.0, 80.0])), check_section(linear_check(machine))]


def test_a_report_needs_no_network_and_is_one_file() -> None:
    html = page(*sections()).html()
    links = re.findall(r"""(?:src|href)\s*=\s*["']([^"']+)""", html)
    assert links
    assert all(link.startswith("#") for link in links), [link for link in links if not link.startswith("#")]
    assert "@import" not in html
    assert "<script" not in html
    assert html.count("<svg") == 2


def test_text_is_never_markup() -> None:
    html = page().html()
    assert "A &lt;machine&gt; &amp; its guide" in html
    assert "mind the &lt;gap&gt;" in html
    assert "<b>new</b>" not in html


def test_the_same_data_give_the_same_bytes() -> None:
    assert page(*sections()).html() == page(*sections()).html()


def test_every_joint_picture_is_drawn() -> None:
    rng = np.random.default_rng(3)
    z = np.linspace(-6e-6, 6e-6, 80)
    load = GUIDE.force_along(z, 0 * z) + rng.normal(0, 10, 80)
    fit = static_fit(GUIDE, z, load, np.geomspace(200, 2000, 30), np.linspace(30, 10, 30), 630.0)
    v = rng.uniform(-0.1, 0.1, 80)
    drawn = [
        fit,
        surface(z, v, GUIDE.force_along(z, v), GUIDE, 6.5e8),
        gain({"a": GUIDE, "b": GUIDE}, abs(z[:20]), 500.0),
    ]
    assert all(f.svg.startswith("<svg") and f.svg.count("<path") > 10 for f in drawn)


def test_parameters_are_shown_in_the_units_people_read() -> None:
    rows = {row[0]: row for row in parameter_table(GUIDE, "").rows}
    assert rows["hertz_guide.contact_angle"][1:] == ("45", "not estimated", "°")
