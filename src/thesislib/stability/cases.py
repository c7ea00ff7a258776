"""Certified regions of one car each, as cases of a study: numbers in, numbers and the certificate out."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.alternation import alternate
from thesislib.stability.ascent import Goal, Region, ascend, ascend_beta, scaled_window, scaling
from thesislib.stability.bicycle import Bicycle, linear_theory
from thesislib.stability.fields import ExactCar
from thesislib.stability.phase_plane import TrueRegion, Window, escapes, polygon_area, true_region
from thesislib.stability.program import ProgramError
from thesislib.stability.programs import linear_lyapunov, quadratic
from thesislib.stability.rays import Rays

Array = NDArray[np.float64]

WHEELBASE = 2.5
"""Table 7.1: a + b, m, which moving the mass centre leaves as it is."""

GOAL_FACTOR, GOAL_REACH = 1.25, 0.35
"""The area that is enlarged: lateral speeds up to 1.25 times the saddles', and slips up to 0.35 rad."""

_STARTS = 10_000


@dataclass(frozen=True)
class Setting:
    """The numbers of one car, by which it differs from Table 7.1.

    Attributes
    ----------
    u_0, delta_deg, mass, I_z, a : float
        Speed in m/s, steering angle in degrees, mass, yaw inertia, mass centre behind the front axle.
    front, rear : float
        Factors of the axles' forces, and so of their cornering stiffnesses.
    """

    u_0: float = 20.0
    delta_deg: float = 0.0
    mass: float = 1500.0
    I_z: float = 3000.0
    a: float = 1.2
    front: float = 1.0
    rear: float = 1.0

    def magic(self) -> Bicycle:
        """Return the car on the Magic Formula.

        Raises
        ------
        ValueError
            If a number is outside the range of its parameter.
        """
        car = Bicycle.from_file(
            tyres="magic",
            u_0=self.u_0,
            mass=self.mass,
            I_z=self.I_z,
            a=self.a,
            b=round(WHEELBASE - self.a, 12),
        )
        return replace(
            car,
            delta=float(np.radians(self.delta_deg)),
            front=car.front.scaled(peak=self.front),  # type: ignore[attr-defined]
            rear=car.rear.scaled(peak=self.rear),  # type: ignore[attr-defined]
        )

    def rational(self) -> Bicycle:
        """Return the car on the rational fits."""
        return self.magic().fitted()


def goal_window(truth: TrueRegion, to_state: Array) -> Window:
    """Return the window, in z, inside which the area is enlarged."""
    both = (truth.speed_window(GOAL_FACTOR), truth.slip_window(GOAL_REACH))
    joined = Window(
        "goal",
        np.concatenate([w.normals for w in both]),
        np.concatenate([w.limits for w in both]),
    )
    return scaled_window(joined, to_state, truth.trim)


def tyre_linearisation(setting: Setting, to_state: Array) -> Array:
    """Return the Magic Formula's linearisation at its own trim, in z, 1/s."""
    magic = setting.magic()
    return np.asarray(np.linalg.solve(to_state, magic.jacobian(magic.trim()) @ to_state))


def regions(
    setting: Setting, degrees: list[int], *, steps: int = 40, exact: ExactCar | None = None
) -> tuple[TrueRegion, dict[int, Region]]:
    """Return the true region of a car and its certified ones for rising degrees of V.

    Raises
    ------
    ValueError, ProgramError
        If there is no stable trim, no pair of saddles, a fit degenerates, or nothing can be certified.
    """
    car = setting.rational()
    truth = true_region(car)
    to_state = scaling(car.matrix)
    found = ascend(
        [exact or ExactCar.at_trim(car)],
        degrees,
        Goal(window=goal_window(truth, to_state)),
        to_state,
        stiff=tyre_linearisation(setting, to_state),
        steps=steps,
    )
    return truth, found


