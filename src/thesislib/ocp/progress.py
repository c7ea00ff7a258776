"""What IPOPT says after every iteration, told to the caller."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from thesislib.ocp.programme import Programme
from thesislib.ocp.settings import Progress


class Watch(ca.Callback):
    """An iteration callback of `casadi.nlpsol`.

    Parameters
    ----------
    progress : callable
        The caller's; a true answer stops the solve, an exception does so too and is raised again.
    programme : Programme
        What is being solved.
    about : (str, int, int, int)
        Problem, mesh, intervals and points.
    scale : float
        Size of the objective.
    """

    def __init__(
        self,
        progress: Callable[[Progress], bool | None],
        programme: Programme,
        about: tuple[str, int, int, int],
        scale: float,
    ) -> None:
        ca.Callback.__init__(self)
        self.progress, self.programme, self.about, self.scale = progress, programme, about, scale
        self.iteration = 0
        self.caught: BaseException | None = None
        self.construct("watch", {})

    def get_n_in(self) -> int:
        """As `casadi.Callback` asks."""
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        """As `casadi.Callback` asks."""
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """As `casadi.Callback` asks: the shapes of an nlpsol's outputs."""
        variables, rows = len(self.programme.lower), len(self.programme.rows_lower)
        parameters = self.programme.derivatives["grad_f"].size1_in(1)
        sizes = {"x": variables, "lam_x": variables, "g": rows, "lam_g": rows, "f": 1, "lam_p": parameters}
        return ca.Sparsity.dense(sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arguments: Sequence[ca.DM]) -> list[float]:
        """Tell the caller where the solve is."""
        at = dict(zip(ca.nlpsol_out(), arguments, strict=True))
        g = np.array(at["g"]).ravel()
        violation = np.maximum(self.programme.rows_lower - g, g - self.programme.rows_upper)
        name, mesh, intervals, points = self.about
        told = Progress(
            name,
            mesh,
            intervals,
            points,
            self.iteration,
            float(at["f"]) * self.scale,
            float(max(violation.max(initial=0.0), 0.0)),
        )
        self.iteration += 1
        try:
            return [float(bool(self.progress(told)))]
        except BaseException as error:
            self.caught = error
            return [1.0]

    def reraise(self) -> None:
        """Raise what the caller's function raised, which CasADi would swallow."""
        if self.caught is not None:
            raise self.caught
