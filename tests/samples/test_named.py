from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from heartgen import samples
from heartgen.errors import InputError

CUP = samples.ideal_cup(4.0)


@pytest.mark.slow
def test_named_samples_are_the_same_at_every_call(loaded):
    assert samples.names() == samples.names(1) + samples.names(2)
    assert samples.names(1) == (
        "ideal",
        "lifelike",
        "papillary",
        "valves",
        "noisy",
        "tilted",
        "stack",
    )
    assert samples.names(2) == ("biv", "dilated_rv", "thick_lv", "biv_tilted")
    for name in ("papillary", "noisy", "tilted", "biv_tilted"):
        first, again = loaded[name], samples.load(name)
        assert_array_equal(again.mask.voxels, first.mask.voxels)
        assert_array_equal(again.mask.affine, first.mask.affine)
        assert_array_equal(again.truth.surface(10)[0], first.truth.surface(10)[0])
    for name, sample in loaded.items():
        assert sample.mask.name == name
        assert sample.description.endswith(".")
        assert (sample.truth.rv is not None) == (name in samples.names(2))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: samples.load("heart"), "choose one of ideal, lifelike"),
        (lambda: samples.ideal_cup(0), "spacing"),
        (lambda: samples.ideal_cup((1, 1)), "spacing"),
        (lambda: samples.ideal_cup(np.nan), "spacing"),
        (lambda: samples.ideal_cup(0.01), "coarser"),
        (lambda: samples.ideal_cup(300.0), "finer"),
        (lambda: samples.ideal_cup(wall=-1), "positive"),
        (lambda: samples.ideal_cup(base_height=60), "base_height"),
        (lambda: samples.ideal_cup(scale=0), "scale"),
        (lambda: samples.ideal_cup(rotation=np.diag([1, 1, -1])), "mirrors"),
        (lambda: samples.ideal_cup(rotation=np.ones((3, 3))), "rotation"),
        (lambda: samples.ideal_cup(direction=np.diag([1, 1, 2])), "direction"),
        (lambda: samples.ideal_cup(translation=(1, 2)), "translation"),
        (lambda: samples.lifelike_lv(noise=1.5), "noise"),
        (lambda: samples.names(3), "1 or 2 ventricles"),
        (lambda: samples.biv(noise=-1), "noise"),
        (lambda: samples.biv(rv_wall=0), "rv_wall .* positive"),
        (lambda: samples.biv(septum=-3), "septum .* positive"),
        (lambda: samples.biv(length=np.inf), "length .* positive"),
        (lambda: samples.biv(rv_size=np.nan), "rv_size .* positive"),
        (lambda: samples.biv(tilt=60), "tilt .* degrees"),
        (lambda: samples.biv(rv_apex=-5), "rv_apex"),
        (lambda: samples.biv(rv_apex=80), "rv_apex"),
        (lambda: samples.biv(rv_apex=np.nan), "rv_apex"),
        (lambda: samples.biv(rv_size=0.4), "side by side"),
        (lambda: samples.biv(rv_size=4), "side by side"),
        (lambda: samples.biv(0.02), "coarser"),
        (lambda: CUP.truth.surface(10, "rv"), "choose all, endo, epi, base"),
        (lambda: CUP.truth.surface(2), "too few"),
        (lambda: CUP.truth.distance([1, 2, 3]), "shape"),
        (lambda: CUP.truth.distance([[1, 2, np.inf]]), "finite"),
    ],
)
def test_bad_input_is_refused_in_one_clear_sentence(call, message):
    with pytest.raises(InputError, match=message):
        call()
