"""Controls of the page, made from the declaration of the options."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import dataclass
from math import log10
from typing import Any

import ipywidgets as widgets
from traitlets import link

from heartgen.options import Option, as_text
from heartgen.options.option import explanation
from heartgen.widgets.parts import choose, classed, row, text
from heartgen.widgets.run_options import OFFERED, RunOptions

UNSET, GIVEN = "unset", "given"
"""Instead of a word: it is left to heartgen, or numbers are given."""

LOGARITHMIC = 1000.0
"""Ratio of the largest to the smallest number from which a slider's scale is logarithmic."""

STEPS_OF_TEN = 10
"""Steps of a logarithmic slider from a number to its tenfold."""


@dataclass(frozen=True, eq=False)
class OptionControl:
    """An option on the page.

    Attributes
    ----------
    option : Option
        The option.
    widget : ipywidgets.Widget
        All of it.
    inputs : tuple of ipywidgets.Widget
        What the user changes.
    note : ipywidgets.HTML
        What it does, its default, and when it applies.
    """

    option: Option
    widget: Any
    inputs: tuple[Any, ...]
    note: Any

    def draw(self, choices: RunOptions) -> None:
        """Show what is chosen, and whether it has an effect beside the other choices.

        Parameters
        ----------
        choices : RunOptions
            All choices.
        """
        applies = self.option.applies(choices)
        for each in self.inputs:
            each.disabled = not applies
        self.note.value = _note(self.option, getattr(choices, self.option.name))
        (self.widget.remove_class if applies else self.widget.add_class)("hg-idle")


def option_control(option: Option, choices: RunOptions) -> OptionControl:
    """Make the control of an option, tied to the choice.

    Parameters
    ----------
    option : Option
        The option.
    choices : RunOptions
        All choices, of which it changes the one of its name.
    """
    if not _is_mixed(option):
        control = _plain(option)
        link((choices, option.name), (control, "value"))
        shown, inputs = [control], (control,)
    else:
        mixed = _Mixed(option, choices)
        shown, inputs = [mixed.kind, mixed.box], (mixed.kind, *mixed.numbers)
    note = text(_note(option, option.default), "hg-note hg-option-note")
    widget = classed(widgets.VBox([*shown, note]), f"hg-option hg-option-{option.name}")
    return OptionControl(option, widget, inputs, note)


def _is_mixed(option: Option) -> bool:
    """Whether it may be a number, or numbers, or something else."""
    return option.optional or (bool(option.words) and option.number is not None)


def _plain(option: Option) -> Any:
    """The control of an option that is one of some words, on or off, or a number."""
    about, default = option.about, option.default
    if option.words:
        titles = [(about.words[word].title, word) for word in option.words]
        return choose(titles, default, about.title, explanation(option))
    if option.switch:
        return row(about.title, widgets.Checkbox(default, indent=False), explanation(option))
    assert option.number is not None
    return row(about.title, _number(option.number, default), explanation(option))


def _number(schema: Mapping[str, Any], value: float) -> Any:
    """A slider where there are two bounds and none of them is left out, else a field."""
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is None or high is None:
        return _field(schema, value)
    if schema["type"] == "integer":
        return widgets.IntSlider(value, low, high, continuous_update=False)
    if low > 0 and high / low >= LOGARITHMIC:
        return widgets.FloatLogSlider(
            value,
            min=log10(low),
            max=log10(high),
            step=1 / STEPS_OF_TEN,
            continuous_update=False,
            readout_format=".2g",
        )
    return widgets.FloatSlider(value, min=low, max=high, continuous_update=False)


def _field(schema: Mapping[str, Any], value: float) -> Any:
    """A field for a number."""
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if schema["type"] == "integer":
        return widgets.BoundedIntText(value, min=low, max=high)
    if low is None:
        return widgets.FloatText(value)
    return widgets.BoundedFloatText(
        value,
        min=low,
        max=float("inf") if high is None else high,
        step=0.05 if high is not None and high <= 1 else 1,
    )


class _Mixed:
    """The control of an option that is a word, or unset, or a number, or three.

    Parameters
    ----------
    option : Option
        The option.
    choices : RunOptions
        All choices.
    """

    def __init__(self, option: Option, choices: RunOptions) -> None:
        self.option, self.choices = option, choices
        about = option.about
        titles: list[tuple[str, Any]] = [(about.words[w].title, w) for w in option.words]
        if option.optional:
            titles.append(("Automatic", UNSET))
        titles.append((f"Given, in {about.unit}" if about.unit else "Given", GIVEN))
        told = explanation(option)
        self.kind = choose(titles, titles[0][1], about.title, told)
        if option.row is not None:
            self.numbers = [
                self._part(part, label, value)
                for part, (label, value) in enumerate(zip(about.parts, about.example, strict=True))
            ]
        else:
            assert option.number is not None
            label = f"{about.title}, {about.unit}"
            self.numbers = [row(label, _field(option.number, about.example), told)]
        self.box = classed(widgets.HBox(self.numbers), "hg-numbers")
        self._quiet = False
        for each in (self.kind, *self.numbers):
            each.observe(self._changed, "value")
        choices.observe(self._show, option.name)
        self._show()

    def _part(self, part: int, label: str, value: float) -> Any:
        """The field of one of three numbers."""
        schema = dict(self.option.row or {})
        if self.option.name in OFFERED:
            schema["minimum"], schema["maximum"] = OFFERED[self.option.name][part]
        return row(label, _field(schema, value), f"{self.option.about.title}: {label}")

    def _changed(self, _: Any) -> None:
        """Choose what the controls say."""
        if self._quiet:
            return
        numbers = tuple(each.value for each in self.numbers)
        given = numbers if self.option.row is not None else numbers[0]
        value = {GIVEN: given, UNSET: None}.get(self.kind.value, self.kind.value)
        setattr(self.choices, self.option.name, value)

    def _show(self, _: Any = None) -> None:
        """Have the controls say what is chosen."""
        value = getattr(self.choices, self.option.name)
        words = value is None or isinstance(value, str)
        self._quiet = True
        try:
            if not words:
                parts = value if self.option.row is not None else (value,)
                for each, part in zip(self.numbers, parts, strict=True):
                    each.value = part
            self.kind.value = GIVEN if not words else UNSET if value is None else value
        finally:
            self._quiet = False
        self.box.layout.display = "none" if words else ""


def _note(option: Option, value: Any) -> str:
    """What it does, what the value means, its default, and when it applies."""
    about, default = option.about, option.default
    if default is None:
        usual = f"automatic, {about.unset}"
    elif isinstance(default, bool):
        usual = "on" if default else "off"
    elif default in about.words:
        usual = about.words[default].title
    else:
        usual = f"{as_text(default)} {about.unit}".strip()
    said = [about.help]
    if isinstance(value, str) and value in about.words:
        said.append(f"{about.words[value].title}: {about.words[value].help}.")
    said.append(f"Default: {usual}.")
    if about.when:
        said.append(f"Only {about.when}.")
    return html.escape(" ".join(said), quote=False)
