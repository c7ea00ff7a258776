"""Figures 4.1 to 4.4: the car, its coordinates on the road, its forces, and who informs whom.

Our own drawings, in SAE axes seen from above: x forward and to the right of the page, y to the car's
right and down the page, z into it. Angles are positive clockwise.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon

from .sketching import Point, angle, arc_points, arrow, away, block, dimension, into_page, name, sheet, stroke
from .style import BLACK, BLUE, GREEN, GREY, LIGHT, VERMILION, styled

WHEEL_LENGTH, WHEEL_WIDTH = 0.66, 0.34  # m, of a drawn wheel


def _body(axes: Axes, a: float, b: float) -> None:
    """The outline of an open-wheeled car whose mass centre is at the origin."""
    left = [
        (a + 0.75, 0.07),
        (a + 0.25, 0.16),
        (a - 0.9, 0.28),
        (a - 1.15, 0.62),
        (0.1 - b, 0.5),
        (-b - 0.45, 0.14),
    ]
    outline = [(x, -y) for x, y in left] + left[::-1]
    wings = [(a + 0.55, a + 0.85, 0.85), (-b - 0.7, -b - 0.4, 0.48)]
    for points in [outline, *([(p, -w), (q, -w), (q, w), (p, w)] for p, q, w in wings)]:
        axes.add_patch(Polygon(points, facecolor="#F2F2F2", edgecolor=GREY, linewidth=0.9, zorder=1))


def _mass_centre(axes: Axes, at: Point = (0.0, 0.0)) -> None:
    axes.plot(*at, "o", color=BLACK, markersize=8.0, markerfacecolor="white", zorder=5)
    axes.plot(*at, "+", color=BLACK, markersize=8.0, zorder=6)


def _wheel_centres(a: float, b: float, w_f: float, w_r: float) -> dict[str, Point]:
    return {"fl": (a, -w_f), "fr": (a, w_f), "rl": (-b, -w_r), "rr": (-b, w_r)}


@styled
def plan_view(*, a: float = 1.8, b: float = 1.6, w_f: float = 0.73, w_r: float = 0.73) -> Figure:
    """Figure 4.1: plan view with the body-fixed axes and the lengths of Table C.1, to scale.

    Parameters
    ----------
    a, b : float
        Distance in m of the mass centre from the front and the rear axle.
    w_f, w_r : float
        Distance in m of a front and a rear wheel from the car's centre line.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, axes = sheet((-b - 1.55, a + 1.45), (-1.45, 1.85))
    _body(axes, a, b)
    stroke(axes, (-b - 1.2, 0.0), (a + 1.2, 0.0), colour=GREY, style="-.")
    centres = _wheel_centres(a, b, w_f, w_r)
    for wheel, centre in centres.items():
        block(axes, centre, WHEEL_LENGTH, WHEEL_WIDTH, 0.0, fill=LIGHT)
        name(axes, (centre[0] + 0.2, centre[1] + np.sign(centre[1]) * 0.32), wheel, colour=GREY, size=11.0)
    arrow(axes, (0.0, 0.0), (1.05, 0.0), colour=BLUE, width=2.0)
    name(axes, (1.0, -0.2), "$x_b$", colour=BLUE)
    arrow(axes, (0.0, 0.0), (0.0, 1.0), colour=BLUE, width=2.0)
    name(axes, (0.22, 0.95), "$y_b$", colour=BLUE)
    _mass_centre(axes)
    name(axes, (-0.25, -0.22), "$M_c$")
    into_page(axes, (-b - 1.25, 1.6), "$z_b$, down", shift=(0.62, 0.0))
    for x in (a, 0.0, -b):
        stroke(axes, (x, 0.0), (x, 1.5), colour=GREY, width=0.7)
    dimension(axes, (0.0, 1.38), (a, 1.38), "$a$")
    dimension(axes, (-b, 1.38), (0.0, 1.38), "$b$")
    for axle, half, x in ((a, w_f, a + 1.1), (-b, w_r, -b - 0.95)):
        stroke(axes, (axle, -half), (x, -half), colour=GREY, width=0.7)
        dimension(axes, (x, 0.0), (x, -half), "$w_f$" if axle > 0.0 else "$w_r$")
    return figure


