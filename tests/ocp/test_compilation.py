import hashlib
import logging
import os
import stat
import subprocess
import sys

import casadi as ca
import pytest

from thesislib.ocp import compilation

needs_compiler = pytest.mark.usefixtures("compiler")

SOLVES = """
import logging, sys
logging.basicConfig(stream=sys.stdout, format="%(levelname)s %(message)s")
from thesislib import ocp
for name in ("one", "two"):
    problem = ocp.Problem(
        name, ocp.Independent(), [ocp.State("x")],
        lambda p: ocp.Equations({"x": p.u}, integrands={"effort": p.u**2 + p.x**4}),
        controls=[ocp.Control("u")], lagrange="effort", initial={"x": 1}, terminal={"x": 0},
    )
    solution = ocp.solve(problem)
    print(solution.compiled, repr(solution.objective))
"""


@pytest.fixture
def compiler() -> str:
    """The compiler that the lock's machines have; its absence has tests of its own."""
    found = compilation.find_compiler()
    assert found, "these tests need a C compiler: install one, or run the rest of the suite"
    return found


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "thesislib"


def square(name: str = "square") -> list[ca.Function]:
    x = ca.SX.sym("x")
    return [ca.Function(name, [x], [x * x])]


def solved(tmp_path, **environment: str) -> str:
    given = {name: value for name, value in os.environ.items() if name not in ("THESIS_COMPILE", "CC")}
    given |= {"XDG_CACHE_HOME": str(tmp_path), "OMP_NUM_THREADS": "1", **environment}
    done = subprocess.run(
        [sys.executable, "-c", SOLVES], env=given, cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers(output: str) -> list[float]:
    return [float(line.split()[1]) for line in output.splitlines() if line.startswith(("True", "False"))]


@needs_compiler
def test_solves_need_no_compiler_and_say_so_once(tmp_path):
    compiled = solved(tmp_path)
    without = solved(tmp_path, PATH=str(tmp_path / "nothing"))
    assert compiled.count("True ") == 2 and "WARNING" not in compiled
    assert without.count("False ") == 2
    assert without.count("WARNING no C compiler found; derivatives run on CasADi's virtual machine") == 1
    # the same operations in the same order, without contraction: the solves take the same path
    assert numbers(without) == pytest.approx(numbers(compiled), rel=1e-12)


@needs_compiler
def test_compilation_can_be_declined_and_is_then_not_complained_about(tmp_path):
    output = solved(tmp_path, THESIS_COMPILE="0")
    assert output.count("False ") == 2 and "WARNING" not in output
    assert not (tmp_path / "thesislib").exists()


@needs_compiler
def test_library_is_built_once_and_found_again(cache):
    compilation.compiled(square(), True)
    (library,) = cache.glob("*.so")
    built = library.stat().st_mtime_ns
    assert float(compilation.compiled(square(), True)[0](3.0)) == 9.0
    assert library.stat().st_mtime_ns == built
    compilation.compiled(square("other"), True)
    assert len(list(cache.glob("*.so"))) == 2


@needs_compiler
@pytest.mark.parametrize("damage", ["library", "hash"])
def test_library_that_was_tampered_with_is_rebuilt_before_it_is_loaded(cache, damage):
    name = f"tampered_{damage}"
    compilation.compiled(square(name), True)
    (library,) = cache.glob("*.so")
    victim = library if damage == "library" else library.with_suffix(".sha256")
    victim.unlink()
    victim.write_bytes(b"not what the compiler made")
    assert float(compilation.compiled(square(name), True)[0](3.0)) == 9.0
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    assert library.with_suffix(".sha256").read_text() == digest


@needs_compiler
def test_nothing_half_built_stays_in_the_cache(cache):
    compilation.compiled(square(), True)
    assert sorted(path.suffix for path in cache.iterdir()) == [".sha256", ".so"]


@needs_compiler
def test_compiler_that_fails_is_told_once_with_its_words_and_done_without(
    cache, monkeypatch, tmp_path, caplog
):
    broken = tmp_path / "cc"
    broken.write_text("#!/bin/sh\necho out of paper >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr(compilation, "find_compiler", lambda: str(broken))
    compilation._say_once.cache_clear()
    functions = square("unbuilt")
    for _ in range(2):
        assert compilation.compiled(functions, True) is functions
    (record,) = caplog.records
    assert "cc fails with status 3: out of paper; derivatives run on CasADi's virtual" in record.getMessage()
    assert list(cache.iterdir()) == []


def test_cache_is_readable_by_its_owner_only(cache):
    cache.mkdir(mode=0o755)
    assert compilation.cache_folder() == cache
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700


def test_cache_falls_back_to_the_build_folder(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("THESIS_ROOT", raising=False)
    monkeypatch.chdir(tmp_path)
    assert compilation.cache_folder() == tmp_path / "_build" / "cache"
    assert stat.S_IMODE((tmp_path / "_build" / "cache").stat().st_mode) == 0o700


def test_cache_of_a_run_falls_back_to_its_project_and_not_to_where_it_works(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "book").mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setenv("THESIS_ROOT", str(tmp_path))
    monkeypatch.chdir(tmp_path / "book")
    assert compilation.cache_folder() == tmp_path / "_build" / "cache"
    assert list((tmp_path / "book").iterdir()) == []


def test_cache_without_any_place_is_refused(tmp_path, monkeypatch):
    (tmp_path / "_build").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "_build"))
    monkeypatch.delenv("THESIS_ROOT", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PermissionError, match=r"neither .* nor _build/cache can be written"):
        compilation.cache_folder()


def test_cache_of_somebody_else_is_refused(cache, monkeypatch):
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(PermissionError, match="belongs to another user"):
        compilation.cache_folder()


def test_missing_compiler_is_said_once_in_a_process(cache, monkeypatch, caplog):
    monkeypatch.setattr(compilation, "find_compiler", lambda: None)
    compilation._say_once.cache_clear()
    with caplog.at_level(logging.WARNING):
        functions = square()
        assert compilation.compiled(functions) is functions
        compilation.compiled(functions)
    assert len(caplog.records) == 1
