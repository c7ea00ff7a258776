"""The speed along the lap beside the map of the track: pointing at one marks the other.

The page needs ``plotly/plotly.min.js`` beside it, which the site puts there once for all pages; nothing
is fetched from elsewhere. Without that file or without JavaScript a sentence says what is missing.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from string import Template
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from .channels import Lap, along_lap, beside, speed
from .maps import places_beside_road
from .style import BLUE, MPS_TO_KMH, ORANGE, PURPLE, VERMILION, Corner, corner_rows

SCRIPT: Final = "plotly/plotly.min.js"
"""Where the shared script lies, seen from a page."""

_PAGE: Final = Template("""\
<div id="$id" class="linked-lap" role="group" aria-label="$label">
<p class="linked-lap-note">The interactive speed trace and track map need JavaScript and the file
$script beside this page; figures 4.6 and 4.7 show the same lap without them.</p>
<div class="linked-lap-panels" style="display:none;flex-wrap:wrap;gap:0.5rem">
<div class="linked-lap-trace" role="img" aria-label="Speed along the lap"
 style="flex:3 1 21rem;min-width:0;height:24rem;overflow:hidden"></div>
<div class="linked-lap-map" role="img" aria-label="Map of the track, north up, coloured by speed"
 style="flex:2 1 17rem;min-width:0;height:24rem;overflow:hidden"></div>
