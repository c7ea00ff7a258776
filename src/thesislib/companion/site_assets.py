"""Scripts that the pages need, copied from the installed packages that bring them.

No page fetches anything from a server, and nothing of this is kept in the repository: MathJax comes
from the wheel of ``sphinx-mathjax-offline``, plotly.js from that of ``plotly``. Both land at the top of
the site, beside the pages. They must not lie below ``_static``: Jupyter Book 1 loads every script it
finds there on every page.
"""

from __future__ import annotations

import shutil
from importlib import metadata
from pathlib import Path

__all__ = ["EXTRA", "MATHJAX", "PLOTLY", "copy_mathjax", "copy_plotly"]

EXTRA = "_extra"
"""Folder of the staged book whose content goes to the top of the site (``html_extra_path``)."""

MATHJAX = "mathjax/tex-chtml-full.js"
"""MathJax relative to the top of the site; its fonts lie where it looks for them."""

PLOTLY = "plotly/plotly.min.js"
"""plotly.js relative to the top of the site, which is the folder of every page."""

# plotly.js names its licence in its first lines; MathJax's combined script does not.
_NOTICE = """\
MathJax, copyright the MathJax Consortium, under the Apache License 2.0
(https://www.apache.org/licenses/LICENSE-2.0). Unchanged files of the package
sphinx-mathjax-offline {version}.
"""

_MATHJAX_SOURCE = "sphinx-mathjax-offline/static/mathjax"
_FONTS = "output/chtml/fonts/woff-v2"


def copy_mathjax(extra: Path) -> None:
    """Copy MathJax's one combined script and its fonts (1.7 MB of the wheel's 24) below `extra`.

    Raises
    ------
    FileNotFoundError
        If the installed wheel does not hold them where it did.
    """
    source = _installed("sphinx-mathjax-offline", _MATHJAX_SOURCE)
    target = (extra / MATHJAX).parent
    target.mkdir(parents=True)
    shutil.copyfile(source / Path(MATHJAX).name, extra / MATHJAX)
    shutil.copytree(source / _FONTS, target / _FONTS)
    notice = _NOTICE.format(version=metadata.version("sphinx-mathjax-offline"))
    (target / "NOTICE.txt").write_text(notice, encoding="utf-8")


def copy_plotly(extra: Path) -> None:
    """Copy plotly.js (4.8 MB) below `extra`.

    Raises
    ------
    FileNotFoundError
        If the installed wheel does not hold it where it did.
    """
    target = extra / PLOTLY
    target.parent.mkdir(parents=True)
    shutil.copyfile(_installed("plotly", "plotly/package_data/plotly.min.js"), target)


def _installed(package: str, path: str) -> Path:
    """Locate a file or folder of an installed package without importing it."""
    found = Path(str(metadata.distribution(package).locate_file(path)))
    if not found.exists():
        raise FileNotFoundError(f"The package {package} {metadata.version(package)} holds no {path}.")
    return found
