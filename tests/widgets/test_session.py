from __future__ import annotations

import threading

import nibabel as nib
import numpy as np
import pytest
from scipy.ndimage import binary_fill_holes

from heartgen import pipeline, samples
from heartgen.errors import HeartgenError, sentence
from heartgen.options import STEPS, Options
from heartgen.widgets.costs import Costs
from heartgen.widgets.input_case import load_file
from heartgen.widgets.runs import ALL_LEVELS, siblings
from heartgen.widgets.session import Session


def phases(session):
    return {key: state.phase for key, state in session.states.items()}


def test_every_step_of_an_empty_page_says_why(session):
    assert phases(session) == {
        "input": "ready",
        "choices": "blocked",
        "run": "blocked",
        "view": "blocked",
        "assess": "blocked",
        "export": "blocked",
    }
    assert all(state.reason for state in session.states.values())
    with pytest.raises(HeartgenError, match="no mask to mesh"):
        session.start()


def test_a_sample_opens_the_next_steps(session):
    session.load_sample("lifelike").result()
    assert phases(session)["input"] == phases(session)["choices"] == "done"
    assert phases(session)["run"] == phases(session)["view"] == "ready"
    assert phases(session)["assess"] == "blocked"


@pytest.mark.slow
def test_a_run_opens_all_steps(finished):
    assert phases(finished) == {
        "input": "done",
        "choices": "done",
        "run": "done",
        "view": "done",
        "assess": "done",
        "export": "ready",
    }
    run = finished.runs[0]
    assert run.shares == dict.fromkeys(STEPS, 1.0)
    assert run.seconds > 0
    assert finished.shown.result.report.success


@pytest.mark.slow
def test_known_anatomy_is_not_measured_again_and_changes_nothing(finished):
    session = finished
    result = pipeline.personalize(session.case.mask)
    assert (result.mesh.dofs == session.shown.result.mesh.dofs).all()
    assert session.shown.result.anatomy is session.anatomy


def test_a_file_that_is_no_image_blocks_the_run_until_the_heart_before_is_kept(session, tmp_path):
    session.load_sample("lifelike").result()
    before = session.case
    (tmp_path / "wrong.nii.gz").write_text("hello")
    session.load_file(tmp_path / "wrong.nii.gz").result()
    assert session.states["input"].phase == "failed"
    assert "wrong.nii.gz" in session.complaint
    assert "Traceback" not in session.complaint
    assert session.case is before
    assert phases(session)["choices"] == phases(session)["run"] == "blocked"
    assert "refused" in session.states["run"].reason
    with pytest.raises(HeartgenError, match="the input was refused"):
        session.start()
    session.choices.truncate = "off"  # a choice does not make a refused input one to run
    assert phases(session)["run"] == "blocked"
    session.choices.truncate = "auto"
    session.keep()
    assert session.complaint == ""
    assert phases(session)["input"] == phases(session)["choices"] == "done"
    assert phases(session)["run"] == "ready"


def test_a_heart_that_cannot_be_measured_is_not_run(session):
    session.load_sample("lifelike").result()
    session.choices.truncate = 500.0
    session._pool.submit(lambda: None).result()
    assert "does not fit" in session.complaint
    assert phases(session)["run"] == "blocked"
    assert phases(session)["choices"] == "done"
    session.choices.truncate = "auto"
    assert session.complaint == ""
    assert phases(session)["run"] == "ready"


def test_a_label_map_that_was_taken_for_a_mask_is_offered_as_one(session, tmp_path):
    wall = samples.lifelike_lv(2.5).mask
    filled = np.stack([binary_fill_holes(p) for p in np.moveaxis(wall.voxels, 2, 0)], axis=2)
    labels = (2 * wall.voxels + 3 * (filled & ~wall.voxels)).astype(np.uint8)
    nib.save(nib.Nifti1Image(labels, np.diag([-1, -1, 1, 1]) @ wall.affine), tmp_path / "l.nii")
    session.load_file(tmp_path / "l.nii").result()
    assert session.offer == "auto"
    assert "say under File is what they are" in session.complaint
    session.load_file(tmp_path / "l.nii", session.offer).result()
    assert (session.offer, session.complaint, session.awaited) == ("", "", False)
    assert phases(session)["run"] == "ready"


@pytest.mark.slow
def test_a_run_of_a_heart_before_is_not_shown_as_the_new_one(session):
    session.load_sample("lifelike").result()
    before = session.case
    ended = session.start()
    loaded = session.load_sample("biv")
    ended.result()
    loaded.result()
    assert session.case is not before
    assert session.shown is None
    if session.outcomes:  # it was not yet done when the other heart came
        session.show(session.outcomes[0])
        assert session.case is before