@styled
def curvilinear_coordinates() -> Figure:
    """Figure 4.2: where the car is on the road, by s, n and xi; directions drawn apart.

    The half-widths are those of the road to the right and left of its centre line; curvature
    C = 1/R is positive in a right-hand turn, and psi = theta + xi.
    """
    figure, axes = sheet((-1.0, 10.2), (-0.1, 7.6))
    centre, radius, half, n, xi = (4.4, 8.6), 6.4, 1.75, 0.95, np.radians(20.0)
    start, station, end = np.radians([-126.0, -82.0, -47.0])
    theta = station + 0.5 * np.pi
    road = np.vstack(
        (arc_points(centre, radius + half, start, end), arc_points(centre, radius - half, end, start))
    )
    axes.add_patch(Polygon(road, facecolor="#F2F2F2", edgecolor="none", zorder=0))
    for offset in (-half, half):
        axes.plot(*arc_points(centre, radius + offset, start, end).T, color=GREY, linewidth=1.2)
    axes.plot(*arc_points(centre, radius, start, end).T, color=GREEN, linewidth=1.4, linestyle="-.")

    spine = away(centre, station, radius)
    car = away(centre, station, radius - n)
    stroke(
        axes, away(centre, start + 0.05, radius + half), away(centre, start + 0.05, radius - half), width=2.0
    )
    angle(axes, centre, radius + 0.28, start + 0.05, station - 0.02, "$s$", colour=GREEN, clear=0.22)
    name(axes, away(centre, start + 0.05, radius + half + 0.25), "start", size=11.0)
    stroke(axes, centre, car, colour=GREY, style="--")
    name(axes, away(centre, station, 3.2), r"$\mathcal{R} = 1/\mathcal{C}$", size=13.0)

    block(axes, car, 1.6, 0.62, theta + xi, fill="#CFE3F1")
    arrow(axes, car, away(car, theta + xi, 1.5), colour=BLUE)
    name(axes, away(car, theta + xi, 1.75), "$x_b$", colour=BLUE)
    arrow(axes, spine, away(spine, theta, 1.5), colour=GREEN)
    name(axes, away(spine, theta, 1.75), r"$\mathbf{t}$", colour=GREEN)
    arrow(axes, spine, car, colour=VERMILION, width=2.0)
    name(axes, away(spine, station, -0.45, -0.25), r"$\mathbf{n}$", colour=VERMILION)
    axes.plot(*spine, "o", color=GREEN, markersize=5.0, zorder=5)
    _mass_centre(axes, car)
    name(axes, away(car, theta, -0.35, 0.62), "$M_c$")
    across = station + np.radians(25.0)
    for sign, label in ((-1.0, r"$\mathcal{N}_r$"), (1.0, r"$\mathcal{N}_l$")):
        dimension(axes, away(centre, across, radius), away(centre, across, radius + sign * half), label)

    _directions(axes, (6.3, 5.6), theta + np.radians(24.0), np.radians(24.0))
    origin = (0.3, 5.7)
    arrow(axes, origin, (1.4, 5.7))
    arrow(axes, origin, (0.3, 6.8))
    name(axes, (1.65, 5.7), "$n_x$")
    name(axes, (0.3, 7.05), "$n_y$")
    return figure


def _directions(axes: Axes, at: Point, theta: float, xi: float) -> None:
    """The directions of the inertial x axis, the road and the car from one point, and their angles."""
    for direction, colour, text in (
        (0.0, BLACK, "$n_x$"),
        (theta, GREEN, r"$\mathbf{t}$"),
        (theta + xi, BLUE, "$x_b$"),
    ):
        arrow(axes, at, away(at, direction, 1.9), colour=colour)
        name(axes, away(at, direction, 2.13), text, colour=colour)
    angle(axes, at, 1.25, 0.0, theta, r"$\theta$", colour=GREEN)
    angle(axes, at, 1.25, theta, theta + xi, r"$\xi$", colour=VERMILION)
    angle(axes, at, 0.65, 0.0, theta + xi, r"$\psi$", colour=BLUE, clear=0.2)


