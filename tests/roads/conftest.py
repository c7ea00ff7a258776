"""Roads for tests: the real circuit, and a small one with a known shape."""

from pathlib import Path

import numpy as np
import pytest

from thesislib import roads

RADIUS_M = 100.0
STATIONS = 40


@pytest.fixture(scope="session")
def barcelona() -> roads.CentreLine:
    return roads.load("barcelona")


@pytest.fixture
def circle_lines() -> list[str]:
    """The lines of a valid road file: a circle of 100 m radius, driven clockwise from its northern point."""
    angle = 2 * np.pi * np.arange(STATIONS) / STATIONS
    rows = [
        f"{RADIUS_M * a:.4f},{1 / RADIUS_M:.9f},5.0,6.0,{RADIUS_M * np.sin(a):.4f},"
        f"{RADIUS_M * (1 - np.cos(a)):.4f},{a:.6f}"
        for a in angle
    ]
    head = [
        "# name: circle",
        f"# period_m: {2 * np.pi * RADIUS_M:.6f}",
        "# source: geometry",
        "# licence: CC0-1.0",
    ]
    return [*head, "s_m,curvature_1pm,w_right_m,w_left_m,x_m,y_m,theta_rad", *rows]


@pytest.fixture
def write_road(tmp_path):
    """Return a function that writes lines to ``road.csv`` and returns its path."""

    def write(lines: list[str]) -> Path:
        path = tmp_path / "road.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write
