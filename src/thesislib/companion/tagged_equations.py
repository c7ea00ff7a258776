r"""A Sphinx extension: displayed equations of several lines keep the thesis's number.

The thesis's numbers are written into the equations, ``$$ ... \tag{4.16} $$``. Sphinx wraps whatever
has a line break ``\\`` in it (a matrix is enough) into ``split``, and in there MathJax accepts
no ``\tag``: the reader would see an error in the place of the equation, and the build would not.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

__all__ = ["numbered", "setup"]

_TAG = re.compile(r"\\tag\*?\{[^{}]*\}")
_OWN_ENVIRONMENT = re.compile(r"\s*\\begin\{(align|alignat|equation|flalign|gather|multline)\*?\}")


def numbered(source: str) -> str | None:
    r"""Return the LaTeX of a tagged display as an environment of its own; None if it can stay.

    Parameters
    ----------
    source : str
        What stands between the ``$$``.

    Examples
    --------
    >>> print(numbered(r"a \\ b \tag{2.1}"))
    \begin{equation}\begin{split}a \\ b\end{split}\tag{2.1}\end{equation}
    >>> numbered(r"a = b \tag{2.1}")
    """
    if _OWN_ENVIRONMENT.match(source):
        return source.strip()
    tags = _TAG.findall(source)
    if not tags or r"\\" not in source:
        return None
    if len(tags) > 1:
        return rf"\begin{{align}}{source.strip()}\end{{align}}"
    body = _TAG.sub("", source).strip()
    return rf"\begin{{equation}}\begin{{split}}{body}\end{{split}}{tags[0]}\end{{equation}}"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension with Sphinx."""
    app.connect("doctree-read", _number)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _number(app: Sphinx, doctree: nodes.document) -> None:
    for block in doctree.findall(nodes.math_block):
        latex = numbered(block.astext())
        if latex is not None:
            block["nowrap"] = True
            block.children = [nodes.Text(latex)]
