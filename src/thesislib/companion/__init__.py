"""Chapters as data: run them, record what they show, check it, list it, build the site."""

from thesislib.companion.records import Record, Series

__all__ = ["Record", "Series"]
