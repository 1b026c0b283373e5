"""Former names, which work until `REMOVED_IN` and warn with the new ones.

Names that users type or import warn. Files of former versions are read without a word: whoever
opens one has nothing to mend in it.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

if TYPE_CHECKING:
    from pandas import DataFrame

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C", bound=type)

REMOVED_IN = "0.2"
"""Version without the former names."""

OPTIONS: Mapping[str, tuple[str, Mapping[Any, Any]]] = {
    "refine": ("optimize", {}),
    "least_quality": ("min_jacobian_ratio", {}),
    "depth": ("transmural_grading", {"graded": True, "linear": False}),
    "interior": ("transmural_lines", {"relaxed": "curved"}),
    "septum": ("septal_direction", {}),
    "shifts": ("slice_alignment", {}),
}
"""Options: former name to new name, and former values to new ones."""

FLAGS: Mapping[str, str | Mapping[str, tuple[str, ...]]] = {
    "--no-refine": "--no-optimize",
    "--least-quality": "--min-jacobian-ratio",
    "--depth": {"graded": (), "linear": ("--no-grading",)},
    "--interior": {
        "straight": ("--transmural-lines", "straight"),
        "relaxed": ("--transmural-lines", "curved"),
    },
    "--septum": "--septal-direction",
    "--shifts": "--slice-alignment",
    "--fibre-angles": "--fiber-angles",
    "--colour": "--color",
}
"""Flags of the command line: the new flag, or what stands for a flag and its value."""

WORDS: Mapping[str, str] = {
    "fibres": "fibers",
    "fibres-endo": "fibers-endo",
    "fibres-mid": "fibers-mid",
    "fibres-epi": "fibers-epi",
}
"""Names of fields and of colorings."""

KEYWORDS: Mapping[str, str] = {"septum": "septal_direction", "colours": "colors", "colour": "color"}
"""Arguments of functions."""

REPORT: Mapping[str, str] = {
    "unrefined_quality": "unoptimized_quality",
    "unrefined_fairness": "unoptimized_fairness",
}
"""Attributes of a report, and their keys in its file."""

COLUMNS: Mapping[str, str] = {
    "q_unrefined": "q_unoptimized",
    "seconds_refinement": "seconds_optimization",
    "error_apex": "error_apical_rim",
    **{old: new for old, (new, _) in OPTIONS.items()},
}
"""Columns of stored results; and those that begin with `COLUMN_START`."""

COLUMN_START = ("fair_unrefined_", "fair_unoptimized_")

SURFACES: Mapping[str, str] = {"apex": "apical_rim"}
"""Named surfaces in files of meshes."""

MODULES: Mapping[str, str] = {
    "heartgen.anatomy.following": "heartgen.anatomy.slice_tracking",
    "heartgen.anatomy.pools": "heartgen.anatomy.blood_pools",
    "heartgen.anatomy.right": "heartgen.anatomy.right_ventricle",
    "heartgen.anatomy.sections": "heartgen.anatomy.short_axis_contours",
    "heartgen.anatomy.shape": "heartgen.anatomy.heart_shape",
    "heartgen.anatomy.sheet": "heartgen.anatomy.basal_surface",
    "heartgen.anatomy.shifts": "heartgen.anatomy.slice_alignment",
    "heartgen.anatomy.surfaces": "heartgen.anatomy.fit_surfaces",
    "heartgen.apps": "heartgen.widgets",
    "heartgen.apps.cases": "heartgen.widgets.input_case",
    "heartgen.apps.choices": "heartgen.widgets.run_options",
    "heartgen.apps.colours": "heartgen.widgets.colors",
    "heartgen.apps.guard": "heartgen.serving.guard",
    "heartgen.apps.lessons": "heartgen.widgets.notebook_cells",
    "heartgen.apps.page": "heartgen.widgets.dashboard_page",
    "heartgen.apps.panels.judge": "heartgen.widgets.panels.assess",
    "heartgen.apps.panels.look": "heartgen.widgets.panels.view",
    "heartgen.apps.panels.options": "heartgen.widgets.panels.fit_options",
    "heartgen.apps.panels.take": "heartgen.widgets.panels.export",
    "heartgen.apps.scene": "heartgen.widgets.mesh_scene",
    "heartgen.apps.server": "heartgen.serving.server",
    "heartgen.apps.standalone": "heartgen.serving.standalone",
    "heartgen.cli.choices": "heartgen.cli.parameters",
    "heartgen.cohort.choices": "heartgen.options.text",
    "heartgen.cohort.option_text": "heartgen.options.text",
    "heartgen.cohort.report": "heartgen.cohort.batch_report",
    "heartgen.cohort.tables": "heartgen.cohort.case_tables",
    "heartgen.concessions": "heartgen.fit_findings",
    "heartgen.fields.catalogue": "heartgen.fields.catalog",
    "heartgen.fields.fibres": "heartgen.fields.fibers",
    "heartgen.fields.lines": "heartgen.fields.coordinate_lines",
    "heartgen.fields.motion": "heartgen.fields.strains",
    "heartgen.fields.patch": "heartgen.fields.patch_coordinates",
    "heartgen.fields.shape": "heartgen.fields.wall_shape",
    "heartgen.formats.files": "heartgen.formats.written",
    "heartgen.formats.reading": "heartgen.formats.mesh_reading",
    "heartgen.formats.resampling.writing": "heartgen.formats.resampling.cell_files",
    "heartgen.formats.skeleton": "heartgen.mesh.skeleton",
    "heartgen.formats.surfaces": "heartgen.formats.surface_files",
    "heartgen.images.files": "heartgen.images.file_kinds",
    "heartgen.images.frames": "heartgen.images.cine_frames",
    "heartgen.images.wall": "heartgen.images.rv_wall",
    "heartgen.mesh.biventricular": "heartgen.mesh.biventricular_topology",
    "heartgen.mesh.freedom": "heartgen.mesh.dof_map",
    "heartgen.mesh.lattice": "heartgen.mesh.lagrange_nodes",
    "heartgen.mesh.numbering": "heartgen.mesh.connectivity",
    "heartgen.mesh.patch": "heartgen.mesh.apical_patch",
    "heartgen.mesh.pieces": "heartgen.mesh.subdivisions",
    "heartgen.mesh.sharing": "heartgen.mesh.connectivity",
    "heartgen.mesh.sheet": "heartgen.mesh.surface_chart",
    "heartgen.mesh.surfaces": "heartgen.mesh.surface_faces",
    "heartgen.refinement": "heartgen.optimization",
    "heartgen.refinement.interior": "heartgen.optimization.transmural_lines",
    "heartgen.refinement.lines": "heartgen.optimization.surface_lines",
    "heartgen.samples.biventricle": "heartgen.samples.biv_shape",
    "heartgen.samples.biventricular": "heartgen.samples.biv_phantom",
    "heartgen.samples.catalogue": "heartgen.samples.named",
    "heartgen.samples.patch": "heartgen.samples.surface_patch",
    "heartgen.samples.right": "heartgen.samples.rv_truth",
    "heartgen.samples.shape": "heartgen.samples.lv_shape",
    "heartgen.templates.chart": "heartgen.templates.biventricular_surface",
    "heartgen.templates.disc": "heartgen.templates.patch_map",
    "heartgen.viewing.fibres": "heartgen.viewing.fiber_glyphs",
    "heartgen.viewing.slices": "heartgen.viewing.slice_views",
    "heartgen.viewing.surfaces": "heartgen.viewing.polydata",
}
"""Modules; what is below a package goes with it."""

NAMES: Mapping[str, Mapping[str, str]] = {
    "heartgen.anatomy": {
        "RightVentricle": "RvAnatomy",
        "Sheet": "BasalSurface",
        "analyse": "analyze",
        "analyse_under": "analyze_under",
    },
    "heartgen.fields": {"FibreRule": "FiberRule", "fibre_frames": "fiber_frames"},
    "heartgen.optimization": {
        "Refined": "Optimized",
        "refine": "optimize",
        "relax": "curve_transmural_lines",
    },
    "heartgen.viewing": {"plot_fibres": "plot_fibers"},
    "heartgen.widgets": {"look": "view"},
    "heartgen.fit_findings": {
        "fallen_back": "lod_reduced",
        "fitted_less": "elements_regularized",
        "poorer": "min_jacobian_ratio_missed",
    },
    "heartgen.anatomy.basal_surface": {"Sheet": "BasalSurface", "fit_sheet": "fit_basal_surface"},
    "heartgen.anatomy.right_ventricle": {"RightVentricle": "RvAnatomy"},
    "heartgen.fields.fibers": {"FibreRule": "FiberRule", "fibre_frames": "fiber_frames"},
    "heartgen.mesh.biventricular_topology": {"Opening": "RvAttachment"},
    "heartgen.mesh.connectivity": {"coincident": "merge_coincident"},
    "heartgen.mesh.dof_map": {"FaceFreedom": "FaceDofMap", "Freedom": "DofMap"},
    "heartgen.mesh.surface_chart": {"Sheet": "SurfaceChart"},
    "heartgen.viewing.fiber_glyphs": {"plot_fibres": "plot_fibers", "add_fibres": "add_fibers"},
}
"""Names in modules, by the modules' new names."""


