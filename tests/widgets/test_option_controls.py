"""Every option is on the page, and says there what it is."""

from __future__ import annotations

import pytest

from heartgen.options import OPTIONS, Options
from heartgen.widgets.option_controls import option_control
from heartgen.widgets.panels.fit_options import OptionsPanel
from heartgen.widgets.run_options import RunOptions
from heartgen.widgets.session import Session
from heartgen.widgets.session_input import measured


@pytest.fixture
def choices():
    return RunOptions()


@pytest.fixture
def panel():
    session = Session()
    yield OptionsPanel(session)
    session.close()


OTHERS = {
    "lod": 3,
    "elements": (2, 16, 8),
    "ventricles": "lv",
    "optimize": False,
    "quality": 10.0,
    "min_jacobian_ratio": 0.3,
    "truncate": 7.5,
    "base": "plane",
    "enhance": False,
    "transmural_grading": False,
    "transmural_lines": "curved",
    "basis": "lagrange",
    "septal_direction": (-1.0, 0.0, 0.5),
    "apex": "hole",
    "hole_radius": 4.0,
    "slice_alignment": "off",
    "insertion": "squared",
}


def test_the_first_choices_are_the_defaults(choices):
    assert choices.options() == Options()


@pytest.mark.parametrize("option", OPTIONS.values(), ids=OPTIONS)
def test_control_and_choice_follow_each_other(choices, option):
    control = option_control(option, choices)
    assert getattr(choices, option.name) == option.default
    before = [each.value for each in control.inputs]
    setattr(choices, option.name, OTHERS[option.name])
    assert getattr(choices, option.name) == OTHERS[option.name]
    after = [each.value for each in control.inputs]
    assert after != before
    setattr(choices, option.name, option.default)
    for each, value in zip(reversed(control.inputs), reversed(after), strict=True):
        each.value = value
    assert getattr(choices, option.name) == pytest.approx(OTHERS[option.name])


def test_every_option_is_in_sight_or_one_click_away(panel):
    shown = {id(each) for each in panel.widget.children}
    folded = {id(each) for each in panel.rest.children}
    for name, control in panel.controls.items():
        basic = OPTIONS[name].about.level == "basic"
        assert id(control.widget) in (shown if basic else folded)
        assert OPTIONS[name].about.help in control.note.value
        assert " Default: " in control.note.value
    assert panel.rest.layout.display == "none"
    panel.more.click()
    assert panel.rest.layout.display == ""


def test_what_has_no_effect_is_not_offered_and_not_asked_for(panel):
    choices = panel.session.choices
    choices.transmural_lines, choices.apex, choices.hole_radius = "curved", "hole", 4.0
    assert choices.options().hole_radius == 4.0
    choices.optimize, choices.apex = False, "collapsed"
    assert choices.options() == Options(optimize=False)
    idle = {name for name, each in panel.controls.items() if each.inputs[0].disabled}
    assert idle == {"quality", "min_jacobian_ratio", "transmural_lines", "insertion", "hole_radius"}


def test_an_anatomy_belongs_to_all_options_of_the_shape_analysis():
    usual = measured(None, Options())
    for name in ("truncate", "base", "ventricles", "slice_alignment"):
        assert measured(None, Options(**{name: OTHERS[name]})) != usual
    assert measured(None, Options(lod=5)) == usual
