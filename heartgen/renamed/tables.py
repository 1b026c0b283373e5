"""The tables of former names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
    "heartgen.apps.session": "heartgen.widgets.session",
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
    "heartgen.formats.nodal": "heartgen.mesh.versions",
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

MOVED: Mapping[str, Mapping[str, str]] = {
    "heartgen.mesh.connectivity": {"generic_mesh": "heartgen.former"},
    "heartgen.mesh.versions": dict.fromkeys(
        ("NodalParameters", "nodal_parameters"), "heartgen.former"
    ),
    "heartgen.options": dict.fromkeys(
        ("direction_from_text", "elements_from_text"), "heartgen.former"
    ),
    "heartgen.options.text": {
        "UNSET": "heartgen.options.option",
        "as_text": "heartgen.options.option",
        "combinations": "heartgen.cohort.sweeping",
    },
    "heartgen.viewing.fields": dict.fromkeys(("empty_scene", "finished"), "heartgen.former"),
    "heartgen.viewing.scene": {
        **dict.fromkeys(
            ("AZIMUTH", "ELEVATION", "FILL", "UPRIGHT", "VIEW_ANGLE", "camera_around"),
            "heartgen.viewing.camera",
        ),
        **dict.fromkeys(("can_render", "require_graphics"), "heartgen.viewing.windows"),
    },
    "heartgen.widgets.session": dict.fromkeys(
        ("ALL_LEVELS", "post_on_loop", "siblings"), "heartgen.widgets.runs"
    ),
}
"""Where names are now that are the same and have left their modules, by the modules' new names."""

REPLACED: Mapping[str, str] = {
    "NodalParameters": "heartgen.mesh.versions.Versions",
    "direction_from_text": "heartgen.options.option_from_text",
    "elements_from_text": "heartgen.options.option_from_text",
    "empty_scene": "heartgen.viewing.windows.Window.empty",
    "finished": "heartgen.viewing.windows.Window.shown",
    "generic_mesh": "heartgen.mesh.topology.Topology.generic",
    "nodal_parameters": "heartgen.mesh.topology.Topology.versions",
}
"""What is used instead of each name of `heartgen.former`."""