def ratios(truth: TrueRegion, boundary: Array) -> tuple[float, float]:
    """Return which part of the true region a set covers, in the speed and in the slip window."""
    both = []
    for window in (truth.speed_window(), truth.slip_window()):
        both.append(window.area(boundary) / window.area(truth.boundary))
    return both[0], both[1]


def starts_inside(region: Region, truth: TrueRegion, count: int = _STARTS, seed: int = 7) -> Array:
    """Return states spread evenly over {V <= 1}, shape (count, 2)."""
    generator = np.random.default_rng(seed)
    to_state = scaling(truth.car.matrix)
    rays = Rays(720)
    reach = 1.02 * np.abs(rays.points(rays.boundary(region.V))).max(axis=0)
    kept = np.zeros((0, 2))
    while len(kept) < count:
        z = generator.uniform(-reach, reach, (4 * count, 2))
        kept = np.concatenate([kept, z[region.V(*z.T) <= 1.0]])
    return np.asarray(kept[:count] @ to_state.T + truth.trim)


def region_case(degree: int, steps: int = 40, **numbers: float) -> dict[str, Any]:
    """Compute a car's certified region: a case of `studies.run`.

    Parameters
    ----------
    degree : int
        Of V; lower even degrees are passed on the way.
    steps : int
        Joint steps at most for each degree.
    **numbers : float
        Of `Setting`.
    """
    setting = Setting(**numbers)
    truth, found = regions(setting, list(range(2, degree + 1, 2)), steps=steps)
    region = found[degree]
    to_state = scaling(truth.car.matrix)
    boundary = region.boundary(to_state, truth.trim)
    speed, slip = ratios(truth, boundary)
    linear = linear_theory(replace(setting.magic(), delta=0.0))
    return {
        "boundary": boundary,
        "manifold_1": truth.manifolds[0],
        "manifold_2": truth.manifolds[1],
        "saddles": truth.saddles,
        "trim": truth.trim,
        "ratio_speed": speed,
        "ratio_slip": slip,
        "area": polygon_area(boundary),
        "widest_v": float(np.ptp(boundary[:, 0]) / 2),
        "widest_w": float(np.ptp(boundary[:, 1]) / 2),
        "escapes": escapes(truth.car, starts_inside(region, truth)),
        "certificate": json.dumps(region.certificate.document),
        "seconds": region.seconds,
        "K_us": linear.understeer_deg_per_g,
        "determinant": linear.determinant,
        "determinant_printed": linear.determinant_printed,
        "damping": linear.damping,
    }


def map_case(degree: int, steps: int, **numbers: float) -> dict[str, Any]:
    """Compute the certified area of a car, nothing else: a case of a map.

    Returns
    -------
    dict
        With area 0 and the reason if there is no trim, no pair of saddles, or no set that can be certified.
    """
    setting = Setting(**numbers)
    try:
        truth, found = regions(setting, list(range(2, degree + 1, 2)), steps=steps)
    except (ValueError, ProgramError) as error:
        return {"area": 0.0, "true_area": 0.0, "reason": str(error)}
    boundary = found[degree].boundary(scaling(truth.car.matrix), truth.trim)
    window = truth.slip_window()
    return {"area": window.area(boundary), "true_area": window.area(truth.boundary), "reason": ""}