@styled
def tyre_force_system(*, a: float = 1.8, b: float = 1.6, w_f: float = 0.73, w_r: float = 0.73) -> Figure:
    """Figure 4.3: tyre forces in the wheels' own axes, steer, side slip and yaw, all positive.

    Parameters
    ----------
    a, b, w_f, w_r : float
        Lengths in m, as in :func:`plan_view`; the wheels stand further apart, for room.
    """
    figure, axes = sheet((-b - 0.9, a + 1.95), (-2.1, 2.75))
    _body(axes, a, b)
    steer, slip, yaw = np.radians([18.0, 20.0, 24.0])
    for wheel, centre in _wheel_centres(a, b, 2.2 * w_f, 2.2 * w_r).items():
        heading = steer if wheel[0] == "f" else 0.0
        block(axes, centre, WHEEL_LENGTH, WHEEL_WIDTH, heading, fill=LIGHT)
        arrow(axes, centre, away(centre, heading, 0.85), colour=VERMILION, width=2.0)
        arrow(axes, centre, away(centre, heading + 0.5 * np.pi, 0.7), colour=VERMILION, width=2.0)
        name(axes, away(centre, heading, 1.14), f"$F_{{{wheel}x}}$", colour=VERMILION)
        name(axes, away(centre, heading + 0.5 * np.pi, 0.9), f"$F_{{{wheel}y}}$", colour=VERMILION)
        if heading:
            stroke(axes, centre, away(centre, 0.0, 1.5), colour=GREY, style="--")
            angle(axes, centre, 1.42, 0.0, heading, r"$\delta$", clear=0.18)

    mass_centre = (0.0, 0.0)
    arrow(axes, mass_centre, away(mass_centre, 0.0, 1.5), colour=BLUE)
    name(axes, (1.72, 0.0), "$x_b$", colour=BLUE)
    arrow(axes, mass_centre, (0.0, 1.25), colour=BLUE)
    name(axes, (0.0, 1.45), "$y_b$", colour=BLUE)
    arrow(axes, mass_centre, away(mass_centre, -yaw, 1.25), dashed=True)
    name(axes, away(mass_centre, -yaw, 1.42), "$n_x$")
    arrow(axes, mass_centre, away(mass_centre, 0.5 * np.pi - yaw, 1.25), dashed=True)
    name(axes, away(mass_centre, 0.5 * np.pi - yaw, 1.42), "$n_y$")
    angle(axes, mass_centre, 0.95, -yaw, 0.0, r"$\psi$", clear=0.2)
    speed = away(mass_centre, slip, 1.45)
    arrow(axes, mass_centre, speed, colour=GREEN, width=2.0)
    name(axes, away(mass_centre, slip, 1.62, 0.05), "$V$", colour=GREEN)
    angle(axes, mass_centre, 0.85, 0.0, slip, r"$\beta$", colour=GREEN, clear=0.2)
    angle(axes, mass_centre, 0.45, np.radians(130.0), np.radians(250.0), r"$\omega$", clear=0.22)
    _mass_centre(axes)
    name(axes, (-0.05, -0.28), "$M_c$")
    return figure


@styled
def aero_suspension_data_flow() -> Figure:
    """Figure 4.4: which part of the model informs which, and by what."""
    figure, axes = sheet((0.0, 10.0), (0.0, 5.9))
    width, height = 3.2, 1.55
    boxes = {
        "car": ((0.15, 0.55), "car on the road\n(4.5)–(4.21)"),
        "suspension": ((6.65, 0.55), "suspension\nmetamodel\nTable 3.1"),
        "map": ((6.65, 4.1), "aerodynamic map\nTable 4.1"),
        "forces": ((0.15, 4.1), "aerodynamic forces\n(4.22)–(4.24)"),
    }
    for (x, y), text in boxes.values():
        axes.add_patch(
            FancyBboxPatch(
                (x, y),
                width,
                height,
                boxstyle="round,pad=0,rounding_size=0.15",
                facecolor="#E8F1F8",
                edgecolor=BLUE,
                linewidth=1.3,
            )
        )
        axes.annotate(text, (x + 0.5 * width, y + 0.5 * height), ha="center", va="center", fontsize=12)
    arrow(axes, (3.35, 1.0), (6.65, 1.0))
    name(axes, (5.0, 0.62), "$F_{flz},\\ F_{frz},\\ F_{rlz},\\ F_{rrz}$", size=13.0)
    arrow(axes, (8.25, 2.1), (8.25, 4.1))
    name(axes, (8.25, 3.05), r"$h_f,\ h_r,\ \phi_f,\ \phi_r$", size=13.0)
    arrow(axes, (3.35, 1.75), (6.65, 4.45))
    name(axes, (5.0, 3.1), r"$\delta,\ \beta$", size=13.0)
    arrow(axes, (6.65, 5.15), (3.35, 5.15))
    name(axes, (5.0, 5.5), "$C_L^f,\\ C_L^r,\\ C_D$", size=13.0)
    arrow(axes, (1.25, 4.1), (1.25, 2.1))
    name(axes, (1.25, 3.1), "$F_{az}^f,\\ F_{az}^r,\\ F_{ax}$", size=13.0)
    arrow(axes, (2.85, 2.1), (2.85, 4.1))
    name(axes, (2.85, 3.1), "$u$", size=13.0)
    return figure