<label style="flex:1 1 100%;display:flex;flex-wrap:wrap;align-items:center;gap:0.75rem">Place on the lap
<input type="range" min="0" value="0" style="flex:1 1 12rem;min-height:2rem">
<output style="flex:0 0 auto;min-width:19em;font-variant-numeric:tabular-nums"></output></label>
</div>
</div>
<script>
(function () {
  "use strict";
  const root = document.getElementById("$id");
  const lap = $data;
  const trace = root.querySelector(".linked-lap-trace");
  const map = root.querySelector(".linked-lap-map");
  const slider = root.querySelector("input");
  const readout = root.querySelector("output");
  // a finger scrolls the page; only a mouse may drag a zoom
  const dragmode = window.matchMedia("(pointer: fine)").matches ? "zoom" : false;
  let wanted = 0, pending = false;

  function mark() {
    pending = false;
    const i = wanted;
    Plotly.restyle(trace, {x: [[lap.s[i]]], y: [[lap.v[i]]]}, [1]);
    Plotly.restyle(map, {x: [[lap.x[i]]], y: [[lap.y[i]]]}, [1]);
    slider.value = i;
    const place = lap.s[i].toFixed(0) + " m, " + lap.v[i].toFixed(0) + " km/h, " + lap.t[i].toFixed(2) + " s";
    readout.textContent = place;
    slider.setAttribute("aria-valuetext", place);
  }

  function point(i) {
    wanted = i;
    if (!pending) {
      pending = true;
      window.requestAnimationFrame(mark);
    }
  }

  function hovered(event) {
    const hit = event.points.find((candidate) => candidate.curveNumber === 0);
    if (hit) point(hit.pointIndex);
  }

  function colours() {
    const ink = window.getComputedStyle(root).color;
    const grid = "rgba(128,128,128,0.3)";
    return {"font.color": ink, "xaxis.gridcolor": grid, "yaxis.gridcolor": grid,
            "xaxis.zerolinecolor": grid, "yaxis.zerolinecolor": grid};
  }

  function recolour() {
    const ink = window.getComputedStyle(root).color;
    for (const panel of [trace, map]) {
      Plotly.relayout(panel, colours());
      Plotly.restyle(panel, {"marker.line.color": ink}, [1]);
    }
  }

  function layout(extra) {
    return Object.assign({
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: {size: 13},
      showlegend: false, dragmode: dragmode, hoverlabel: {font: {size: 13}},
    }, extra);
  }

  function draw() {
    root.querySelector(".linked-lap-note").style.display = "none";
    root.querySelector(".linked-lap-panels").style.display = "flex";
    slider.max = lap.s.length - 1;
    const marker = {size: 13, color: "$mark", line: {width: 2}};
    const config = {displayModeBar: false};
    const numbers = lap.corners.map((corner) => ({
      x: corner.s, xref: "x", y: 1, yref: "paper", yanchor: "bottom", yshift: 12 * corner.row,
      text: corner.number, showarrow: false, font: {size: 11},
    }));
    const lines = lap.corners.map((corner) => ({
      type: "line", x0: corner.s, x1: corner.s, y0: 0, y1: 1, yref: "paper", layer: "below",
      line: {width: 1, color: "rgba(128,128,128,0.35)"},
    }));
    const scale = {color: lap.v, colorscale: $scale, size: 5,
                   colorbar: {orientation: "h", y: -0.17, yanchor: "top", thickness: 10, len: 0.9,
                              title: {text: "speed (km/h)", side: "bottom"}}};
    Promise.all([
      Plotly.newPlot(trace, [
        {x: lap.s, y: lap.v, mode: "lines", line: {color: "$line", width: 2},
         hovertemplate: "%{x:.0f} m<br>%{y:.0f} km/h<extra></extra>"},
        {x: [lap.s[0]], y: [lap.v[0]], mode: "markers", marker: marker, hoverinfo: "skip"},
      ], layout({
        hovermode: "x", annotations: numbers, shapes: lines, margin: {l: 52, r: 10, t: 46, b: 46},
        xaxis: {title: {text: "distance along the centre line, s (m)"}, range: [0, lap.length],
                hoverformat: ".0f"},
        yaxis: {title: {text: "speed (km/h)"}, fixedrange: true},
      }), config),
      Plotly.newPlot(map, [
        {x: lap.x, y: lap.y, mode: "markers", marker: scale, customdata: lap.v,
         hovertemplate: "%{customdata:.0f} km/h<extra></extra>"},
        {x: [lap.x[0]], y: [lap.y[0]], mode: "markers", marker: marker, hoverinfo: "skip"},
        {x: lap.corners.map((corner) => corner.x), y: lap.corners.map((corner) => corner.y),
         text: lap.corners.map((corner) => String(corner.number)), mode: "text", hoverinfo: "skip",
         textfont: {size: 11}},
      ], layout({
        hovermode: "closest", hoverdistance: 60, margin: {l: 58, r: 6, t: 10, b: 92},
        xaxis: {title: {text: "x, east (m)", standoff: 4}, nticks: 5},
        yaxis: {title: {text: "y, south (m)", standoff: 4}, autorange: "reversed", scaleanchor: "x",
                nticks: 7},
      }), config),
    ]).then(function () {
      for (const panel of [trace, map]) {
        panel.on("plotly_hover", hovered);
        panel.on("plotly_click", hovered);  // a tap, where nothing hovers
      }
      slider.addEventListener("input", () => point(Number(slider.value)));
      recolour();
      const sizes = new ResizeObserver((entries) => {
        for (const entry of entries) Plotly.Plots.resize(entry.target);
      });
      sizes.observe(trace);
      sizes.observe(map);
      new MutationObserver(recolour).observe(document.documentElement, {attributes: true});
      point(0);
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


def _rounded(values: ArrayLike, digits: int) -> list[float]:
    return [round(float(value), digits) for value in np.asarray(values)]


@dataclass(frozen=True)
class LinkedLap:
    """Speed trace and track map of one lap, linked; shows itself in a notebook and on a page.

    Attributes
    ----------
    data : dict
        What is plotted: lists ``s`` (m), ``t`` (s), ``v`` (km/h), ``x`` and ``y`` (m) of one length,
        ``length`` (m) and ``corners``.
    label : str
        What a screen reader says of the figure.
    """

    data: dict[str, Any]
    label: str

    def _repr_html_(self) -> str:
        text = json.dumps(self.data, separators=(",", ":"), sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()
        return _PAGE.substitute(
            # the same lap has the same name at every run, so that a page changes only with its data
            id=f"linked-lap-{digest[:12]}",
            label=self.label,
            script=SCRIPT,
            data=text,
            line=BLUE,
            mark=VERMILION,
            scale=json.dumps([[0.0, BLUE], [0.5, PURPLE], [1.0, ORANGE]]),
        )

    def __repr__(self) -> str:
        return f"{self.label}: an interactive figure for a page"


def linked_lap(lap: Lap, corners: Sequence[Corner] | None = None, *, points: int = 700) -> LinkedLap:
    """Speed trace and track map of a lap, linked by hover, touch and a slider.

    Parameters
    ----------
    lap : Lap
    corners : sequence of (number, distance in m, direction), optional
        Corners to number on both panels.
    points : int
        Places along the lap, equally spaced, 100 to 2000: more would only make the page heavy.

    Returns
    -------
    LinkedLap

    Raises
    ------
    ValueError
        If `points` is out of its range or a corner lies off the lap.
    """
    if not 100 <= points <= 2000:
        raise ValueError(f"a linked lap of {points} points is outside 100 .. 2000 points")
    length = lap.track.length
    s = np.linspace(0.0, length, points, endpoint=False)
    rows = corner_rows(corners, length)
    places = places_beside_road(
        lap.track, [corner for corner, _ in rows], (0.007, 0.006), (0.01, 0.014, 0.02)
    )
    numbered = [
        {"number": number, "s": round(at, 1), "row": row, "x": round(float(x)), "y": round(float(y))}
        for ((number, at, _), row), (x, y) in zip(rows, places, strict=True)
    ]
    x, y = beside(lap.track, s, along_lap(lap, lap["n"], s))
    data = {
        "s": _rounded(s, 1),
        # elapsed time grows by a lap time every lap and is therefore not periodic
        "t": _rounded(np.interp(s, [*lap.s, length], [*lap.t, lap.time]), 2),
        "v": _rounded(MPS_TO_KMH * along_lap(lap, speed(lap), s), 1),
        "x": _rounded(x, 1),
        "y": _rounded(y, 1),
        "length": round(length, 1),
        "corners": numbered,
    }
    return LinkedLap(data, f"Speed along the lap and map of the track, lap time {lap.time:.2f} s")
