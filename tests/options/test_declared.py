"""Options are what they are declared to be, whichever way they come."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import jsonschema  # which notebooks need
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import heartgen
from heartgen.cli.option_flags import Choices, takes_options
from heartgen.cohort.case_tables import cases_of_table
from heartgen.errors import InputError
from heartgen.images.selecting import Selection
from heartgen.options import ANALYZED, OPTIONS, STEPS, Option, Options, as_text, options_from_text
from heartgen.options.option import NO, UNSET, YES
from heartgen.options.reference import options_markdown, options_schema

LETTERS = st.text("abcdefghijklmnopqrstuvwyz", min_size=1, max_size=8)  # without the x of 1x12x6

SCHEMA = options_schema()


def numbers(schema: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Numbers that a JSON schema allows."""
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if schema["type"] == "integer":
        return st.integers(low, high)
    return st.floats(
        low,
        high,
        exclude_min="exclusiveMinimum" in schema,
        exclude_max="exclusiveMaximum" in schema,
        allow_nan=False,
        allow_infinity=False,
    )


def values(option: Option) -> st.SearchStrategy[Any]:
    """All that an option may be."""
    kinds: list[st.SearchStrategy[Any]] = [st.just(option.default)]
    if option.switch:
        kinds.append(st.booleans())
    if option.words:
        kinds.append(st.sampled_from(option.words))
    if option.number is not None:
        kinds.append(numbers(dict(option.number)))
    if option.row is not None:
        kinds.append(st.tuples(*[numbers(dict(option.row))] * 3).filter(any))
    return st.one_of(kinds)


def others(option: Option) -> st.SearchStrategy[Any]:
    """Much that an option may not be."""
    words = LETTERS.filter(lambda word: word not in (*option.words, *YES, *NO, *UNSET))
    kinds: list[st.SearchStrategy[Any]] = [words.filter(lambda w: w not in ("nan", "inf"))]
    if option.number is not None:
        low = option.number.get("minimum", 0)
        kinds.append(st.floats(-1e5, low, exclude_max=True).filter(lambda x: x % 1))
        kinds.append(st.integers(-1000, -1))
        if "maximum" in option.number:
            kinds.append(st.integers(int(option.number["maximum"]) + 1, 10**5))
    if option.row is not None and option.row["type"] == "integer":
        row = st.lists(st.integers(1, 20), min_size=2, max_size=5).map(tuple)
        kinds.append(row.filter(lambda r: len(r) != 3))
        kinds.append(st.tuples(st.integers(-5, 0), st.integers(1, 20), st.integers(1, 20)))
    elif option.row is not None:
        row = st.lists(st.integers(-9, 9).map(float), min_size=2, max_size=5).map(tuple)
        kinds.append(row.filter(lambda r: len(r) != 3))
        kinds.append(st.just((0.0, 0.0, 0.0)))
    return st.one_of(kinds)


def written(option: Option, value: Any) -> str:
    """As a user writes it."""
    counts = option.row is not None and option.row["type"] == "integer"
    return "x".join(map(str, value)) if counts and isinstance(value, tuple) else as_text(value)


def beside(option: Option) -> dict[str, Any]:
    """What has to be chosen with it."""
    needs = option.about.needs
    return {needs.option: needs.value} if needs else {}


def from_python(option: Option, value: Any) -> Options:
    return Options(**{option.name: value, **beside(option)})


def from_json(option: Option, value: Any) -> Options:
    return Options(**json.loads(json.dumps({option.name: value, **beside(option)})))


def from_text(option: Option, value: Any) -> Options:
    extra = {name: as_text(each) for name, each in beside(option).items()}
    return options_from_text({option.name: written(option, value), **extra})


def from_flags(option: Option, value: Any) -> Options:
    made: list[Options] = []
    command = typer.Typer()

    @command.command()
    @takes_options()
    def fit(*, choices: Choices) -> None:
        made.append(options_from_text(choices))

    flags = []
    for name, each in {option.name: value, **beside(option)}.items():
        if not OPTIONS[name].switch:
            flags.append(f"{OPTIONS[name].flag}={written(OPTIONS[name], each)}")
        elif not each:
            flags.append(OPTIONS[name].flag)
    outcome = CliRunner().invoke(command, flags)
    if outcome.exception is not None:
        raise outcome.exception
    return made[0]


def from_table(option: Option, value: Any, folder: Path) -> Options:
    given = {option.name: value, **beside(option)}
    cells = [written(OPTIONS[name], each) for name, each in given.items()]
    (folder / "cases.csv").write_text(
        "\n".join([",".join(["mask", *given]), ",".join(["a.nii", *cells])])
    )
    [case] = cases_of_table(folder / "cases.csv", Selection())
    return Options(**case.choices)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("table")