def new_options(choices: Mapping[str, Any], *, stored: bool = False) -> dict[str, Any]:
    """Options under their new names, with their new values.

    Parameters
    ----------
    choices : mapping of str to value
        A list of values stands for each of them.
    stored : bool
        Whether they come from a file, and not from somebody who could be told.

    Returns
    -------
    dict
        In the same order.

    Raises
    ------
    TypeError
        If an option is given under both names.
    """
    made: dict[str, Any] = {}
    for name, value in choices.items():
        new, values = OPTIONS.get(name, (name, {}))
        if new != name and new in choices:
            raise TypeError(f"{name} is the former name of {new}: give one of them")
        if new != name and not stored:
            _warn(f"option {name}", new)
        each = value if isinstance(value, list) else [value]
        changed = [values.get(v, v) if isinstance(v, str) else v for v in each]
        made[new] = changed if isinstance(value, list) else changed[0]
    return made


def former_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options as former versions wrote them, in the same order.

    Parameters
    ----------
    options : mapping of str to object
        By their new names.
    """
    back = {new: (old, {v: k for k, v in values.items()}) for old, (new, values) in OPTIONS.items()}
    made = {}
    for name, value in options.items():
        old, values = back.get(name, (name, {}))
        made[old] = values.get(value, value) if values else value
    return made


def new_setting(name: str, text: str) -> tuple[str, str]:
    """Name and value of an option as users write them, both new.

    Parameters
    ----------
    name : str
        Of the option, new or former.
    text : str
        Its value, new or former.
    """
    if name not in OPTIONS:
        return name, text
    new, values = OPTIONS[name]
    _warn(f"option {name}", new)
    value = values.get(text.strip(), text)
    return new, ("yes" if value else "no") if isinstance(value, bool) else value


def new_flags(arguments: Iterable[str]) -> list[str]:
    """Arguments of a command with the flags' new names.

    Parameters
    ----------
    arguments : iterable of str
        The command line.
    """
    made: list[str] = []
    rest = list(arguments)
    while rest:
        argument = rest.pop(0)
        if argument == "--":
            return [*made, argument, *rest]
        flag, equals, value = argument.partition("=")
        new = FLAGS.get(flag)
        if new is None:
            made.append(argument)
        elif isinstance(new, str):
            _warn(flag, new)
            made.append(new + equals + value)
        else:
            value = value if equals else rest.pop(0) if rest else ""
            # A value that there never was is for the new flag to refuse.
            made += new.get(value, (argument, value))
            _warn(flag, next(of[0] for of in new.values() if of))
    return made


def new_word(word: str) -> str:
    """The name of a field or coloring.

    Parameters
    ----------
    word : str
        New or former.
    """
    if word in WORDS:
        _warn(repr(word), repr(WORDS[word]))
    return WORDS.get(word, word)


def new_column(name: str) -> str:
    """The name of a column of stored results.

    Parameters
    ----------
    name : str
        New or former.
    """
    start, now = COLUMN_START
    return now + name.removeprefix(start) if name.startswith(start) else COLUMNS.get(name, name)


def new_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A stored row of results under the new names.

    Parameters
    ----------
    row : mapping of str to object
        Values by column.
    """
    return {new_column(k): v for k, v in new_options(row, stored=True).items()}


