"""Drawings made from the geometry: figures 3.1 to 3.4 and 3.8.

Each function draws into a figure that it is given and returns it. z points down in the data and in the
drawings, so that the road is below.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from thesislib.suspension.axle import GRAVITY, MIRROR, Axle
from thesislib.suspension.figures import BLUE, GREEN, GREY, VERMILION
from thesislib.suspension.loads import Stance
from thesislib.suspension.mechanism import Solution

Array = NDArray[np.float64]

WISHBONE: Final = "#000000"
COLOURS: Final = (*4 * (WISHBONE,), VERMILION, GREEN)
"""Colours of links 1 to 6: wishbones black, track rod red, push rod green, as in figure 3.1."""

_CHASSIS, _CARRIER = VERMILION, BLUE
_ONE_LABEL = 32.0  # mm: points that are closer in a view share a label

# Where the name of each rod force stands: from the arrow's tip or from its foot, offset in points. The upper
# three forces lie almost on one line and point away from the free side of the drawing.
_FORCE_LABELS = (
    ("foot", (10, 22)),
    ("foot", (10, 9)),
    ("tip", (6, 6)),
    ("tip", (6, -12)),
    ("foot", (10, -4)),
    ("tip", (-4, -14)),
)


def wheel_outline(axle: Axle, side: Array, radius: float = 0.326, half_width: float = 0.12) -> list[Array]:
    """Return two circles of a wheel at rest in chassis axes, m, each of shape (49, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.column_stack((radius * np.cos(angle), 0.0 * angle, radius * np.sin(angle)))
    return [(axle.wheel_centre + circle + [0.0, offset, 0.0]) * side for offset in (-half_width, half_width)]


def both_axles(figure: Figure, front: Axle, rear: Axle, wheelbase: float) -> Figure:
    """Draw the links of all four wheels in perspective (figure 3.1); `wheelbase` in m."""
    axes: Any = figure.add_subplot(projection="3d")
    for axle, x in ((front, 0.0), (rear, -wheelbase)):
        for side in (np.ones(3), MIRROR):
            shift = np.array([x, 0.0, 0.0])
            for i in range(6):
                ends = np.stack((axle.inner_ends[i], axle.carrier[i])) * side + shift
                axes.plot(*ends.T, color=COLOURS[i], linewidth=1.6)
            axes.scatter(
                *(axle.inner_ends * side + shift).T, color=_CHASSIS, marker="*", s=14, depthshade=False
            )
            axes.scatter(*(axle.carrier * side + shift).T, color=_CARRIER, marker="*", s=14, depthshade=False)
            for circle in wheel_outline(axle, side):
                axes.plot(*(circle + shift).T, color=GREY, linewidth=0.6)
    for name, colour in (("wishbones", WISHBONE), ("push and pull rods", GREEN), ("track rods", VERMILION)):
        axes.plot([], [], [], color=colour, label=name)
    axes.legend(frameon=False, fontsize="small", loc="upper left")
    axes.set(xlim=(-wheelbase - 0.45, 0.45), ylim=(0.9, -0.9), zlim=(0.35, -0.5))
    axes.set_box_aspect((wheelbase + 0.9, 1.8, 0.85), zoom=1.05)
    axes.view_init(elev=22, azim=-58)
    axes.set_xlabel("x (m)", labelpad=14)
    axes.set_ylabel("y (m)", labelpad=2)
    axes.set_zlabel("z (m)", labelpad=-6)
    axes.tick_params(labelsize="x-small", pad=-1)
    axes.set_yticks([-0.5, 0.0, 0.5])
    axes.set_zticks([-0.4, 0.0])
    return figure


def left_corner(figure: Figure, axle: Axle) -> Figure:
    """Draw the left wheel's links from behind and from above, with their points named (figure 3.2)."""
    panels = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    for axes, (across, along), title in (
        (panels[0], (1, 2), "from behind"),
        (panels[1], (1, 0), "from above"),
    ):
        for i in range(6):
            ends = np.stack((axle.inner_ends[i], axle.carrier[i]))
            axes.plot(*1e3 * ends[:, (across, along)].T, color=COLOURS[i], linewidth=1.6)
        for letter, points, colour in (("P", axle.inner_ends, _CHASSIS), ("Q", axle.carrier, _CARRIER)):
            for label, point in _grouped(letter, points, (across, along)):
                axes.plot(*point, color=colour, marker="*", markersize=8, linestyle="none")
                # the push rod's outer end stands apart from the others, towards the car
                left = letter == "Q" and label != "$Q_6$"
                axes.annotate(
                    label,
                    tuple(point),
                    (-8 if left else 8, -10),
                    textcoords="offset points",
                    ha="right" if left else "left",
                    fontsize="small",
                )
        centre = 1e3 * axle.wheel_centre[[across, along]]
        axes.plot(*centre, color=GREY, marker="o")
        axes.annotate("$O_W$", tuple(centre), (-8, -24), textcoords="offset points", fontsize="small")
        axes.margins(0.2)
        _frame(axes, title, ("y (mm)", ("x", "y", "z")[along] + " (mm)"), down=along == 2)
    return figure


def rocker_assembly(figure: Figure, axle: Axle) -> Figure:
    """Draw both rockers, the rods and the heave spring from behind (figure 3.3)."""
    axes = figure.subplots()
    ends = [axle.spring_end * side for side in (np.ones(3), MIRROR)]
    _spring(axes, 1e3 * ends[0][1:], 1e3 * ends[1][1:])
    for name, side in (("L", np.ones(3)), ("R", MIRROR)):
        pivot, rod, spring, wheel = (
            1e3 * (point * side)[1:] for point in (axle.pivot, axle.rod_end, axle.spring_end, axle.carrier[5])
        )
        axes.fill(*np.stack((pivot, rod, spring)).T, color="#DDDDDD", edgecolor="black", linewidth=1.2)
        axes.plot(*np.stack((rod, wheel)).T, color=GREEN, linewidth=2.0)
        axes.plot(*pivot, color="black", marker="o", markersize=9)
        outwards = -1.0 if name == "L" else 1.0
        for label, point, offset in (
            (f"$R_{{RP{name}}}$", pivot, (-16 * outwards, -14)),
            (f"$P_{{6{name}}}$", rod, (18 * outwards, 2)),
            (f"$P_{{H{name}}}$", spring, (-4 * outwards, 10)),
            (f"$Q_{{6{name}}}$", wheel, (0, -14)),
        ):
            axes.annotate(label, tuple(point), offset, textcoords="offset points", ha="center")
    axes.annotate("$K_h$", (0.0, 1e3 * ends[0][2]), (0, 12), textcoords="offset points", ha="center")
    _frame(axes, "rockers, rods and heave spring from behind", ("y (mm)", "z (mm)"), down=True)
    return figure


def free_body(figure: Figure, axle: Axle, solution: Solution, force: Sequence[float]) -> Figure:
    """Draw the forces on the left wheel carrier at rest from behind, to scale (figure 3.4).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    axle : Axle
    solution : Solution
        Of one load case.
    force : sequence of three float
        Tyre force of that case, N.
    """
    axes = figure.subplots()
    scale = 0.12  # mm per N
    outline = np.stack([axle.carrier[i] for i in (0, 2, 4, 5)] + [axle.wheel_centre])[:, 1:]
    hull = outline[np.argsort(np.arctan2(*(outline - outline.mean(axis=0)).T))]
    axes.fill(*(1e3 * hull).T, color="#DDE9F3", edgecolor=BLUE)
    for i in range(6):
        direction = axle.inner_ends[i] - axle.carrier[i]
        push = solution.rod_forces[0, 0, i] * direction / np.linalg.norm(direction)
        name = f"$R_{{L{i + 1}}}$" if i < 5 else "$F_{PL}$"
        label = f"{name} {np.linalg.norm(push):.0f} N"
        _arrow(axes, axle.carrier[i], push, scale, COLOURS[i], label, *_FORCE_LABELS[i])
    contact = solution.contact_left[0]
    tyre = np.asarray(force, dtype=float)
    _arrow(axes, contact, tyre, scale, VERMILION, f"$F_{{TL}}$ {-force[2]:.0f} N", "tip", (-78, -14))
    weight = np.array([0.0, 0.0, axle.carrier_mass * GRAVITY])
    _arrow(axes, axle.wheel_centre, weight, scale, GREY, f"$F_{{Lg}}$ {weight[2]:.0f} N", "tip", (-72, -4))
    axes.plot(*1e3 * contact[1:], color="black", marker="o", markersize=4)
    axes.annotate("$Q_{GC}$", 1e3 * contact[1:], (8, -4), textcoords="offset points")
    axes.margins(0.16)
    _frame(axes, "forces on the left wheel carrier, from behind", ("y (mm)", "z (mm)"), down=True)
    return figure


def rolled_axle(figure: Figure, axle: Axle, standing: Stance, half_width: float = 0.12) -> Figure:
    """Draw the car from behind on its two contact points, in road axes (figure 3.8)."""
    axes = figure.subplots()
    roll, height = float(standing.roll[0]), float(standing.height[0])
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    origin = np.array([0.0, axle.reference_plane])

    def on_road(y: Any, z: Any) -> Array:
        """Chassis points in road axes, mm: the reference plane's middle lies at the ride height."""
        points = np.column_stack((np.ravel(y), np.ravel(z))) - origin
        placed: Array = 1e3 * (points @ turn.T + np.array([0.0, height]))
        return placed

    body = on_road(
        [-0.35, 0.35, 0.35, 0.12, -0.12, -0.35], [*2 * (axle.reference_plane,), 0.1, -0.3, -0.3, 0.1]
    )
    axes.fill(*body.T, color="#E8E8E8", edgecolor="black")
    axes.plot(
        *on_road([-0.9, 0.9], 2 * [axle.reference_plane]).T,
        color=BLUE,
        linestyle="dashed",
        label="reference plane",
    )
    for contact in (standing.contact_left[0], standing.contact_right[0]):
        y = contact[1] + half_width * np.array([-1.0, 1.0, 1.0, -1.0])
        axes.fill(*on_road(y, contact[2] - np.array([0.0, 0.0, 0.64, 0.64])).T, color=GREY, alpha=0.6)
    axes.axhline(0.0, color="black", linewidth=1.5, label="road")
    axes.plot([-900, 900], 2 * [1e3 * height], color=GREY, linewidth=0.8, linestyle="dotted")
    axes.annotate("", (520, 0), (520, 1e3 * height), arrowprops={"arrowstyle": "<->"})
    axes.annotate(
        f"$h$ = {1e3 * height:.1f} mm",
        (530, 500 * height),
        (30, 46),
        textcoords="offset points",
        arrowprops={"arrowstyle": "-", "color": GREY},
    )
    axes.annotate(
        f"φ = {np.degrees(roll):.2f}°",
        on_road(-0.9, axle.reference_plane)[0],
        (0, 16),
        textcoords="offset points",
    )
    axes.legend(frameon=False, loc="upper right")
    _frame(axes, "rear axle from behind, in road axes", ("y (mm)", "z (mm)"), down=True)
    return figure


def _grouped(letter: str, points: Array, axes: tuple[int, int]) -> list[tuple[str, Array]]:
    """Return points that coincide in a view under one label."""
    groups: list[tuple[list[int], Array]] = []
    for i, point in enumerate(1e3 * points[:, axes]):
        for members, at in groups:
            if np.linalg.norm(point - at) < _ONE_LABEL:
                members.append(i + 1)
                break
        else:
            groups.append(([i + 1], point))
    return [("$" + ",".join(f"{letter}_{i}" for i in members) + "$", at) for members, at in groups]


def _spring(axes: Axes, start: Array, end: Array, coils: int = 9) -> None:
    share = np.linspace(0.0, 1.0, 4 * coils + 1)
    sideways = np.array([-(end - start)[1], (end - start)[0]]) / np.linalg.norm(end - start)
    swing = 9.0 * np.sin(2.0 * np.pi * coils * share) * (share > 0.15) * (share < 0.85)
    path = start + share[:, None] * (end - start) + swing[:, None] * sideways
    axes.plot(*path.T, color=BLUE, linewidth=1.3)


def _arrow(
    axes: Axes,
    at: Array,
    force: Array,
    scale: float,
    colour: str,
    label: str,
    end: str,
    offset: tuple[int, int],
) -> None:
    foot, tip = 1e3 * at[1:], 1e3 * at[1:] + scale * force[1:]
    line = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(tip), tuple(foot), arrowprops=line)
    place = tuple(tip) if end == "tip" else tuple(foot)
    axes.annotate(label, place, offset, textcoords="offset points", fontsize="small", color=colour)


def _frame(axes: Axes, title: str, labels: tuple[str, str], *, down: bool) -> None:
    axes.set_title(title, fontsize="medium")
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    axes.set_aspect("equal", adjustable="datalim")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#EEEEEE", linewidth=0.6)
    axes.set_axisbelow(True)
    if down:
        axes.invert_yaxis()
