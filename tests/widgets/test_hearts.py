"""Which hearts are in an upload, and all of several fitted, without a browser."""

from __future__ import annotations

import csv
import io
import time
import zipfile

import nibabel as nib
import numpy as np
import pytest

from heartgen import samples
from heartgen.errors import InputError
from heartgen.options import Options
from heartgen.widgets.bundle import manifest, reproduce
from heartgen.widgets.hearts import hearts_in, may_have_frames, unpacked
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.keeping import store
from heartgen.widgets.keeping.archive import open_saved, saved
from heartgen.widgets.keeping.session import Keeping
from heartgen.widgets.panels.source import SourcePanel
from heartgen.widgets.results_table import results_csv
from heartgen.widgets.runs import Run
from heartgen.widgets.session import Session


def image(path, voxels=None, mask=None):
    mask = mask or samples.lifelike_lv(3.0).mask
    voxels = mask.voxels if voxels is None else voxels
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ mask.affine
    path.parent.mkdir(parents=True, exist_ok=True)
    nib.save(nib.Nifti1Image(voxels.astype(np.uint8), ras), path)
    return path


def test_several_images_are_several_hearts(tmp_path):
    paths = [image(tmp_path / name) for name in ("b.nii.gz", "a.nii.gz")]
    assert hearts_in(tmp_path) == sorted(paths)
    assert hearts_in(paths[0]) == paths[:1]


def test_a_file_for_each_structure_is_one_heart(tmp_path):
    names = ("heart_myocardium", "heart_ventricle_left", "heart_ventricle_right")
    for name in names:
        image(tmp_path / "case" / f"{name}.nii.gz")
    with zipfile.ZipFile(tmp_path / "case.zip", "w") as archive:
        for file in (tmp_path / "case").iterdir():
            archive.write(file, f"inside/{file.name}")
        archive.writestr("__MACOSX/._inside", "of the system")
    folder = tmp_path / "unpacked"
    folder.mkdir()
    moved = (tmp_path / "case.zip").rename(folder / "case.zip")
    assert hearts_in(moved) == [folder / "case" / "inside"]
    assert not moved.exists()


def test_a_folder_of_slices_is_one_heart(tmp_path):
    for n in range(3):
        (tmp_path / f"IM{n}").write_bytes(b"\0" * 128 + b"DICM")
    assert hearts_in(tmp_path) == [tmp_path]


def test_archives_stay_in_their_place_and_within_bounds(tmp_path, monkeypatch):
    folder = tmp_path / "in"
    folder.mkdir()
    with zipfile.ZipFile(folder / "evil.zip", "w") as archive:
        archive.writestr("../../outside.nii", "x")
        archive.writestr("a.nii", "x" * 100)
    unpacked(folder / "evil.zip")
    assert not list(tmp_path.glob("outside.nii"))
    (folder / "none.zip").write_text("hello")
    with pytest.raises(InputError, match=r"none\.zip: This archive cannot be unpacked"):
        unpacked(folder / "none.zip")
    with zipfile.ZipFile(folder / "large.zip", "w") as archive:
        archive.writestr("a.nii", "x" * 100)
    monkeypatch.setattr("heartgen.widgets.hearts.MOST_BYTES", 99)
    with pytest.raises(InputError, match="too much"):
        unpacked(folder / "large.zip")


def test_archives_and_folders_in_an_upload_are_hearts_too(tmp_path):
    one, two, three = (image(tmp_path / n / f"{n}.nii.gz") for n in ("one", "two", "three"))
    with zipfile.ZipFile(tmp_path / "one" / "two.zip", "w") as archive:
        archive.write(two, "a/two.nii.gz")
        archive.write(three, "b/thr\nee.nii.gz")
    names = [path.name for path in hearts_in(one.parent)]
    assert names == ["one.nii.gz", "two.nii.gz", "three.nii.gz"]


