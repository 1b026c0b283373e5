"""A heart in several states: ejection fraction and strains of motions that are known."""

from __future__ import annotations

import json

import numpy as np
import pytest

import heartgen
from benchmarks.solids import cut_volume, ellipsoid
from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.errors import InputError
from heartgen.fields import global_strains
from heartgen.mesh import HexMesh
from heartgen.templates import biventricular_template

RELAXED, SQUEEZED = (22.0, 60.0, 10.0, 20.0), (15.0, 52.0, 14.0, 17.0)
ELEMENTS = (1, 12, 6)


@pytest.fixture(scope="module")
def beat() -> list[HexMesh]:
    return [ellipsoid(*RELAXED, ELEMENTS), ellipsoid(*SQUEEZED, ELEMENTS)]


def test_ejection_fraction_is_that_of_the_volumes(beat: list[HexMesh]) -> None:
    large, small = (cut_volume(a, b, top) for a, b, _, top in (RELAXED, SQUEEZED))
    for states in (beat, beat[::-1]):
        found = heartgen.compare(states)
        assert found.lv_ejection_fraction == pytest.approx(1 - small / large, rel=1e-3)
        assert found.lv_stroke_volume == pytest.approx((large - small) / 1000, rel=1e-3)
        assert states[found.diastole] is beat[0]
        assert states[found.systole] is beat[1]
        assert found.rv_ejection_fraction is None


def test_strains_are_those_of_the_wall(beat: list[HexMesh]) -> None:
    found = heartgen.compare(beat, ["relaxed", "squeezed"])
    assert found.strains[0].radial == pytest.approx(0, abs=1e-12)
    strain = found.strains[1]
    assert strain.radial == pytest.approx(14 / 10 - 1, abs=0.05)
    # Between those of the circles of endo- and epicardium, and less than that of the height.
    assert 29 / 32 - 1 > strain.circumferential > 15 / 22 - 1
    assert 0 > strain.longitudinal > 52 / 60 - 1
    assert "relaxed to squeezed: ejection fraction" in str(found)


def test_size_alone_is_seen_by_both(beat: list[HexMesh]) -> None:
    smaller = beat[0].transformed(np.diag([0.9, 0.9, 0.9, 1.0]))
    found = heartgen.compare([beat[0], smaller])
    assert found.lv_ejection_fraction == pytest.approx(1 - 0.9**3)
    assert found.strains[1].longitudinal == pytest.approx(-0.1)


def test_other_elements_have_no_strains_and_it_says_so(beat: list[HexMesh]) -> None:
    found = heartgen.compare([beat[0], ellipsoid(*SQUEEZED, (1, 12, 8))], ["one", "other"])
    assert found.strains[1] is None
    assert found.lv_ejection_fraction > 0.4
    (note,) = found.notes
    assert note.startswith("other: no strains against one: ")
    assert "elements correspond" in str(found)


@pytest.mark.parametrize(
    ("volume", "told"), [(1.1, False), (1.14, False), (1.16, True), (2.0, True)]
)
def test_two_hearts_are_told_by_the_volumes_of_their_walls(
    beat: list[HexMesh], volume: float, told: bool
) -> None:
    scale = volume ** (1 / 3)
    other = beat[0].transformed(np.diag([scale, scale, scale, 1.0]))
    for states, names in (([beat[0], other], ["a", "b"]), ([other, beat[0]], ["b", "a"])):
        found = heartgen.compare(states, names)
        notes = [note for note in found.notes if "states of one patient" in note]
        assert len(notes) == told
        if told:
            assert notes[0].startswith("b and a: the left ventricle's wall has")
            assert f"{volume - 1:.0%} more" in notes[0]
            assert notes[0] in str(found)


def test_it_is_plain_data(beat: list[HexMesh]) -> None:
    read = json.loads(heartgen.compare(beat).to_json())
    assert read["names"] == ["1", "2"]
    assert len(read["indices"]) == len(read["strains"]) == 2


@pytest.mark.parametrize("names", [None, ["a", "b"]])
def test_one_mesh_is_no_comparison(beat: list[HexMesh], names) -> None:
    with pytest.raises(InputError, match="give at least two meshes"):
        heartgen.compare(beat[:1], names)


@pytest.fixture(scope="module")
def both() -> list[HexMesh]:
    """Both ventricles of two hearts that differ in how far down the right one reaches."""
    hearts = (samples.biv(2.5, rv_apex=height).mask for height in (12.0, 22.0))
    return [biventricular_template(analyze(mask, "auto", "biv"), (2, 12, 8)) for mask in hearts]


@pytest.mark.slow
def test_strains_are_of_the_wall_that_corresponds(both: list[HexMesh]) -> None:
    one, other = both
    first = [mesh.topology.index[mesh.topology.parts["septum"], 2].min() for mesh in both]
    assert first[0] != first[1]
    found = global_strains(one, other)
    assert 0.9 < found.share < 0.99
    assert global_strains(one, one).whole
    smaller = global_strains(one, other.transformed(np.diag([0.9, 0.9, 0.9, 1.0])))
    for name in ("longitudinal", "circumferential", "radial"):
        assert 1 + getattr(smaller, name) == pytest.approx(0.9 * (1 + getattr(found, name)))
        assert abs(getattr(found, name)) < 0.1  # the left ventricle is the same


@pytest.mark.slow
def test_it_says_of_how_much_of_the_wall_they_are(both: list[HexMesh]) -> None:
    smaller = both[1].transformed(np.diag([0.8, 0.8, 0.8, 1.0]))
    found = heartgen.compare([both[0], smaller], ["large", "small"])
    _, note = found.notes
    assert note.startswith(f"small: strains of {found.strains[1].share:.0%} of the wall: ")
    assert found.rv_ejection_fraction == pytest.approx(1 - 0.8**3, abs=0.1)
