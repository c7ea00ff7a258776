"""Make the project's environment: ``python3 scripts/bootstrap.py``.

This file keeps to a grammar that every Python since 2.7 can read, so that an unsuitable one
answers with a sentence and not with a syntax error; the work is in ``installation.py``.
"""

import sys

SUITABLE = ((3, 11), (3, 12), (3, 13))

if sys.version_info[:2] not in SUITABLE:
    sys.exit(
        "This project needs Python 3.11, 3.12 or 3.13, and this is Python "
        + ".".join(str(part) for part in sys.version_info[:3])
        + " ("
        + str(sys.executable)
        + ").\nName a suitable one, for example: make book PYTHON=python3.12"
    )

if __name__ == "__main__":
    import installation

    sys.exit(installation.main())
