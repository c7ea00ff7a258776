"""Chapters as data: run them, record what they show, check it, list it, build the site."""

__all__: list[str] = []
