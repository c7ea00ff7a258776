"""Programmes with known solutions."""

import casadi as ca
import pytest

from thesislib.classical.programme import Programme


@pytest.fixture(scope="session")
def valley() -> Programme:
    """Rosenbrock's function with 10 for 100; its minimum is 0 at (1, 1)."""
    return Programme(lambda x: (1 - x[0]) ** 2 + 10 * (x[1] - x[0] ** 2) ** 2, 2, name="valley")


@pytest.fixture(scope="session")
def hs14() -> Programme:
    """Problem 14 of Hock and Schittkowski: minimum 9 - 23 sqrt(7) / 8."""
    return Programme(
        lambda x: (x[0] - 2) ** 2 + (x[1] - 1) ** 2,
        2,
        lambda x: [x[0] - 2 * x[1] + 1],
        lambda x: [x[0] ** 2 / 4 + x[1] ** 2 - 1],
        name="HS14",
    )


@pytest.fixture(scope="session")
def hs71() -> Programme:
    """Problem 71 of Hock and Schittkowski: minimum 17.0140173, and an indefinite Hessian there."""
    return Programme(
        lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        4,
        lambda x: [ca.sumsqr(x) - 40],
        lambda x: [
            25 - x[0] * x[1] * x[2] * x[3],
            *(1 - x[i] for i in range(4)),
            *(x[i] - 5 for i in range(4)),
        ],
        name="HS71",
    )