@pytest.mark.slow
@pytest.mark.parametrize("option", OPTIONS.values(), ids=OPTIONS)
@settings(max_examples=20)
@given(data=st.data())
def test_a_value_is_the_same_by_every_way(option, folder, data):
    value = data.draw(values(option))
    options = from_python(option, value)
    assert getattr(options, option.name) == value
    assert from_json(option, value) == options
    assert from_text(option, value) == options
    assert from_flags(option, value) == options
    assert from_table(option, value, folder) == options
    assert pickle.loads(pickle.dumps(options)) == options
    assert hash(replace(options)) == hash(options)
    jsonschema.validate(json.loads(json.dumps(asdict(options))), SCHEMA)


@pytest.mark.slow
@pytest.mark.parametrize("option", OPTIONS.values(), ids=OPTIONS)
@settings(max_examples=20)
@given(data=st.data())
def test_what_is_no_value_is_refused_by_one_sentence(option, folder, data):
    value = data.draw(others(option))
    with pytest.raises(InputError) as told:
        from_python(option, value)
    sentence = str(told.value)
    assert sentence == option.refusal(value)
    assert sentence.count(": ") == 1
    ways = [from_json, from_text]
    ways += [] if option.switch else [from_flags]  # whose flag has no value
    for way in ways:
        with pytest.raises(InputError) as told:
            way(option, value)
        assert str(told.value) == sentence
    with pytest.raises(InputError) as told:
        from_table(option, value, folder)
    assert str(told.value) == f"{folder / 'cases.csv'}, row 1: {sentence}"
    if value != (0.0, 0.0, 0.0):  # numbers by themselves, and no direction
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({option.name: json.loads(json.dumps(value))}, SCHEMA)


@pytest.mark.parametrize(
    ("choices", "sentence"),
    [
        ({"optimize": False, "min_jacobian_ratio": 0.3}, "allow the optimization, or ask for no"),
        ({"optimize": False, "transmural_lines": "curved"}, "or keep them straight"),
        ({"hole_radius": 4.0}, "an apex that is collapsed has no hole of 4.0 mm radius"),
        ({"apex": "patch", "elements": (1, 10, 6)}, "use a multiple of 4"),
    ],
)
def test_options_that_contradict_each_other_are_refused(choices, sentence):
    with pytest.raises(InputError, match=sentence):
        Options(**choices)
    with pytest.raises(InputError, match=sentence):
        options_from_text({name: as_text(value) for name, value in choices.items()})


@pytest.mark.parametrize("value", [True, "3", 2.5, None, [3], {"lod": 3}, b"3", 10**400, object()])
def test_values_of_other_types_are_refused(value):
    with pytest.raises(InputError, match=r"^level of detail .* choose a whole number from 1 to 5$"):
        Options(lod=value)


def test_numbers_of_other_libraries_are_taken_as_python_s():
    np = pytest.importorskip("numpy")
    options = Options(
        lod=np.int64(3),
        quality=np.float32(2),
        optimize=np.bool_(True),
        elements=[2, np.int8(8), 6.0],
    )
    assert options == Options(lod=3, quality=2.0, elements=(2, 8, 6))
    assert json.loads(json.dumps(asdict(options)))["elements"] == [2, 8, 6]


def test_everything_is_said_of_every_option():
    for option in OPTIONS.values():
        assert option.about.step in STEPS
        assert option.about.help.endswith(".")
        assert set(option.about.words) in (
            set(option.words),
            {"yes", "no"} if option.switch else set(),
        )
        assert option.about.unset or not option.optional
        assert f"{option.name} : " in Options.__doc__
        told = SCHEMA["properties"][option.name]
        assert {"title", "description", "step", "level", "default"} <= told.keys()


def test_the_shape_analysis_is_changed_by_what_analyze_under_reads():
    seen = set()

    class Watched:
        def __getattribute__(self, name: str) -> Any:
            seen.add(name)
            return getattr(Options(), name)

    with pytest.raises(AttributeError):  # there is no mask
        heartgen.anatomy.analyze_under(None, Watched())
    assert seen == set(ANALYZED)


def test_the_page_of_the_options_is_up_to_date(repository):
    page = (repository / "docs" / "options.md").read_text(encoding="utf-8")
    assert page == options_markdown(), "make it anew: heartgen options --markdown > docs/options.md"


def test_importing_heartgen_loads_nothing_for_the_options():
    code = "import heartgen, sys; print([m for m in ('pydantic', 'numpy') if m in sys.modules])"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "[]"
