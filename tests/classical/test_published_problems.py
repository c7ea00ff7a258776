"""Problems of Hock and Schittkowski's collection, from its starts, with its minima."""

import casadi as ca
import pytest

from thesislib.classical.interior_point import interior_point
from thesislib.classical.ipopt import ipopt
from thesislib.classical.programme import Programme
from thesislib.classical.sqp import sqp

ROOT_3 = 3**0.5


def hs_7() -> tuple[Programme, list[float], float]:
    return (
        Programme(
            lambda x: ca.log(1 + x[0] ** 2) - x[1],
            2,
            equalities=lambda x: [(1 + x[0] ** 2) ** 2 + x[1] ** 2 - 4],
            name="HS7",
        ),
        [2.0, 2.0],
        -ROOT_3,
    )


def hs_24() -> tuple[Programme, list[float], float]:
    def sides(x: ca.SX) -> list[ca.SX]:
        return [x[1] - x[0] / ROOT_3, -x[0] - ROOT_3 * x[1], x[0] + ROOT_3 * x[1] - 6, -x]

    return (
        Programme(
            lambda x: ((x[0] - 3) ** 2 - 9) * x[1] ** 3 / (27 * ROOT_3), 2, inequalities=sides, name="HS24"
        ),
        [1.0, 0.5],
        -1.0,
    )


def hs_43() -> tuple[Programme, list[float], float]:
    def sides(x: ca.SX) -> list[ca.SX]:
        return [
            ca.sumsqr(x) + x[0] - x[1] + x[2] - x[3] - 8,
            x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2 + 2 * x[3] ** 2 - x[0] - x[3] - 10,
            2 * x[0] ** 2 + x[1] ** 2 + x[2] ** 2 + 2 * x[0] - x[1] - x[3] - 5,
        ]

    return (
        Programme(
            lambda x: ca.sumsqr(x) + x[2] ** 2 - 5 * x[0] - 5 * x[1] - 21 * x[2] + 7 * x[3],
            4,
            inequalities=sides,
            name="HS43",
        ),
        [0.0, 0.0, 0.0, 0.0],
        -44.0,
    )


def hs_100() -> tuple[Programme, list[float], float]:
    def objective(x: ca.SX) -> ca.SX:
        return (
            (x[0] - 10) ** 2
            + 5 * (x[1] - 12) ** 2
            + x[2] ** 4
            + 3 * (x[3] - 11) ** 2
            + 10 * x[4] ** 6
            + 7 * x[5] ** 2
            + x[6] ** 4
            - 4 * x[5] * x[6]
            - 10 * x[5]
            - 8 * x[6]
        )

    def sides(x: ca.SX) -> list[ca.SX]:
        return [
            2 * x[0] ** 2 + 3 * x[1] ** 4 + x[2] + 4 * x[3] ** 2 + 5 * x[4] - 127,
            7 * x[0] + 3 * x[1] + 10 * x[2] ** 2 + x[3] - x[4] - 282,
            23 * x[0] + x[1] ** 2 + 6 * x[5] ** 2 - 8 * x[6] - 196,
            4 * x[0] ** 2 + x[1] ** 2 - 3 * x[0] * x[1] + 2 * x[2] ** 2 + 5 * x[5] - 11 * x[6],
        ]

    return (
        Programme(objective, 7, inequalities=sides, name="HS100"),
        [1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0],
        680.6300573,
    )


@pytest.mark.parametrize("method", (sqp, interior_point, ipopt))
@pytest.mark.parametrize("problem", (hs_7, hs_24, hs_43, hs_100))
def test_published_minimum_is_found(problem, method):
    programme, start, minimum = problem()
    found = method(programme, start)
    assert programme.kkt_residual(found.x, found.lam, found.mu) <= 2e-8
    # seven decimals are published; barriers of 1e-9 shift a minimum by that times the active constraints
    assert programme.value(found.x) == pytest.approx(minimum, abs=1.2e-7)
