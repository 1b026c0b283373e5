from __future__ import annotations

from heartgen.cohort.sweeping import combinations


def test_combinations_are_all_there_once():
    found = combinations({"quality": [1.0, 2.0], "elements": (1, 12, 6), "optimize": [True, False]})
    assert len(found) == 4
    assert {(c["quality"], c["optimize"]) for c in found} == {
        (q, r) for q in (1.0, 2.0) for r in (True, False)
    }
    assert all(c["elements"] == (1, 12, 6) for c in found)
    assert combinations({}) == [{}]
