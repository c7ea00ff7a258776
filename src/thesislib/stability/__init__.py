"""Regions of attraction of a car's equilibria, certified by sums of squares (chapter 7)."""
