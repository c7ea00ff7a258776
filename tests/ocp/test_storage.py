import json
import zipfile
from dataclasses import fields

import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp.storage import load, save


@pytest.fixture(scope="module")
def solution(everything):
    return ocp.solve(everything(), tolerance=1e-4)


def test_solution_comes_back_as_it_went(solution, everything, tmp_path):
    back = load(everything(), save(solution, tmp_path / "lap.npz"))
    for name in ("states", "controls", "parameters"):
        np.testing.assert_array_equal(getattr(back.iterate, name), getattr(solution.iterate, name))
    for item in fields(solution.iterate.multipliers):
        np.testing.assert_array_equal(
            getattr(back.iterate.multipliers, item.name), getattr(solution.iterate.multipliers, item.name)
        )
    np.testing.assert_array_equal(back.mesh.boundaries, solution.mesh.boundaries)
    np.testing.assert_array_equal(back.mesh.orders, solution.mesh.orders)
    np.testing.assert_array_equal(back.estimate.by_state, solution.estimate.by_state)
    assert back.history == solution.history
    assert back.summary() == solution.summary()
    assert ocp.sensitivity.sensitivity(back) == ocp.sensitivity.sensitivity(solution)


def test_stored_solution_starts_another_solve(solution, everything, tmp_path):
    problem = everything()
    again = ocp.solve(problem, load(problem, save(solution, tmp_path / "lap.npz")), tolerance=1e-4)
    assert again.history[0].iterations < solution.history[0].iterations / 3


def test_stored_solution_is_read_into_other_scales(solution, everything, tmp_path):
    changed = everything()
    states = [ocp.State(s.name, s.unit, s.bounds, 3 * s.size) for s in changed.states]
    integrals = [ocp.Integral(i.name, i.unit, i.bounds, 5 * i.size) for i in changed.integrals]
    boundary = [ocp.Boundary(b.name, b.unit, b.bounds, 0.3 * b.size) for b in changed.boundary]
    scales = {"states": states, "integrals": integrals, "boundary": boundary, "objective_scale": 0.1}
    other = ocp.Problem(**{**vars(changed), **scales})
    back = load(other, save(solution, tmp_path / "lap"))
    np.testing.assert_allclose(back["v"], solution["v"], rtol=1e-14)
    np.testing.assert_allclose(back.costate("v"), solution.costate("v"), rtol=1e-13)
    np.testing.assert_allclose(back.path_multiplier("power"), solution.path_multiplier("power"), rtol=1e-13)
    # the derivatives of the optimum read every multiplier there is, those of integrals and ends included
    ours, theirs = (ocp.sensitivity.sensitivity(one) for one in (back, solution))
    assert ours == pytest.approx(theirs, rel=1e-11)
    np.testing.assert_allclose(
        ocp.sensitivity.density(back, "target"), ocp.sensitivity.density(solution, "target"), rtol=1e-11
    )


def test_solution_of_a_problem_with_other_names_is_refused(solution, brachistochrone, tmp_path):
    path = save(solution, tmp_path / "lap.npz")
    with pytest.raises(ocp.ProblemError, match="holds a solution of 'everything' with states x, v; 'brach"):
        load(brachistochrone(), path)


def test_file_holds_nothing_that_runs_when_it_is_read(solution, tmp_path):
    path = save(solution, tmp_path / "lap.npz")
    with zipfile.ZipFile(path) as archive:
        assert all(name.endswith(".npy") for name in archive.namelist())
    with np.load(path, allow_pickle=False) as archive:
        assert all(archive[name].dtype.kind in "fiU" for name in archive.files)
        assert json.loads(str(archive["about"]))["phases"][0]["names"]["controls"] == ["u", "w"]


def test_suffix_is_added_and_folders_are_made(solution, tmp_path):
    path = save(solution, tmp_path / "laps" / "row C, 1.5 m")
    assert path.name == "row C, 1.5 m.npz" and path.is_file()
    assert [item.name for item in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 torn", b"text"])
def test_file_that_is_no_solution_is_refused_by_its_name(everything, tmp_path, content):
    path = tmp_path / "lap.npz"
    path.write_bytes(content)
    with pytest.raises(ocp.ProblemError, match=r"lap\.npz is not a stored solution"):
        load(everything(), path)


def test_arrays_of_something_else_are_refused(everything, tmp_path):
    path = tmp_path / "other.npz"
    np.savez(path, x=np.zeros(3))
    with pytest.raises(ocp.ProblemError, match="is not a stored solution"):
        load(everything(), path)


def test_missing_file_is_said_to_be_missing(everything, tmp_path):
    with pytest.raises(FileNotFoundError):
        load(everything(), tmp_path / "nowhere.npz")


def test_later_schema_is_refused(solution, everything, tmp_path, monkeypatch):
    monkeypatch.setattr(ocp.storage, "SCHEMA", 9)
    path = save(solution, tmp_path / "lap.npz")
    monkeypatch.undo()
    with pytest.raises(ocp.ProblemError, match="has schema 9; this version reads 2"):
        load(everything(), path)


def test_solution_without_multipliers_is_kept_without_them(solution, everything, tmp_path):
    bare = ocp.iterate.Iterate(**{**vars(solution.iterate), "multipliers": None})
    path = save(ocp.Solution(**{**vars(solution), "iterate": bare}), tmp_path / "lap.npz")
    assert load(everything(), path).iterate.multipliers is None