def robust_case(
    degree: int,
    steps: int,
    tyre: float = 0.0,
    slowest: float = 20.0,
    fastest: float = 20.0,
    acceleration: float = 0.0,
    height: float = 0.0,
) -> dict[str, Any]:
    """Compute one region for a whole family of cars that run straight, each corner of it exactly certified.

    Parameters
    ----------
    degree, steps
        As of `region_case`.
    tyre : float
        Both axles' forces may be wrong by this part, independently.
    slowest, fastest : float
        The speed is between these, m/s, and may change at will.
    acceleration : float
        The car may brake and accelerate by up to this, m/s², changing at will.
    height : float
        Of the mass centre, m: what it shifts of the axle loads scales the axles' forces.

    Returns
    -------
    dict
        With area 0 and the reason if no set can be certified.
    """
    setting = Setting(u_0=(slowest + fastest) / 2)
    nominal = setting.rational()
    cars = []
    for u in sorted({slowest, fastest}):
        for a_x in sorted({-acceleration, acceleration}):
            shift = height * a_x / 9.81
            loads = (1 - shift / nominal.b, 1 + shift / nominal.a)
            for front in sorted({1 - tyre, 1 + tyre}):
                for rear in sorted({1 - tyre, 1 + tyre}):
                    factors = (round(front * loads[0], 12), round(rear * loads[1], 12))
                    one = replace(nominal, u_0=u)
                    cars.append(ExactCar.at_trim(one, factors=factors, acceleration=a_x))
    truth, to_state = true_region(nominal), scaling(nominal.matrix)
    window = goal_window(truth, to_state)
    try:
        found = ascend(cars, list(range(2, degree + 1, 2)), Goal(window=window), to_state, steps=steps)
    except RuntimeError as error:
        return {"area": 0.0, "reason": str(error), "cars": len(cars), "boundary_slip": np.zeros((1, 2))}
    region = found[degree]
    boundary = region.boundary(to_state, truth.trim)
    return {
        "area": truth.speed_window().area(boundary) / truth.speed_window().area(truth.boundary),
        "reason": "",
        "cars": len(cars),
        "boundary_slip": nominal.to_slip(boundary),
        "certificate": json.dumps(region.certificate.document),
        "seconds": region.seconds,
    }


def beta_case(highest: int, **numbers: float) -> dict[str, Any]:
    """Compute beta for s = v² + omega² and V of degree 2, 4 … `highest` by the joint ascent."""
    car = Setting(**numbers).rational()
    truth, to_state = true_region(car), scaling(car.matrix)
    degrees = list(range(2, highest + 1, 2))
    shape = quadratic(to_state.T @ to_state)
    found = ascend_beta(ExactCar.at_trim(car), degrees, shape, to_state)
    return {
        "beta": np.array([region.size for region in found.values()]),
        "bound": truth.largest_level(lambda x: np.asarray((x**2).sum(axis=-1))),
        "seconds": np.array([region.seconds for region in found.values()]),
        "certificate": json.dumps(found[highest].certificate.document),
    }


def alternation_case(shape: str, highest: int, rounds: int, **numbers: float) -> dict[str, Any]:
    """Compute regions by Algorithm 7.1 for V of degree 2, 4 … `highest`.

    Parameters
    ----------
    shape : {"ball", "linear", "bootstrapped"}
        s = v² + omega²; V_lin; or V_lin first and then the V of the degree before.
    highest : int
    rounds : int
        Of Algorithm 7.1, at most.

    Returns
    -------
    dict
        A degree at which the algorithm fails has beta = 0 and the boundary of the degree before.
    """
    car = Setting(**numbers).rational()
    truth, to_state = true_region(car), scaling(car.matrix)
    exact = ExactCar.at_trim(car)
    V_lin = linear_lyapunov(exact.field, to_state)
    s = quadratic(to_state.T @ to_state) if shape == "ball" else V_lin
    results: dict[str, Any] = {"beta": [], "ratio": [], "rounds": [], "reason": ""}
    for degree in range(2, highest + 1, 2):
        try:
            found = alternate(exact, s, degree, to_state, rounds=rounds)
        except RuntimeError as error:
            if degree == 2:
                raise
            results["reason"] += f"degree {degree}: {error} "
            beta, turns = 0.0, 0
        else:
            beta, turns = found.beta, found.rounds
            turn = Rays(720)
            boundary = turn.points(turn.boundary(found.V)) @ to_state.T + truth.trim
            s = found.V if shape == "bootstrapped" else s
        results[f"boundary_{degree}"] = boundary
        results["beta"].append(beta)
        results["rounds"].append(turns)
        results["ratio"].append(ratios(truth, boundary)[0])
    return {
        key: np.array(value, float) if isinstance(value, list) else value for key, value in results.items()
    }
