"""Former names work, each with a warning that says the new one; former files are read."""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from pydoc import locate

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import heartgen
from heartgen import renamed, samples
from heartgen.cli.cohort import app
from heartgen.cohort.batching import batch
from heartgen.cohort.case import Case
from heartgen.cohort.job import Job, is_as_asked, rows_of
from heartgen.cohort.store import read_results
from heartgen.fields import heart_axes, make_fields
from heartgen.formats.assembled import our_name
from heartgen.options import Options, settings_from_text
from heartgen.report import options_beside

GIVEN = {
    "refine": (False, False),
    "least_quality": (0.3, 0.3),
    "depth": ("linear", False),
    "interior": ("relaxed", "curved"),
    "septum": ((-1.0, -1.0, 0.0), (-1.0, -1.0, 0.0)),
    "shifts": ("off", "off"),
}
"""A former value of each option, and the new one."""

TEXTS = {"refine": "no", "least_quality": "0.3", "septum": "-1/-1/0"}
"""The same as users write them, where that is something else."""


@pytest.fixture(scope="module")
def cup() -> samples.Sample:
    return samples.ideal_cup(3.0)


def now(name: str) -> str:
    """The new name of an option."""
    return renamed.OPTIONS[name][0]


def test_every_option_is_here() -> None:
    assert GIVEN.keys() == renamed.OPTIONS.keys()
    assert {now(name) for name in GIVEN} <= set(asdict(Options()))


@pytest.mark.parametrize("name", GIVEN)
def test_option_is_taken(name: str) -> None:
    former, new = GIVEN[name]
    with pytest.warns(FutureWarning, match=f"option {name} is now {now(name)}") as told:
        options = Options(**{name: former})
    assert Path(told[0].filename) == Path(__file__)
    assert getattr(options, now(name)) == new
    with pytest.warns(FutureWarning, match=f"Options.{name} is now {now(name)}"):
        assert getattr(options, name) == new


@pytest.mark.parametrize("name", GIVEN)
def test_setting_is_taken(name: str) -> None:
    former, new = GIVEN[name]
    with pytest.warns(FutureWarning, match=f"option {name} is now {now(name)}"):
        found = settings_from_text([f"{name}={TEXTS.get(name, former)}"])
    assert found == {now(name): [new]}


def test_option_under_both_names_is_refused() -> None:
    with pytest.raises(TypeError, match="refine is the former name of optimize"):
        Options(refine=False, optimize=True)  # type: ignore[call-arg]


def test_new_options_warn_of_nothing() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        options = Options(
            **{now(name): new for name, (_, new) in GIVEN.items() if name != "refine"}
        )
        assert replace(options, lod=2).lod == 2
        assert not hasattr(options, "nonsense")


@pytest.mark.slow
def test_personalize_takes_them(cup: samples.Sample) -> None:
    with pytest.warns(FutureWarning, match="option refine is now optimize"):
        result = heartgen.personalize(cup.mask, elements=(1, 4, 2), refine=False)
    assert not result.options.optimize
    report = result.report
    for former, new in renamed.REPORT.items():
        with pytest.warns(FutureWarning, match=f"Report.{former} is now {new}"):
            assert getattr(report, former) == getattr(report, new)
    for former, new in (("septum", "septal_direction"),):
        with pytest.warns(FutureWarning, match=f"argument {former} is now {new}"):
            axes = heart_axes(result.mesh, **{former: (0, 1, 0)})
        np.testing.assert_array_equal(axes.septal, heart_axes(result.mesh, (0, 1, 0)).septal)
    with pytest.warns(FutureWarning, match="'fibres' is now 'fibers'"):
        assert next(f.name for f in make_fields(result.mesh, ["fibres"])) == "fiber"


@pytest.mark.slow
def test_batch_takes_them_and_finds_what_former_versions_did(
    cup: samples.Sample, tmp_path: Path
) -> None:
    case = Case("cup", cup.mask, choices={"refine": False})
    with pytest.warns(FutureWarning, match="option refine is now optimize"):
        table = batch([case], tmp_path, elements=(1, 4, 2))
    assert not table["optimize"].any()
    job = Job(
        "cup", case, Options(elements=(1, 4, 2), optimize=False), (1,), tmp_path / "cases",
        ("exf", "vtu"),
    )  # fmt: skip
    assert is_as_asked(job)
    file = tmp_path / "cases" / "cup" / "rows.json"
    record = json.loads(file.read_text())
    former = {v: k for k, v in renamed.COLUMNS.items()}
    rows = [{former.get(k, k): v for k, v in row.items()} for row in record["rows"]]
    assert "refine" in rows[0]
    rows[0]["depth"] = "graded"
    file.write_text(json.dumps({"key": job.key(former=True), "rows": rows}))
    pd.DataFrame(rows).to_parquet(tmp_path / "results.parquet")
    with warnings.catch_warnings():
        warnings.simplefilter("error", FutureWarning)
        assert is_as_asked(job)
        assert rows_of(job) == record["rows"]
        read = read_results(tmp_path)
    assert set(read) == set(record["rows"][0])
    assert read["transmural_grading"].tolist() == [True]


def test_columns_of_former_tables_are_renamed() -> None:
    assert renamed.new_column("fair_unrefined_normal_mean") == "fair_unoptimized_normal_mean"
    assert renamed.new_column("error_mean") == "error_mean"


