"""Suspension models: normal tyre loads to ride heights and roll angles."""

from thesislib.suspension.metamodel import Metamodel, Posture

__all__ = ["Metamodel", "Posture"]
