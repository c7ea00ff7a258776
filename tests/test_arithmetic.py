"""Digits repeat because every process starts with the same threads and the same kernel."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from thesislib import arithmetic

_PRODUCT = """
import numpy as np
rng = np.random.default_rng(7)
A = rng.standard_normal((120, 120))
print((A @ A.T).tobytes().hex(), np.linalg.inv(A).tobytes().hex())
"""


def _computed(environment: dict[str, str]) -> str:
    given = {k: v for k, v in os.environ.items() if not k.startswith(("OMP_", "OPENBLAS_", "MKL_"))}
    run = subprocess.run(
        [sys.executable, "-c", _PRODUCT], env=given | environment, capture_output=True, text=True, check=True
    )
    return run.stdout


def _extensions(*found: str) -> dict[str, dict[str, list[str]]]:
    return {"SIMD Extensions": {"baseline": ["X86_V2"], "found": list(found)}}


@pytest.fixture(autouse=True)
def _asked_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENBLAS_CORETYPE", raising=False)
    monkeypatch.setattr(arithmetic, "_runs_kernel", arithmetic._runs_kernel.__wrapped__)


def test_a_kernel_is_named_only_where_the_processor_runs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "show_config", lambda mode: _extensions("X86_V3", "X86_V4"))
    assert arithmetic.environment()["OPENBLAS_CORETYPE"] == arithmetic.KERNEL
    monkeypatch.setattr(np, "show_config", lambda mode: _extensions())
    assert "OPENBLAS_CORETYPE" not in arithmetic.environment()


def test_a_readers_own_kernel_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Nehalem")
    assert arithmetic.environment()["OPENBLAS_CORETYPE"] == "Nehalem"


def test_the_kernel_decides_on_last_digits_and_the_environment_fixes_it() -> None:
    if "OPENBLAS_CORETYPE" not in arithmetic.environment():
        pytest.skip("this processor lacks the kernel's instructions")
    ours = _computed(arithmetic.environment())
    assert ours == _computed(arithmetic.environment() | {"OPENBLAS_CORETYPE": "Haswell"})
    assert ours != _computed(arithmetic.environment() | {"OPENBLAS_CORETYPE": "Prescott"})
