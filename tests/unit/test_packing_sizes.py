"""Distributions of sizes: closed forms of their fractions; drawing by strata keeps to them."""

import math

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.packing import Constant, Grading, LogNormal, Normal, Uniform


def phi(z):
    """Fraction of a standard normal distribution below z."""
    return 0.5 * (1.0 + math.erf(z / math.sqrt(2.0)))


def cut(z, low, high):
    return (phi(z) - phi(low)) / (phi(high) - phi(low))


CASES = [
    (Uniform(0.9, 1.1), lambda x: (x - 0.9) / 0.2),
    (Normal(1.0, 0.1), lambda x: cut((x - 1.0) / 0.1, -3, 3)),
    (Normal(1.0, 0.5, low=0.2, high=1.1), lambda x: cut((x - 1.0) / 0.5, -1.6, 0.2)),
    (LogNormal(2.0, 0.4), lambda x: cut(math.log(x / 2.0) / 0.4, -3, 3)),
    # mass even in [1, 2]: number ~ d^-2 in the plane, F = (1 - 1/d) / (1 - 1/2), d = 2 x
    (Grading([1.0, 2.0], [0.0, 1.0]), lambda x: 2.0 * (1.0 - 0.5 / x)),
]


@pytest.mark.parametrize(("sizes", "fraction"), CASES, ids=lambda c: type(c).__name__)
def test_drawn_sizes_follow_the_distribution(sizes, fraction):
    n = 200
    drawn = np.sort(sizes.draw(n, np.random.default_rng(1)))
    below = np.array([fraction(x) for x in drawn])
    # one size in each of n strata of equal fraction: no other scatter; round-off 1e-12
    assert (below >= np.arange(n) / n - 1e-12).all()
    assert (below <= (np.arange(n) + 1) / n + 1e-12).all()


def test_constant_sizes_are_equal():
    assert set(Constant(0.3).draw(5, np.random.default_rng(1))) == {0.3}


@pytest.mark.parametrize("dimension", [2, 3])
def test_grading_gives_the_mass_that_passes(dimension):
    sieves, passing = np.array([1.0, 2.0, 3.0, 8.0]), np.array([0.0, 0.5, 0.5, 1.0])
    n = 5000
    d = 2.0 * Grading(sieves, passing).draw(n, np.random.default_rng(1), dimension)
    mass = d**dimension
    found = np.array([mass[d <= s].sum() for s in sieves]) / mass.sum()
    # between two sieves a stratum can shift by one grain at either end, at most the largest
    np.testing.assert_allclose(found, passing, atol=2 * 8.0**dimension / mass.sum())
    assert not ((d > 2.0 + 1e-9) & (d < 3.0 - 1e-9)).any()


def test_grading_reads_percent():
    assert Grading([1, 2], [0, 100]) == Grading([1.0, 2.0], [0.0, 1.0])


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Uniform(2.0, 1.0), "Uniform: high = 1.0: must be above 2.0"),
        (lambda: Uniform(low=1.0, hihg=2.0), "Uniform: hihg: no such argument; did you mean high?"),
        (lambda: Constant(-1.0), "Constant: size = -1.0: must be above 0"),
        (lambda: Constant("1"), "must be a finite number"),
        (lambda: Normal(1.0, 0.5), "Normal: low = -0.5: must be above 0"),
        (lambda: LogNormal(1.0), "missing a required argument: 'sigma'"),
        (lambda: Grading([1, 2], [0.1, 1]), "must grow from 0 to 1"),
        (lambda: Grading([2, 1], [0, 1]), "increase"),
        (lambda: Grading([1, 2, 3], [0, 1]), "3 sieves and 2 values"),
        (lambda: Grading(1, [0, 1]), "must be a list"),
    ],
)
def test_sizes_refuse_what_is_no_distribution(make, text):
    with pytest.raises(InputError, match=text.replace("?", r"\?")):
        make()
