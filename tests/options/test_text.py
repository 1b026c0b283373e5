from __future__ import annotations

import pytest

from heartgen.errors import InputError
from heartgen.options import Options, as_text, option_from_text, settings_from_text


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("lod", "3", 3),
        ("lod", "3.0", 3),
        ("elements", "1x12x6", (1, 12, 6)),
        ("elements", "auto", None),
        ("quality", "0.5", 0.5),
        ("truncate", "off", "off"),
        ("truncate", "7.5", 7.5),
        ("optimize", "no", False),
        ("enhance", "True", True),
        ("ventricles", "biv", "biv"),
    ],
)
def test_options_are_read_as_users_write_them(name, text, value):
    found = option_from_text(name, text)
    assert found == value
    assert type(found) is type(value)
    assert getattr(Options(**{name: found}), name) == value


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("shade", "3", "there is no option 'shade': choose among lod, elements"),
        ("lods", "3", "there is no option 'lods': did you mean 'lod'"),
        (
            "lod",
            "three",
            "level of detail 'three' does not exist: choose a whole number from 1 to 5",
        ),
        ("elements", "12x6", "for example 1x12x6"),
        ("optimize", "perhaps", "neither yes nor no"),
    ],
)
def test_what_is_no_option_is_refused(name, text, sentence):
    with pytest.raises(InputError, match=sentence):
        option_from_text(name, text)


@pytest.mark.parametrize("value", [3, 0.5, (1, 12, 6), True, False, "off"])
def test_values_are_written_as_they_are_read(value):
    name = {int: "lod", float: "quality", tuple: "elements", bool: "optimize", str: "truncate"}
    assert option_from_text(name[type(value)], as_text(value)) == value


def test_settings_hold_several_values():
    found = settings_from_text(["quality=0.5,1", "elements=1x12x6,1x16x8", "optimize=no"])
    assert found == {
        "quality": [0.5, 1.0],
        "elements": [(1, 12, 6), (1, 16, 8)],
        "optimize": [False],
    }
    with pytest.raises(InputError, match="has no value: write it like quality=2"):
        settings_from_text(["quality"])
    with pytest.raises(InputError, match="given twice"):
        settings_from_text(["quality=1", "quality=2"])