def new_table(table: DataFrame) -> DataFrame:
    """A stored table of results under the new names.

    Parameters
    ----------
    table : DataFrame
        As it was stored.
    """
    for name in OPTIONS.keys() & set(table):
        values = OPTIONS[name][1]
        table[name] = [values.get(value, value) for value in table[name]]
    return table.rename(columns=new_column)


def takes_former_options(cls: C) -> C:
    """Let a dataclass of options be made with former names, and have them as attributes.

    Parameters
    ----------
    cls : type
        The dataclass; changed, and returned.
    """
    made = cls.__init__  # type: ignore[misc]  # of this class alone

    @wraps(made)
    def init(self: Any, *args: Any, **choices: Any) -> None:
        made(self, *args, **new_options(choices))

    setattr(cls, "__init__", init)  # noqa: B010  # as an assignment, it is refused by mypy
    return has_former_attributes({old: new for old, (new, _) in OPTIONS.items()})(cls)


def has_former_attributes(names: Mapping[str, str]) -> Callable[[C], C]:
    """Let objects of a class have attributes under former names; values are the new ones.

    Parameters
    ----------
    names : mapping of str to str
        New names by the former ones.
    """

    def former(self: Any, name: str) -> Any:
        if name not in names:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        _warn(f"{type(self).__name__}.{name}", names[name])
        return getattr(self, names[name])

    def extended(cls: C) -> C:
        setattr(cls, "__getattr__", former)  # noqa: B010  # unseen by mypy, which checks new names
        return cls

    return extended