def test_a_frame_of_a_cine_is_read_and_its_code_says_so(tmp_path):
    heart = samples.load("lifelike").mask
    small = np.zeros_like(heart.voxels)
    small[:, :, 4:] = heart.voxels[:, :, :-4]
    frames = np.stack([heart.voxels, heart.voxels | small], axis=-1).astype(np.uint8)
    nib.save(nib.Nifti1Image(frames, np.diag([2.0, 2, 2, 1])), tmp_path / "cine.nii.gz")
    case = load_file(tmp_path / "cine.nii.gz", frame=" 2 ")
    assert case.mask.voxels.sum() == frames[..., 1].sum()
    assert case.code == "heartgen.read_mask('cine.nii.gz', frame='2')"


@pytest.mark.slow
def test_cancel_counts_at_once_and_stops_the_pipeline(session):
    session.load_sample("lifelike").result()
    reached = threading.Event()
    future = session.start(ALL_LEVELS)
    run = session.runs[0]
    run.observe(lambda change: reached.set(), ["step"])
    assert reached.wait(60)
    run.cancel()
    assert run.phase == "cancelled"
    assert session.states["run"].phase == "ready"
    future.result(120)
    assert session.outcomes == []
    assert run.phase == "cancelled"


@pytest.mark.slow
def test_a_run_after_a_cancelled_one_finishes(session):
    session.load_sample("lifelike").result()
    session.start()
    session.runs[0].cancel()
    session.start().result()
    assert [run.phase for run in session.runs] == ["cancelled", "done"]


@pytest.mark.slow
def test_chosen_elements_are_those_of_the_mesh(session):
    session.load_sample("lifelike").result()
    session.choices.elements = (1, 8, 4)
    session.start().result()
    assert session.shown.result.mesh.topology.shape == (1, 8, 4)


def test_contradicting_choices_are_told(session):
    session.load_sample("lifelike").result()
    session.choices.apex = "patch"
    session.choices.elements = (1, 9, 6)
    told = "9 elements around cannot end in a square patch"
    assert session.states["choices"].phase == "failed"
    assert told in session.states["choices"].reason
    assert session.states["run"].phase == "blocked"
    assert "contradict" in session.states["run"].reason
    with pytest.raises(HeartgenError, match=told):
        session.start()
    assert session.runs == []
    session.choices.elements = (1, 8, 6)
    assert phases(session)["choices"] == "done"
    assert phases(session)["run"] == "ready"


@pytest.mark.slow
def test_basis_is_handed_on(session):
    session.load_sample("lifelike").result()
    session.choices.basis = "lagrange"
    session.start().result()
    assert session.shown.result.mesh.topology.basis == "lagrange"
    assert session.shown.result.options.basis == "lagrange"


def test_failing_pipeline_is_a_sentence(session, monkeypatch):
    def fail(*arguments, **options):
        raise ValueError("of no use")

    session.load_sample("lifelike").result()
    monkeypatch.setattr(pipeline, "personalize_levels", fail)
    session.start().result()
    assert session.states["run"].phase == "failed"
    assert "heartgen itself failed (ValueError: of no use)" in session.states["run"].reason


def test_truncation_has_the_heart_measured_anew(session):
    session.load_sample("lifelike").result()
    before = session.anatomy
    session.choices.truncate = 5.0
    session._pool.submit(lambda: None).result()
    assert session.anatomy is not before
    assert session.anatomy.base.truncation == pytest.approx(5.0)


@pytest.mark.slow
def test_levels_are_siblings_and_the_chosen_one_is_shown(session):
    session.load_sample("lifelike").result()
    session.choices.lod = 2
    session.start((1, 2)).result()
    assert session.shown.lod == 2
    assert [o.lod for o in siblings(session, session.shown)] == [1, 2]
    assert session.runs[0].shares == dict.fromkeys(STEPS, 1.0)


@pytest.mark.slow
def test_showing_an_older_run_brings_its_input_back(session):
    session.load_sample("lifelike").result()
    session.start().result()
    old = session.shown
    session.load_sample("other").result()
    session.case = type(old.case)(old.case.mask, "other", "1")
    session.show(old)
    assert session.case is old.case
    assert session.anatomy is old.result.anatomy


def test_closing_removes_what_was_uploaded(tmp_path):
    session = Session()
    (session.folder / "upload").write_text("private")
    session.close()
    assert not session.folder.exists()


def test_folders_are_the_visitors_own():
    one, two = Session(), Session()
    assert one.folder != two.folder
    assert one.folder.stat().st_mode & 0o077 == 0
    one.close()
    two.close()


def test_expectation_grows_with_level_and_learns():
    costs = Costs()
    low, high = (sum(costs.expect(Options(), False, (n,), True).values()) for n in (1, 5))
    assert 0 < low < high
    costs.learn(costs.expect(Options(), False, (1,), True), 4 * low)
    assert sum(costs.expect(Options(), False, (1,), True).values()) == pytest.approx(2 * low)


def test_too_little_memory_is_a_sentence():
    assert "crop it to the heart" in sentence(MemoryError())
