"""Finite elements of a Timoshenko beam: hierarchic polynomials, exact in statics."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import Legendre, leggauss

from jointlib.arrays import Array
from jointlib.errors import InputError

from .profile import Material, Profile

FIELDS = 6
"""Translations u1, u2, u3 and rotations ϑ1, ϑ2, ϑ3 in the axes of the beam."""
DEGREE = 6
"""Polynomial degree: an element half a wavelength long has a relative frequency error of about 1e-7."""

MOST_ELEMENTS = 80
"""Of one beam; they are put together in full matrices."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Matrices in the axes of the beam; the first dofs are u1, u2, u3, ϑ1, ϑ2, ϑ3 of every vertex in turn.

    ``stiffness`` has a matrix per material, in the order of their first use.
    """

    vertices: Array
    """Distance along the beam in m."""
    mass: Array
    stiffness: tuple[Array, ...]
    materials: tuple[Material, ...]
    gyroscopic: Array
    """Skew; times the angular velocity about the axis in rad/s it is the damping of a beam that turns."""


def beam_mesh(
    ends: Array, profiles: list[Profile], materials: list[Material], held: Array, up_to: float, degree: int = DEGREE
) -> Mesh:
    """Mesh of segments that end at ``ends`` (m, from 0), with a vertex at each of the ``held`` distances.

    Pieces are divided until no element is longer than half of the shortest wave at ``up_to`` (Hz).
    """
    corners = np.unique(np.concatenate([[0.0], ends, held]))
    corners = corners[np.concatenate([[True], np.diff(corners) > 1e-9 * ends[-1]])]
    vertices = [0.0]
    owner: list[int] = []
    for left, right in itertools.pairwise(corners):
        segment = int(np.searchsorted(ends, (left + right) / 2))
        k = shortest_wave(profiles[segment], materials[segment], 2 * np.pi * up_to)
        count = k * (right - left) / np.pi
        if not len(vertices) + count <= MOST_ELEMENTS:
            of, profile = materials[segment], profiles[segment]
            high, wide = (np.sqrt(12 * second / profile.area) * 1e3 for second in (profile.second_3, profile.second_2))
            raise InputError(
                f"a piece of {right - left:g} m is {count:.3g} half waves long at {up_to:g} Hz, which makes more than "
                f"{MOST_ELEMENTS} elements in a beam: lower up_to, or is a unit wrong? {of.name!r} has young "
                f"{of.young * 1e-9:.4g} GPa, density {of.density:.4g} kg/m^3; the section bends as {high:.3g} x "
                f"{wide:.3g} mm"
            )
        pieces = max(1, int(np.ceil(count)))
        vertices += list(np.linspace(left, right, pieces + 1)[1:])
        owner += [segment] * pieces
    used = list(dict.fromkeys(materials[s] for s in owner))
    inside = degree - 1
    size = FIELDS * (len(vertices) + inside * len(owner))
    mass, gyroscopic = np.zeros((size, size)), np.zeros((size, size))
    stiffness = tuple(np.zeros((size, size)) for _ in used)
    for e, segment in enumerate(owner):
        own = np.arange(FIELDS)
        bubbles = FIELDS * (len(vertices) + inside * e) + np.arange(FIELDS * inside)
        at = np.concatenate([FIELDS * e + own, FIELDS * (e + 1) + own, bubbles])
        length = vertices[e + 1] - vertices[e]
        M, K = element(profiles[segment], materials[segment], length, degree)
        mass[np.ix_(at, at)] += M
        gyroscopic[np.ix_(at, at)] += gyroscopic_pairs(profiles[segment], materials[segment], length, degree)
        stiffness[used.index(materials[segment])][np.ix_(at, at)] += K
    return Mesh(np.array(vertices), mass, stiffness, tuple(used), gyroscopic)


def element(profile: Profile, material: Material, length: float, degree: int = DEGREE) -> tuple[Array, Array]:
    """Mass and stiffness of one element, by Gauss quadrature, which is exact here.

    Every field is a polynomial of the same degree: two linear end functions and integrated Legendre polynomials
    inside. From degree 3 on they contain the cubic deflection and quadratic rotation of an end-loaded beam, so that
    statics are exact and nothing locks. Strains: u1', u2' − ϑ3, u3' + ϑ2, ϑ1', ϑ2', ϑ3'.
    """
    points, weights = leggauss(degree + 1)
    functions = _functions(degree)
    N = np.array([f(points) for f in functions]).T
    slope = np.array([f.deriv()(points) for f in functions]).T * 2 / length
    E, G, A = material.young, material.shear, profile.area
    modulus = np.array(
        [
            E * A,
            G * A * profile.shear_2,
            G * A * profile.shear_3,
            G * profile.torsion,
            E * profile.second_2,
            E * profile.second_3,
        ]
    )
    inertia = material.density * np.array(
        [A, A, A, profile.second_2 + profile.second_3, profile.second_2, profile.second_3]
    )
    own = np.eye(FIELDS)
    shear = np.zeros((FIELDS, FIELDS))
    shear[1, 5], shear[2, 4] = -1.0, 1.0
    size = FIELDS * (degree + 1)
    M, K = np.zeros((size, size)), np.zeros((size, size))
    for value, derivative, weight in zip(N, slope, weights * length / 2, strict=True):
        motion = np.kron(value, own)
        strain = np.kron(derivative, own) + np.kron(value, shear)
        M += weight * motion.T @ (inertia[:, None] * motion)
        K += weight * strain.T @ (modulus[:, None] * strain)
    return M, K


def gyroscopic_pairs(profile: Profile, material: Material, length: float, degree: int = DEGREE) -> Array:
    """∫ ρ(I2 + I3) Nᵀ J N dx of an element turning with 1 rad/s about its axis; J couples ϑ̇3 into the moment about 2.

    The axis leans by (ϑ3, −ϑ2), and with it the spin ρ(I2 + I3)Ω per length, whose change takes the moments
    ρ(I2 + I3)Ω·(ϑ̇3, −ϑ̇2) about axes 2 and 3 (Nelson, J. Mech. Design 102, 1980).
    """
    points, weights = leggauss(degree + 1)
    N = np.array([f(points) for f in _functions(degree)])
    spin = material.density * (profile.second_2 + profile.second_3)
    turned = np.zeros((FIELDS, FIELDS))
    turned[4, 5], turned[5, 4] = spin, -spin
    return np.kron((N * weights) @ N.T * length / 2, turned)


def _functions(degree: int) -> list[Legendre]:
    """Of every field: two linear end functions and integrated Legendre polynomials inside."""
    inside = [Legendre.basis(k).integ(lbnd=-1) * np.sqrt(k + 0.5) for k in range(1, degree)]
    return [Legendre([0.5, -0.5]), Legendre([0.5, 0.5]), *inside]


def shortest_wave(profile: Profile, material: Material, omega: float) -> float:
    """Largest wave number in rad/m at an angular frequency: bending in both planes, stretching and torsion."""
    E, G, rho, A = material.young, material.shear, material.density, profile.area
    polar = profile.second_2 + profile.second_3
    numbers = [omega * np.sqrt(rho / E), omega * np.sqrt(rho * polar / (G * profile.torsion))]
    for second, kappa in ((profile.second_3, profile.shear_2), (profile.second_2, profile.shear_3)):
        # (κGA k² − ρAω²)(EI k² + κGA − ρIω²) = (κGA k)², a quadratic in k².
        S, B, m, j = kappa * G * A, E * second, rho * A * omega**2, rho * second * omega**2
        numbers.append(float(np.sqrt(np.max(np.roots([S * B, -S * j - m * B, m * (j - S)]).real))))
    return float(max(numbers))
