"""Colours of this room's plots: those of Okabe and Ito, which stay apart for colour-blind readers."""

from __future__ import annotations

from typing import Final

BLACK: Final = "#000000"
BLUE: Final = "#0072B2"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
VERMILION: Final = "#D55E00"
GREY: Final = "#767676"
LIGHT: Final = "#D9D9D9"
