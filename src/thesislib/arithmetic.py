"""What lets a computation repeat its digits: one thread for the linear algebra, and one kernel of OpenBLAS.

Sums taken in another order differ in their last digits. A lap does not mind, but a search for a certificate
that accepts or refuses each of its steps may go another way. By itself OpenBLAS takes the kernel that is
fastest on the processor it finds.
"""

from __future__ import annotations

import os
from functools import cache

__all__ = ["KERNEL", "environment"]

KERNEL = "Haswell"
"""Kernel of OpenBLAS for x86 processors with AVX2 and FMA; those with AVX-512 run it, too."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_CORE_TYPE = "OPENBLAS_CORETYPE"


def environment() -> dict[str, str]:
    """Return the variables that a process has to start with for its digits to repeat.

    A kernel that the reader has chosen stays, and none is named where the processor lacks the instructions.
    """
    ours = dict.fromkeys(_THREADS, "1")
    if _CORE_TYPE in os.environ:
        return ours | {_CORE_TYPE: os.environ[_CORE_TYPE]}
    return ours | {_CORE_TYPE: KERNEL} if _runs_kernel() else ours


@cache
def _runs_kernel() -> bool:
    """Whether the processor has AVX2 and FMA, which numpy lists as the third level of x86-64."""
    import numpy as np

    extensions = np.show_config(mode="dicts")["SIMD Extensions"]
    return "X86_V3" in {*extensions["baseline"], *extensions.get("found", ())}
