"""The exact check of certificates: it accepts what is proved and refuses everything else."""

import copy
import json
import subprocess
import sys
import time
from fractions import Fraction

import pytest

from thesislib.__main__ import main
from thesislib.stability.checking import CertificateError, check, check_file


@pytest.fixture(scope="module", params=[2, 4])
def document(request, found):
    return found.regions[request.param].certificate.document


def changed(document, *path, by):
    """Return a certificate in which the number at a path is changed by a function of fractions."""
    mutated = copy.deepcopy(document)
    *way, last = path
    place = mutated
    for step in way:
        place = place[step]
    place[last] = str(by(Fraction(place[last])))
    return mutated


MUTATIONS = {
    "gamma raised by 2 %": (("gamma",), lambda x: x * Fraction(102, 100)),
    "a coefficient of V": (("V", 0, 2), lambda x: x * Fraction(1001, 1000)),
    "the last coefficient of V, in its last digits": (("V", -1, 2), lambda x: x + Fraction(1, 2**60)),
    "a diagonal entry of (7.30)": (("falling", 0, "grams", 0, 2, 2), lambda x: x + Fraction(1, 10**9)),
    "an entry of (7.30) beside the diagonal": (("falling", 0, "grams", 1, 1, 0), lambda x: x + 1),
    "an entry of (7.28)": (("positive", "grams", 0, 0, 0), lambda x: x * 2),
    "q_2": (("falling", 0, "multiplier", "grams", 0, 0, 0), lambda x: x * Fraction(11, 10)),
    "q_2 turned negative": (("falling", 0, "multiplier", "grams", 0, 0, 0), lambda x: -x),
    "the car's mass": (("cars", 0, "mass"), lambda x: x + 1),
    "the car's speed": (("cars", 0, "u_0"), lambda x: x + Fraction(1, 100)),
    "a tyre coefficient": (("cars", 0, "rear", "numerator", 1), lambda x: x * Fraction(999, 1000)),
    "the trim": (("cars", 0, "front", "trim"), lambda x: x + Fraction(1, 1000)),
    "epsilon made zero": (("epsilon",), lambda x: x * 0),
    "a denominator with a root": (("cars", 0, "front", "denominator", 0), lambda x: -x),
    "time running backwards": (("time_unit",), lambda x: -x),
}


def test_a_certificate_is_accepted_and_says_what_it_proves(document):
    verdict = check(json.loads(json.dumps(document)))
    assert verdict.cars == 1
    assert verdict.gamma == 1.0
    assert "is a region of attraction for one car" in str(verdict)


@pytest.mark.parametrize("mutation", MUTATIONS)
def test_a_mutated_certificate_is_refused(document, mutation):
    path, by = MUTATIONS[mutation]
    with pytest.raises(CertificateError, match="The certificate fails"):
        check(changed(document, *path, by=by))


def test_a_gram_matrix_that_fits_but_is_not_semidefinite_is_refused(document):
    """x_1² and x_1 x_1 are one monomial: weight moved between entries keeps the identity."""
    mutated = copy.deepcopy(document)
    part = mutated["positive"]
    part["bases"].append(part["bases"][0])
    n = len(part["bases"][0])
    part["grams"].append([["0"] * r + ["-1"] for r in range(n)])
    first = part["grams"][0]
    for r in range(n):
        first[r][r] = str(Fraction(first[r][r]) + 1)
    with pytest.raises(CertificateError, match="is positive semidefinite"):
        check(mutated)


def test_a_proof_left_out_is_refused(document):
    with pytest.raises(CertificateError, match="one proof of"):
        check(document | {"falling": []})
    with pytest.raises(CertificateError, match="malformed: KeyError"):
        check({key: value for key, value in document.items() if key != "positive"})


@pytest.mark.parametrize("text", ["[]", "{}", '{"format": "other"}', "{", '"x"'])
def test_what_is_no_certificate_is_refused(tmp_path, text):
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(CertificateError, match=r"no certificate|is not JSON"):
        check_file(path)


def test_numbers_must_be_rational_texts(document):
    mutated = copy.deepcopy(document)
    mutated["gamma"] = 1.0
    with pytest.raises(CertificateError, match="malformed: TypeError"):
        check(mutated)


def test_the_command_accepts_and_refuses(tmp_path, document, capsys):
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(json.dumps(document))
    bad.write_text(json.dumps(document | {"gamma": "51/50"}))
    assert main(["certify", str(good)]) == 0
    assert "is a region of attraction" in capsys.readouterr().out
    assert main(["certify", str(good), str(bad)]) == 1
    assert "The certificate fails" in capsys.readouterr().out
    assert main(["certify", str(tmp_path / "none.json")]) == 2
    assert capsys.readouterr().err.startswith("thesis: There is no certificate")


def test_the_check_shares_nothing_with_the_solver(tmp_path, document):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(document))
    script = (
        "import sys; from thesislib.__main__ import main; status = main(['certify', sys.argv[1]]); "
        "print(status, *sorted(sys.modules))"
    )
    started = time.monotonic()
    command = [sys.executable, "-c", script, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    # two seconds are promised; the wall clock of a busy machine is given ten times that
    assert time.monotonic() - started < 20.0
    status, *modules = done.stdout.splitlines()[-1].split()
    assert status == "0"
    assert not {"numpy", "scipy", "clarabel", "cvxpy", "casadi", "matplotlib"} & set(modules)
    own = {name for name in modules if name.startswith("thesislib.stability")}
    assert own == {"thesislib.stability", "thesislib.stability.checking"}
