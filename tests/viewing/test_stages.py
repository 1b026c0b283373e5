"""The stages of the pipeline in pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen.viewing import draw_mesh, draw_stages
from heartgen.viewing.stages import STAGES, stages_of


def test_every_stage_is_drawn_with_its_distance_and_quality(result):
    figure = draw_stages(result)
    titles = [axes.get_title() for axes in figure.axes]
    assert [title.splitlines()[0] for title in titles] == [stage.title for stage in STAGES]
    assert [", Q " in title for title in titles] == [not stage.registered for stage in STAGES]
    assert f"Q {result.report.quality.mean:.2f}" in titles[-1]


def test_stages_that_were_left_out_are_not_drawn(result):
    paper = replace(result, options=replace(result.options, optimize=False))
    assert [stage.key for stage in stages_of(paper)][-1] == "enhanced"


def test_lines_lie_where_the_plane_cuts_the_mesh(result):
    figure = draw_mesh(result.mesh, result.mask, result.anatomy, "Mesh")
    (lines,) = figure.axes[0].collections
    points = np.concatenate(lines.get_segments())
    whole = result.anatomy.to_heart(result.mesh.evaluate(np.full((1, 3), 0.5)).reshape(-1, 3))
    assert points[:, 1].min() < whole[:, 2].min()
    assert points[:, 1].max() < 10
    assert np.ptp(points[:, 0]) == pytest.approx(np.ptp(whole[:, 0]), rel=0.3)