def test_damaged_archives_are_refused_wherever_the_damage_is(tmp_path):
    with zipfile.ZipFile(tmp_path / "whole.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(image(tmp_path / "one.nii"), "one.nii")
    content = (tmp_path / "whole.zip").read_bytes()
    for at in np.linspace(40, len(content) - 100, 12, dtype=int):
        spoiled = tmp_path / "spoiled.zip"
        spoiled.write_bytes(content[:at] + bytes(8) + content[at + 8 :])
        with pytest.raises(InputError, match="cannot be unpacked"):
            unpacked(spoiled)


def test_a_frame_that_was_asked_for_is_not_asked_of_a_still_image(tmp_path):
    mask = samples.lifelike_lv(3.0).mask
    cine = image(tmp_path / "cine.nii.gz", np.stack([mask.voxels] * 2, axis=-1))
    still = image(tmp_path / "still.nii.gz")
    session = Session()
    source = SourcePanel(session)
    source._arrived(cine)
    source.frame.value = "2"
    source._arrived(still)
    session._pool.submit(lambda: None).result()
    assert session.complaint == ""
    assert session.case.name == "still.nii.gz"
    session.close()


def test_a_session_beside_images_is_told(tmp_path):
    image(tmp_path / "one.nii.gz")
    (tmp_path / "s.heartgen").write_text("")
    session = Session()
    SourcePanel(session)._arrived(tmp_path)
    assert "s.heartgen is a session" in session.complaint
    session.close()


def test_cancel_is_of_the_run_that_goes_on():
    session = Session()
    case, options = session_case(), Options()
    session.runs = [Run(case, options, number=n, levels=(1,)) for n in (1, 2, 3)]
    assert session.active_run is session.runs[0]
    session.runs[1].phase = "running"
    assert session.active_run is session.runs[1]
    for run in session.runs:
        run.phase = "cancelled"
    assert session.active_run is None
    session.close()


def session_case():
    mask = samples.lifelike_lv(3.0).mask
    return InputCase(mask, "mask", "")


def test_frames_are_asked_for_where_there_may_be_some(tmp_path):
    mask = samples.lifelike_lv(3.0).mask
    still = image(tmp_path / "still.nii.gz")
    cine = image(tmp_path / "cine.nii.gz", np.stack([mask.voxels] * 2, axis=-1))
    assert not may_have_frames(still)
    assert may_have_frames(cine)


def origin(path):
    """Where a heart comes from."""
    return {"file": str(path), "scheme": "binary", "frame": ""}


@pytest.mark.slow
def test_all_of_several_are_fitted_and_told_in_a_table(tmp_path):
    good = [image(tmp_path / f"{name}.nii.gz") for name in ("one", "two")]
    bad = tmp_path / "bad.nii.gz"
    bad.write_text("no image")
    session = Session()
    session.choices.optimize = False
    session.start_all(map(origin, (good[0], bad, good[1]))).result()
    session._fits.submit(lambda: None).result()
    assert [run.phase for run in session.runs] == ["done", "done"]
    assert "bad.nii.gz" in session.refused[0]
    session.rename(session.runs[1], "the second")
    rows = list(csv.DictReader(io.StringIO(results_csv(session.outcomes))))
    assert [row["case"] for row in rows] == ["1/one.nii.gz", "2/the second"]
    assert float(rows[0]["error_mean"]) == pytest.approx(
        session.outcomes[0].result.report.accuracy.mean
    )
    first = session.runs[0]
    session.delete(first)
    assert session.runs[0].number == 2
    assert all(outcome.source is not first for outcome in session.outcomes)
    session.close()


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Where sessions are kept."""
    monkeypatch.setenv(store.PLACE, str(tmp_path / "sessions"))


@pytest.mark.slow
def test_a_heart_that_is_looked_at_lends_its_mesh_to_no_other(tmp_path, kept):
    one = image(tmp_path / "one.nii.gz")
    two = image(tmp_path / "two.nii.gz", samples.lifelike_lv(3.0).mask.voxels[::-1])
    session = Session(keeping=Keeping(store.begun()))
    session.choices.optimize = False
    session.start_all([origin(one)]).result()
    session._fits.submit(lambda: None).result()
    session.show(session.outcomes[0])
    session.start_all([origin(two)]).result()
    session._fits.submit(lambda: None).result()
    assert session.runs[1].reused == ()
    first, second = (run.outcomes[0].result.mesh.dofs for run in session.runs)
    assert not np.allclose(first, second)
    session.close()


@pytest.mark.slow
@pytest.mark.slow
def test_the_heart_that_is_looked_at_is_seen_when_all_are_fitted(tmp_path):
    one, two = (image(tmp_path / f"{name}.nii.gz") for name in ("one", "two"))
    session = Session()
    session.choices.optimize = False
    session.load_origin(origin(one)).result()
    session.start_all(map(origin, (one, two))).result()
    session._fits.submit(lambda: None).result()
    assert [run.case is session.case for run in session.runs] == [True, False]
    assert session.runs[0].reused == ("shape analysis",)
    assert session.shown is session.runs[0].outcomes[0]
    session.close()


def test_hearts_that_wait_come_back(tmp_path, kept):
    place = store.begun()
    session = Session(keeping=Keeping(place))
    session.choices.optimize = False
    paths = [image(place.uploads / f"{name}.nii.gz") for name in ("one", "two")]
    session._pool.submit(time.sleep, 0.5)  # so that it is left before they are read
    session.start_all(map(origin, paths))
    session.choices.optimize = True  # for what is begun later
    again = Keeping(store.begun())
    there = store.found(place.key)
    past = again.past(there)
    assert [each.origin for each in past.queue] == [origin(path) for path in paths]
    session._pool.submit(lambda: None).result()
    assert session.runs == []  # whoever has the session now reads them
    session.close()
    later = Session(keeping=again)
    again.move(there, past)
    past.restore(later)
    later._pool.submit(lambda: None).result()
    assert [run.case.name for run in later.runs] == ["one.nii.gz", "two.nii.gz"]
    assert not any(run.options.optimize for run in later.runs)
    assert later.queue == []
    for run in later.runs:
        run.cancel()
    later.close()


@pytest.mark.slow
def test_views_of_one_heart_are_fitted_together_and_come_back(tmp_path, kept):
    place = store.begun()
    stack, dense = samples.lifelike_lv((2.0, 2.0, 10.0)).mask, samples.lifelike_lv(2.0).mask
    slice_ = np.zeros_like(dense.voxels)
    middle = int(np.argwhere(dense.voxels).mean(0)[0])
    slice_[middle] = dense.voxels[middle]
    short = image(place.uploads / "short.nii.gz", mask=stack)
    image(place.uploads / "long.nii.gz", slice_, dense)
    session = Session(keeping=Keeping(place))
    session.choices.optimize = False
    source = SourcePanel(session)
    source._arrived(place.uploads)
    session._pool.submit(lambda: None).result()
    assert "long.nii.gz" in session.complaint  # alone, it is no heart
    source.several.which.value = str(short)
    session._pool.submit(lambda: None).result()
    alone = len(session.anatomy.slices.outline.points)
    source.several.together.value = True
    session._pool.submit(lambda: None).result()
    both = len(session.anatomy.slices.outline.points)
    assert both > alone + 50
    assert source.several.fit.layout.display == "none"
    session.start().result()
    (outcome,) = session.outcomes
    assert len(outcome.result.anatomy.slices.outline.points) == both
    assert "[heartgen.read_mask('short.nii.gz'), heartgen.read_mask('long.nii.gz', view=True)]" in (
        reproduce(outcome)
    )
    assert manifest(outcome, {})["views"] == ["long.nii.gz"]
    session.close()
    again = Keeping(store.begun())
    there = store.found(place.key)
    past = again.past(there)
    later = Session(keeping=again)
    again.move(there, past)
    past.restore(later)
    later.choices.base = "plane"  # is measured anew, with the views
    later._pool.submit(lambda: None).result()
    assert later.case.views[0].name == "long.nii.gz"
    assert len(later.anatomy.slices.outline.points) > alone + 50
    later.close()
    (tmp_path / "saved").write_bytes(saved(there))
    other = store.begun()
    open_saved(tmp_path / "saved", other)
    assert len(other.load_case(past.numbers[past.case])[1]) == 1
