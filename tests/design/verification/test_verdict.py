from hsv.design.verification import verdict
from hsv.errors import DesignError


def test_where_no_set_is_found_the_reason_is_that_of_the_search(subject, monkeypatch):
    def none(*_):
        raise DesignError("no set")

    monkeypatch.setattr(verdict, "ellipsoid", none)
    assert verdict.verdict("x", subject.design, subject).said == "no set"