def test_report_of_a_former_version_is_read(tmp_path: Path) -> None:
    options = {name: former for name, (former, _) in GIVEN.items() if name != "refine"}
    (tmp_path / "report.json").write_text(json.dumps({"options": {"lod": 2, **options}}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = options_beside(tmp_path / "mesh.exf")
    assert found == Options(
        lod=2, **{now(name): new for name, (_, new) in GIVEN.items() if name != "refine"}
    )


def test_former_options_are_those_of_former_versions() -> None:
    new = {now(name): value for name, (_, value) in GIVEN.items()}
    assert renamed.former_options(new) == {name: former for name, (former, _) in GIVEN.items()}


def test_surface_of_a_former_file_has_its_new_name() -> None:
    for former, new in renamed.SURFACES.items():
        assert our_name(former) == new


@pytest.mark.parametrize("flag", renamed.FLAGS)
def test_flag_is_taken(flag: str) -> None:
    new = renamed.FLAGS[flag]
    if isinstance(new, str):
        cases = {(flag,): [new], (f"{flag}=x",): [f"{new}=x"]}
    else:
        cases = {(flag, value): list(flags) for value, flags in new.items()}
        cases |= {(f"{flag}={value}",): list(flags) for value, flags in new.items()}
    for given, wanted in cases.items():
        with pytest.warns(FutureWarning, match=f"{flag} is now --"):
            assert renamed.new_flags(["fit", *given, "-o", "out"]) == ["fit", *wanted, "-o", "out"]


def test_every_new_flag_is_one() -> None:
    told = {name: CliRunner().invoke(app, [name, "--help"]).stdout for name in ("fit", "render")}
    for new in renamed.FLAGS.values():
        flags = {new} if isinstance(new, str) else {of[0] for of in new.values() if of}
        for flag in flags:
            assert any(flag in text for text in told.values()), flag


@pytest.mark.slow
def test_the_command_line_takes_them(cup: samples.Sample, tmp_path: Path) -> None:
    from heartgen.images.writing import write_mask

    write_mask(cup.mask, tmp_path / "cup.nii.gz")
    command = ["fit", str(tmp_path / "cup.nii.gz"), "-o", str(tmp_path / "out"), "--no-refine"]
    command += ["--elements", "1x4x2", "--fields", "none", "--depth", "linear", "--septum=-1,-1,0"]
    with pytest.warns(FutureWarning, match="is now --") as told:
        assert CliRunner().invoke(app, command).exit_code == 0
    assert len(told) == 3
    options = json.loads((tmp_path / "out" / "report.json").read_text())["options"]
    assert not options["optimize"]
    assert not options["transmural_grading"]
    assert options["septal_direction"] == [-1, -1, 0]


@pytest.mark.parametrize("former", renamed.MODULES)
def test_module_is_where_it_was(former: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, former, raising=False)
    try:
        new = import_module(renamed.MODULES[former])
    except ImportError as error:
        pytest.skip(str(error))
    with pytest.warns(FutureWarning, match=f"{former} is now {new.__name__}"):
        module = import_module(former)
    name = next(name for name in vars(new) if not name.startswith("_") and name != "annotations")
    assert getattr(module, name) is getattr(new, name)
    for name, now in renamed.NAMES.get(new.__name__, {}).items():
        assert getattr(module, name) is getattr(new, now)


def test_what_is_in_a_module_is_imported_from_where_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "heartgen.refinement", raising=False)
    with pytest.warns(FutureWarning, match="heartgen.refinement is now heartgen.optimization"):
        from heartgen.refinement import refine  # type: ignore[import-not-found]
    from heartgen.optimization import optimize

    assert refine is optimize


@pytest.mark.parametrize("package", ["anatomy", "fields", "optimization", "viewing", "widgets"])
def test_name_is_in_its_package(package: str) -> None:
    module = import_module(f"heartgen.{package}")
    for former, new in renamed.NAMES[f"heartgen.{package}"].items():
        with pytest.warns(FutureWarning, match=f"{former} is now {new}"):
            assert getattr(module, former) is getattr(module, new)
        assert former not in module.__all__
    with pytest.raises(AttributeError, match="nonsense"):
        _ = module.nonsense


@pytest.mark.parametrize(
    ("module", "name"),
    [(module, name) for module, names in renamed.MOVED.items() for name in names],
)
def test_name_that_left_its_module_is_imported_from_it(
    module: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = renamed.MOVED[module][name]
    told = renamed.REPLACED.get(name, f"{place}.{name}")
    same = getattr(import_module(place), name)
    assert locate(told) is not None
    former = [old for old, new in renamed.MODULES.items() if new == module] or [module]
    for home in former:
        if home != module:
            monkeypatch.delitem(sys.modules, home, raising=False)
        with pytest.warns(FutureWarning, match=f"{module}.{name} is now {told}"):
            assert getattr(import_module(home), name) is same


def test_functions_that_are_no_more_give_what_they_gave(cup: samples.Sample) -> None:
    from heartgen import former

    mesh = heartgen.personalize(cup.mask, elements=(1, 4, 2), optimize=False).mesh
    parameters = former.nodal_parameters(mesh)
    assert len(parameters.values) == parameters.counts.sum()
    generic = former.generic_mesh(mesh.topology)
    np.testing.assert_array_equal(generic.control, mesh.topology.generic)
    assert former.elements_from_text("1x12x6") == (1, 12, 6)
    assert former.direction_from_text("-1,-1,0") == (-1, -1, 0)
    scene = former.empty_scene((30, 20))
    assert former.finished(scene, None) is scene
    assert scene.window_size == [30, 20]
    scene.close()


def test_no_former_module_is_there() -> None:
    for former in renamed.MODULES:
        path = Path(heartgen.__file__).parent.joinpath(*former.split(".")[1:])
        assert not path.with_suffix(".py").exists()
        assert not (path / "__init__.py").exists()
