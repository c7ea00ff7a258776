"""Both axles in three dimensions, to be turned by the reader: plotly, from the script the site carries.

The reader turns, zooms and points at joints to read their names and places. Nothing is fetched
from elsewhere; without the script or without JavaScript a sentence says what is missing.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from string import Template
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from thesislib.suspension.axle import MIRROR, Axle
from thesislib.suspension.drawings import COLOURS, wheel_outline
from thesislib.suspension.figures import BLUE, GREEN, GREY, VERMILION

Array = NDArray[np.float64]

SCRIPT: Final = "plotly/plotly.min.js"
"""Where the shared script lies, seen from a page."""

_PAGE: Final = Template("""\
<div id="$id" role="group" aria-label="$label">
<p class="turnable-note">The turnable view needs JavaScript and the file $script beside this page; figure 3.1
shows the same axles without them.</p>
<div class="turnable-view" role="img" aria-label="$label" style="display:none;height:30rem"></div>
</div>
<script>
(function () {
  "use strict";
  const root = document.getElementById("$id");
  const traces = $data;
  const view = root.querySelector(".turnable-view");

  function colours() {
    const ink = window.getComputedStyle(root).color;
    const grid = "rgba(128,128,128,0.3)";
    const change = {"font.color": ink};
    for (const axis of ["xaxis", "yaxis", "zaxis"]) {
      change["scene." + axis + ".gridcolor"] = grid;
      change["scene." + axis + ".zerolinecolor"] = grid;
    }
    return change;
  }

  function draw() {
    root.querySelector(".turnable-note").style.display = "none";
    view.style.display = "block";
    const axis = (title, extra) => Object.assign({title: {text: title}, showbackground: false}, extra);
    Plotly.newPlot(view, traces, {
      paper_bgcolor: "rgba(0,0,0,0)", margin: {l: 0, r: 0, t: 0, b: 0}, font: {size: 12},
      legend: {orientation: "h", y: 0}, hovermode: "closest",
      scene: {
        aspectmode: "data",
        xaxis: axis("x, forward (m)"), yaxis: axis("y, right (m)", {autorange: "reversed"}),
        zaxis: axis("z, down (m)", {autorange: "reversed", nticks: 4}),
        camera: {eye: {x: 1.5, y: 1.8, z: 0.9}},
      },
    }, {displaylogo: false, responsive: true, scrollZoom: false}).then(function () {
      Plotly.relayout(view, colours());
      new MutationObserver(() => Plotly.relayout(view, colours()))
        .observe(document.documentElement, {attributes: true});
    });
  }

  if (window.Plotly) {
    draw();
    return;
  }
  let loader = document.getElementById("plotly-script");
  if (!loader) {
    loader = document.createElement("script");
    loader.id = "plotly-script";
    loader.src = "$script";
    document.head.appendChild(loader);
  }
  loader.addEventListener("load", draw);
})();
</script>
""")


@dataclass(frozen=True)
class TurnableAxles:
    """A scene of both axles; shows itself in a notebook and on a page.

    Attributes
    ----------
    traces : list of dict
        Plotly's traces, coordinates in m.
    label : str
        What a screen reader says of the figure.
    """

    traces: list[dict[str, Any]]
    label: str

    def _repr_html_(self) -> str:
        text = json.dumps(self.traces, separators=(",", ":"), sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()
        # the same axles have the same name at every run, so that a page changes only with its data
        return _PAGE.substitute(
            id=f"turnable-axles-{digest[:12]}", label=self.label, script=SCRIPT, data=text
        )

    def __repr__(self) -> str:
        return f"{self.label}: an interactive figure for a page"


def turnable_axles(front: Axle, rear: Axle, wheelbase: float) -> TurnableAxles:
    """Return both axles as a scene; `wheelbase` in m."""
    traces: list[dict[str, Any]] = []
    groups: dict[str, tuple[str, float]] = {
        "wishbones": (COLOURS[0], 6.0),
        "track rods": (COLOURS[4], 6.0),
        "push and pull rods": (GREEN, 6.0),
        "rockers": (VERMILION, 4.0),
        "heave springs": (BLUE, 5.0),
        "wheels": (GREY, 2.0),
    }
    lines: dict[str, list[Array]] = {name: [] for name in groups}
    names: list[str] = []
    points: list[Array] = []
    for axle, x in ((front, 0.0), (rear, -wheelbase)):
        shift = np.array([x, 0.0, 0.0])
        lines["heave springs"].append(np.stack((axle.spring_end, axle.spring_end * MIRROR)) + shift)
        for which, side in (("left", np.ones(3)), ("right", MIRROR)):
            kinds = (*4 * ("wishbones",), "track rods", "push and pull rods")
            for kind, inner, outer in zip(kinds, axle.inner_ends, axle.carrier, strict=True):
                lines[kind].append(np.stack((inner, outer)) * side + shift)
            corners = np.stack((axle.pivot, axle.rod_end, axle.spring_end, axle.pivot))
            lines["rockers"].append(corners * side + shift)
            lines["wheels"] += [circle + shift for circle in wheel_outline(axle, side)]
            for letter, ends in (("P", axle.inner_ends), ("Q", axle.carrier)):
                names += [f"{axle.name}, {which}: {letter}{i}" for i in range(1, len(ends) + 1)]
                points += list(ends * side + shift)
    for name, (colour, width) in groups.items():
        path = dict(zip("xyz", _joined(lines[name]), strict=True))
        line = {"color": "#888888" if colour == COLOURS[0] else colour, "width": width}
        traces.append(
            {
                "type": "scatter3d",
                "mode": "lines",
                "name": name,
                **path,
                "line": line,
                "hoverinfo": "name",
            }
        )
    where = np.round(np.array(points), 4)
    traces.append(
        {
            "type": "scatter3d",
            "mode": "markers",
            "name": "joints",
            "x": where[:, 0].tolist(),
            "y": where[:, 1].tolist(),
            "z": where[:, 2].tolist(),
            "text": names,
            "marker": {"size": 3, "color": BLUE},
            "hovertemplate": "%{text}<br>x %{x:.3f}, y %{y:.3f}, z %{z:.3f} m<extra></extra>",
        }
    )
    return TurnableAxles(traces, "Both axles of the car with links, rockers, heave springs and wheels")


def _joined(lines: list[Array]) -> tuple[list[float | None], ...]:
    """Return the coordinates of several lines as one, with gaps between them."""
    columns: tuple[list[float | None], ...] = ([], [], [])
    for line in lines:
        for column, values in zip(columns, np.round(line, 4).T, strict=True):
            column += [*values.tolist(), None]
    return columns
