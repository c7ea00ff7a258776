"""A lap that no solver made: a smooth closed road and smooth channels, the same at every run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from thesislib.lap.setups import Setup, Start


class SyntheticTrack:
    """A closed road of three lobes, driven clockwise: its curvature swings three times a lap."""

    length = 4650.0

    def __init__(self):
        s = np.linspace(0.0, self.length, 6001)
        theta = 2.0 * np.pi * s / self.length + 0.9 * np.sin(6.0 * np.pi * s / self.length)
        self._heading = CubicSpline(s, theta)
        self._x = CubicSpline(s, np.cos(theta)).antiderivative()
        self._y = CubicSpline(s, np.sin(theta)).antiderivative()

    def curvature(self, s):
        return self._heading(np.mod(s, self.length), 1)

    def heading(self, s):
        return self._heading(np.mod(s, self.length))

    def position(self, s):
        along = np.mod(s, self.length)
        return self._x(along), self._y(along)


class SyntheticLap:
    """Channels of a plausible size on any track; intervals of uneven length, three points in each."""

    name = "synthetic"

    def __init__(self, track, intervals=300):
        self.track = track
        self.period = track.length
        grid = np.linspace(0.0, 1.0, intervals + 1)
        self.mesh_points = track.length * (grid + 0.02 * np.sin(6.0 * np.pi * grid) / (2.0 * np.pi))
        # the Legendre-Gauss-Radau points of three on 0 .. 1
        radau = np.array([0.0, (4.0 - np.sqrt(6.0)) / 10.0, (4.0 + np.sqrt(6.0)) / 10.0])
        self.s = (self.mesh_points[:-1, None] + np.diff(self.mesh_points)[:, None] * radau).ravel()
        self._channels = self._all_channels(track.curvature(self.s))
        slowness = self._channels["slowness"]
        s = np.append(self.s, track.length)
        pace = np.append(slowness, slowness[0])
        t = np.concatenate(([0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * np.diff(s))))
        self.t, self.time = t[:-1], float(t[-1])

    def _all_channels(self, curvature):
        wave = 2.0 * np.pi * self.s / self.track.length
        u = gaussian_filter1d(np.sqrt(32.0 / (np.abs(curvature) + 32.0 / 86.0**2)), 12.0, mode="wrap")
        a_x = u * np.gradient(u, self.s)
        a_y = np.clip(u**2 * curvature, -35.0, 35.0)
        drive = 660.0 * a_x + 0.57 * 1.5 * u**2
        channels = {
            "n": 4.0 * np.tanh(2.0 * np.sin(3.0 * wave)),
            "xi": 0.02 * np.cos(3.0 * wave),
            "v": -0.01 * u * np.tanh(a_y / 10.0),
            "u": u,
            "slowness": 1.0 / u,
            "omega": u * curvature,
            "delta": 0.1 * np.tanh(a_y / 15.0),
            "a_x": a_x,
            "a_y": a_y,
            "beta": -0.01 * np.tanh(a_y / 10.0),
            "h_f": -0.0137 + 0.0287 * (u / 86.0) ** 2,
            "h_r": -0.074 + 0.036 * (u / 86.0) ** 2,
            "phi_f": -0.032 * np.tanh(a_y / 15.0),
            "phi_r": -0.032 * np.tanh(a_y / 15.0),
            "C_L_front": 1.5 + 0.1 * np.sin(wave),
            "C_L_rear": 1.4 + 0.1 * np.cos(wave),
            "u_CoP": 0.2 + 0.01 * a_x,
            "C_D": 0.951 + 0.001 * np.sin(wave),
            "power": np.minimum(np.maximum(drive * u, 0.0), 560e3),
        }
        pressure = 0.5 * 1.2 * 1.5 * u**2
        channels["F_az_front"] = pressure * channels["C_L_front"]
        channels["F_az_rear"] = pressure * channels["C_L_rear"]
        channels["F_ax"] = -pressure * channels["C_D"]
        for wheel in ("fl", "fr", "rl", "rr"):
            share = 0.3 if wheel[0] == "f" else 0.2
            side = 0.08 * np.tanh(a_y / 10.0) * (1.0 if wheel[1] == "r" else -1.0)
            braking = np.minimum(drive, 0.0) * share
            driving = np.maximum(drive, 0.0) * (0.0 if wheel[0] == "f" else 0.5)
            channels[f"F_{wheel}x"] = braking + driving
            channels[f"F_{wheel}y"] = 660.0 * a_y * 0.25
            channels[f"F_{wheel}z"] = -2000.0 - 0.25 * pressure
            channels[f"kappa_{wheel}"] = 0.1 * np.tanh((braking + driving) / 3000.0)
            channels[f"rho_{wheel}"] = 0.1 + 0.65 * np.tanh(np.hypot(a_x, a_y) / 12.0) * (1.0 + side)
            channels[f"Omega_{wheel}"] = u / 0.33
        return channels

    def __getitem__(self, name):
        return self._channels[name]

    def activity(self, name):
        return {
            "power": self["power"] >= 560e3 - 1.0,
            "ride_height": self["h_f"] >= 0.0149,
            "left_edge": self["n"] <= -3.8,
            "right_edge": self["n"] >= 3.8,
            "kappa_front": np.zeros(self.s.shape, dtype=bool),
            "kappa_rear": self["kappa_rl"] >= 0.099,
        }[name]


@pytest.fixture(scope="session")
def synthetic_lap():
    return SyntheticLap(SyntheticTrack())


@pytest.fixture(scope="session")
def corners():
    third = SyntheticTrack.length / 3.0
    return [(1, 0.1 * third, "R"), (2, third, "L"), (3, third + 100.0, "R"), (4, 2.0 * third, "R")]


@pytest.fixture(scope="session")
def marks():
    """A function that finds the plotted points of the artists with given properties."""

    def plotted(axes, **properties):
        found = [
            line
            for line in axes.get_lines()
            if all(getattr(line, f"get_{name}")() == value for name, value in properties.items())
        ]
        return [tuple(point) for line in found for point in line.get_xydata()]

    return plotted


OVAL_M, STATIONS = 700.0, 140


@pytest.fixture(scope="session")
def oval(tmp_path_factory):
    """Path of a road file: 700 m, two fast corners and two that are six times as sharp."""
    s = np.linspace(0.0, OVAL_M, 20 * STATIONS + 1)
    swing = 4.0 * np.pi / OVAL_M
    theta = 2.0 * np.pi * s / OVAL_M + 0.35 * np.sin(swing * s)
    curvature = 2.0 * np.pi / OVAL_M + 0.35 * swing * np.cos(swing * s)
    x, y = (cumulative_simpson(direction(theta), x=s, initial=0.0) for direction in (np.cos, np.sin))
    columns = np.column_stack((s, curvature, np.full(s.shape, 6.0), np.full(s.shape, 6.0), x, y, theta))
    head = ["# name: oval", f"# period_m: {OVAL_M:.6f}", "# source: geometry", "# licence: CC0-1.0"]
    rows = [",".join(f"{value:.9f}" for value in row) for row in columns[:-1:20]]
    path = tmp_path_factory.mktemp("roads") / "oval.csv"
    names = "s_m,curvature_1pm,w_right_m,w_left_m,x_m,y_m,theta_rad"
    path.write_text("\n".join([*head, names, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def start(oval, tmp_path_factory):
    """The car's lap of the oval, solved coarsely and kept on disk."""
    folder = tmp_path_factory.mktemp("laps")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("THESIS_STORE", str(folder / "store"))
        kept = Start(Setup(track=str(oval)), 2e-2, 14.0, str(folder / "oval.npz"))
        assert not kept.solve("oval")
        yield kept
