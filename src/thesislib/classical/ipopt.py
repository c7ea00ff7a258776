"""IPOPT on a programme of this room: the peer beside which the small methods are shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from thesislib.classical.programme import Array, Optimum, Programme, column

__all__ = ["ipopt"]


class _Iterates(ca.Callback):
    """What CasADi calls after each of IPOPT's iterations, to keep points and multipliers."""

    def __init__(self, sizes: tuple[int, int]) -> None:
        ca.Callback.__init__(self)
        self.sizes = sizes
        self.kept: list[tuple[Array, Array]] = []
        self.construct("iterates", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        name = ca.nlpsol_out(i)
        lengths = {"x": self.sizes[0], "lam_x": self.sizes[0], "f": 1}
        lengths |= {"g": self.sizes[1], "lam_g": self.sizes[1]}
        return ca.Sparsity.dense(lengths.get(name, 0), 1 if lengths.get(name, 0) else 0)

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        values = {ca.nlpsol_out(i): argument for i, argument in enumerate(arguments)}
        self.kept.append((column(values["x"]), column(values["lam_g"])))
        return [0]


def ipopt(programme: Programme, start: ArrayLike, *, tolerance: float = 1e-8, most: int = 500) -> Optimum:
    """Solve a nonlinear programme (2.20) by IPOPT.

    Parameters and errors are those of :func:`thesislib.classical.sqp.sqp`. IPOPT's tolerance is on its own,
    scaled conditions and its bounds are not relaxed, so that the residuals of (2.22) compare.
    """
    x = programme.start(start)
    expressions = programme.expressions
    equalities, inequalities = programme.equality_count, programme.inequality_count
    rows = ca.vertcat(expressions["g"], expressions["h"])
    iterates = _Iterates((programme.size, equalities + inequalities))
    options: dict[str, Any] = {
        "print_time": False,
        "iteration_callback": iterates,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": tolerance,
            "max_iter": most,
            "bound_relax_factor": 0.0,
        },
    }
    nlp = {"x": expressions["x"], "f": expressions["f"], "g": rows}
    solver = ca.nlpsol("solver", "ipopt", nlp, options)
    lower = np.concatenate((np.zeros(equalities), np.full(inequalities, -np.inf)))
    found = solver(x0=x, lbg=lower, ubg=np.zeros(equalities + inequalities))
    x, multipliers = column(found["x"]), column(found["lam_g"])
    lam, mu = multipliers[:equalities], multipliers[equalities:]
    status = solver.stats()["return_status"]
    if status != "Solve_Succeeded":
        raise programme.not_converged(x, lam, mu, tolerance, f"IPOPT stopped with {status}")
    points = np.array([point for point, _ in iterates.kept])
    residuals = [programme.kkt_residual(at, row[:equalities], row[equalities:]) for at, row in iterates.kept]
    return Optimum(x, lam, mu, points, np.array(residuals))