def takes_former_keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function be called with the former names of its arguments.

    Parameters
    ----------
    function : callable
        To be wrapped.
    """

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in KEYWORDS.keys() & kwargs.keys():
            _warn(f"argument {name}", KEYWORDS[name])
            kwargs[KEYWORDS[name]] = kwargs.pop(name)
        return function(*args, **kwargs)

    return called


def keep_former_names(module: str) -> None:
    """Let names be imported from a module under former names, as `NAMES` has them.

    Parameters
    ----------
    module : str
        Its name.
    """
    home = sys.modules[module]
    known = getattr(home, "__getattr__", None)

    def former(name: str) -> Any:
        new = NAMES[module].get(name)
        if new is not None:
            _warn(f"{module}.{name}", new)
            return getattr(home, new)
        if known is not None:
            return known(name)
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    setattr(home, "__getattr__", former)  # noqa: B010  # unseen by mypy, which checks new names


def new_module(name: str) -> str | None:
    """Where a module is now; None if it was never elsewhere.

    Parameters
    ----------
    name : str
        New or former, with all packages.
    """
    found = name
    while True:
        old = max((m for m in MODULES if f"{found}.".startswith(f"{m}.")), key=len, default=None)
        if old is None:
            return None if found == name else found
        found = MODULES[old] + found.removeprefix(old)


class FormerModules(MetaPathFinder, Loader):
    """Finds modules under their former names: what is in them comes from where they are now."""

    def find_spec(
        self, fullname: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Say that there is such a module.

        Parameters
        ----------
        fullname : str
            Of the module that is imported.
        path : object
            Not used.
        target : module or None
            Not used.
        """
        if not fullname.startswith("heartgen.") or new_module(fullname) is None:
            return None
        return ModuleSpec(fullname, self, is_package=True)

    def exec_module(self, module: ModuleType) -> None:
        """Have everything looked up where it is now.

        Parameters
        ----------
        module : ModuleType
            Empty, to be filled.
        """
        new = new_module(module.__name__)
        assert new is not None
        _warn(module.__name__, new)
        home = import_module(new)

        def there(name: str) -> Any:
            return getattr(home, NAMES.get(home.__name__, {}).get(name, name))

        setattr(module, "__getattr__", there)  # noqa: B010


def _warn(old: str, new: str) -> None:
    """Tell of a new name, at the line of the caller outside of heartgen."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and _is_ours(frame):
        level += not _is_bootstrap(frame)  # which `warnings` does not count
        frame = frame.f_back
    warnings.warn(
        f"{old} is now {new}: the former name works until heartgen {REMOVED_IN}",
        FutureWarning,
        stacklevel=level,
    )


def _is_ours(frame: FrameType) -> bool:
    """Whether a frame is of heartgen or of the machinery of imports."""
    name = str(frame.f_globals.get("__name__", ""))
    return name.partition(".")[0] in ("heartgen", "importlib")


def _is_bootstrap(frame: FrameType) -> bool:
    """Whether a frame is of the innermost machinery of imports."""
    return str(frame.f_globals.get("__name__", "")).startswith("importlib._bootstrap")
