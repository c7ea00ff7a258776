"""Executable companion to *Optimal Control and Stability of Four-Wheeled Vehicles*."""

__version__ = "0.1.0"
