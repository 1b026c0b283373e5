"""What a visitor does, from the sample to the download; the steps follow each other."""

from __future__ import annotations

import json
import time
import zipfile
from pathlib import Path

import numpy as np
import psutil
import pytest
from playwright.sync_api import expect
from scipy.ndimage import binary_fill_holes

import heartgen
from heartgen import samples
from tests.browser.seeing import SATURATED, is_mesh, view, wait_for_view

pytestmark = pytest.mark.slow

CHANGED = 30
"""Difference of a channel from which a pixel is another."""


def wait_for_other(page, before, act=lambda: None):
    """Pixels of the 3-D view as soon as they have changed."""

    def differs(now):
        if not is_mesh(now) or now.shape != before.shape:  # a larger key leaves the view less room
            return is_mesh(now)
        return np.mean(np.abs(now - before).max(axis=2) > CHANGED) > 0.005

    return wait_for_view(page, differs, act)


def drag(page):
    """Turn the heart a little; a view that is still loading misses it."""
    box = page.locator(".hg-frame").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 150, y + 20, steps=3)
    page.mouse.up()


def choose(page, label, option):
    page.get_by_label(label, exact=True).select_option(label=option)


def run(page, number):
    """Press Run and wait for the mesh."""
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(f".hg-step-view .hg-done:has-text('shows {number} ·')", state="attached")


def opened(browser, address):
    """A page of another visitor, with its first sample."""
    page = browser.new_context().new_page()
    page.set_default_timeout(120_000)
    page.goto(address)
    page.wait_for_selector(".hg-side .hg-step-input .hg-done")
    return page


def kernels(server):
    """Processes of the kernels of a server."""
    return {child for child in psutil.Process(server.pid).children() if is_kernel(child)}


def is_kernel(process):
    try:
        return "ipykernel" in " ".join(process.cmdline())
    except psutil.Error:  # it ends
        return False


def upload(page, path):
    page.locator(".hg-drop input").set_input_files(path)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """A heart that is quickly meshed."""
    nibabel = pytest.importorskip("nibabel")
    mask = samples.lifelike_lv(2.5).mask
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ mask.affine
    path = tmp_path_factory.mktemp("masks") / "coarse.nii.gz"
    nibabel.save(nibabel.Nifti1Image(mask.voxels.astype(np.uint8), ras), path)
    return path


@pytest.fixture(scope="module")
def ran(page):
    """The page after its first run."""
    run(page, 1)
    wait_for_view(page, is_mesh)
    return page


def test_sources_and_tracebacks_are_not_on_the_page(page):
    assert "from heartgen" not in page.content()
    assert page.locator(".hg-app").count() == 1
    assert "not for diagnosis" in page.locator(".hg-footer").inner_text()


def test_every_control_has_a_name(page):
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll(
             '.hg-app button, .hg-app select, .hg-app input, .hg-app [role=slider]')]
           .filter(e => e.offsetParent !== null || e.getClientRects().length)
           .filter(e => !(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby')
             || e.title || e.textContent.trim() || (e.labels && e.labels.length
             && e.labels[0].textContent.trim())))
           .map(e => e.outerHTML.slice(0, 200))"""
    )
    assert unnamed == []


def test_every_control_explains_itself_on_hover(page):
    page.get_by_role("button", name="More choices").click()
    page.get_by_label("Basal surface", exact=True).wait_for()
    silent = page.evaluate(
        """() => [...document.querySelectorAll('.hg-side button, .hg-side select, .hg-side input')]
           .filter(e => e.getClientRects().length && !e.closest('.hg-drop') && !e.title)
           .map(e => e.outerHTML.slice(0, 200))"""
    )
    level = page.get_by_title("How closely the mesh follows the mask")
    assert level.count() > 0
    page.get_by_role("button", name="Fewer choices").click()
    assert silent == []


def test_page_can_be_walked_by_keyboard(page):
    page.locator("body").click(position={"x": 5, "y": 5})
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate(
                "() => { const e = document.activeElement;"
                " return (e.getAttribute('aria-label') || e.title || e.textContent || e.tagName)"
                ".trim().slice(0, 40) }"
            )
        )
    assert any("Upload a mask" in name for name in reached)
    assert any(name.startswith("Fit a mesh") or name == "Run" for name in reached)
    assert len(reached) > 10


def test_a_sample_becomes_a_mesh_on_the_screen(ran):
    assert ran.locator(".hg-look").is_visible()
    assert "error" in ran.locator(".hg-run-label").first.inner_text()


def test_mesh_turns_and_stays_turned(ran):
    before = view(ran)
    turned = wait_for_other(ran, before, act=lambda: drag(ran))
    outline = np.ptp(turned, axis=2) > SATURATED
    choose(ran, "Color by", "Quality Q")
    recolored = wait_for_other(ran, turned)
    now = np.ptp(recolored, axis=2) > SATURATED
    overlap = np.sum(outline & now) / np.sum(outline | now)
    assert overlap > 0.6  # seen from the same side
    assert "Jacobian ratio" in ran.locator(".hg-scale").inner_text()


def test_view_can_be_saved_and_reset(ran):
    with ran.expect_download() as download:
        ran.get_by_role("button", name="Save picture").click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")
    before = view(ran)
    ran.get_by_role("button", name="Reset view").click()
    wait_for_other(ran, before)


def pointed(page, x, y):
    """Pixels of a place in the view, from 0 to 1 across and down."""
    box = page.locator(".hg-stage").bounding_box()
    return box["x"] + x * box["width"], box["y"] + y * box["height"]


def test_heart_fills_the_view_and_is_seen_from_named_sides(ran):
    colored = np.ptp(view(ran), axis=2) > SATURATED
    rows = np.flatnonzero(colored.any(axis=1))
    assert np.ptp(rows) > 0.8 * len(colored)
    before = view(ran)
    ran.get_by_label("Look from", exact=True).select_option(label="Apical")
    wait_for_other(ran, before)
    ran.get_by_role("button", name="Reset view").click()


def test_pointer_tells_element_and_error_and_ruler_measures(ran):
    ran.mouse.move(*pointed(ran, 0.5, 0.6))
    ran.wait_for_selector(".hg-stage .hg-readout:has-text('element')")
    told = ran.locator(".hg-stage .hg-readout").inner_text()
    assert all(word in told for word in ("Q 0.", "error", "wall", "mm"))
    ran.get_by_role("button", name="Ruler").click()
    ran.mouse.click(*pointed(ran, 0.5, 0.5))
    ran.mouse.click(*pointed(ran, 0.5, 0.75))
    ran.wait_for_selector(".hg-length:has-text('mm')")
    ran.get_by_role("button", name="Ruler").click()


def test_mesh_is_hidden_and_plays_and_is_cut_where_one_looks(ran):
    before = view(ran)
    ran.get_by_role("button", name="Mesh", exact=True).click()
    wait_for_view(ran, lambda now: np.mean(np.abs(now - before).max(axis=2) > CHANGED) > 0.005)
    ran.get_by_role("button", name="Mesh", exact=True).click()
    ran.get_by_role("button", name="Play").click()
    ran.wait_for_selector(".hg-stage .hg-readout:has-text('Warped')")
    ran.get_by_role("button", name="Play").click()
    ran.get_by_role("button", name="Cut here").click()
    ran.wait_for_selector(".hg-controls :text('Tilt')")
    wait_for_other(ran, before)
    choose(ran, "Cut", "No cut")


def test_what_is_asked_for_last_is_what_is_shown(ran):
    """However fast the changes come, the browser confirms the last."""
    before = view(ran)
    for mask in ("All of it", "Hidden", "Where it differs", "Hidden", "All of it"):
        choose(ran, "Mask", mask)
    whole = wait_for_other(ran, before)  # without a cut, or any other change
    choose(ran, "Mask", "Where it differs")
    wait_for_other(ran, whole)


def test_stage_and_cut_change_the_view(ran):
    choose(ran, "Color by", "Surface")
    wait_for_view(ran, is_mesh)
    ran.wait_for_selector(".hg-scale:has-text('epicardium')")
    time.sleep(2)
    before = view(ran)
    choose(ran, "Cut", "Long axis, 2")
    cut = wait_for_other(ran, before)
    ran.get_by_role("button", name="Template").click()
    wait_for_other(ran, cut)
    ran.get_by_role("button", name="Optimized").click()
    choose(ran, "Cut", "No cut")
    choose(ran, "Color by", "Error")


def test_fields_are_seen(ran):
    before = view(ran)
    choose(ran, "Color by", "AHA segment")
    ran.wait_for_selector(".hg-scale:has-text('AHA segment')")
    segments = wait_for_other(ran, before)
    choose(ran, "Lines", "Fibers")
    wait_for_other(ran, segments)
    choose(ran, "Lines", "Element edges")
    choose(ran, "Color by", "Error")


def test_a_visitor_whose_kernel_is_killed_is_told_and_harms_nobody_else(ran, browser, server):
    process, address = server
    before = kernels(process)
    page = opened(browser, address)
    (kernel,) = kernels(process) - before
    kernel.kill()
    page.wait_for_selector(".hg-gone:visible")
    expect(page.locator(".hg-gone:visible")).to_contain_text("has ended")
    page.close()
    shown = view(ran)
    choose(ran, "Color by", "Quality Q")
    wait_for_other(ran, shown)
    choose(ran, "Color by", "Error")
    assert ran.locator(".hg-gone:visible").count() == 0


def test_a_wrong_file_gets_a_sentence_and_the_page_goes_on(ran, tmp_path):
    wrong = tmp_path / "notes.nii.gz"
    wrong.write_text("no image at all")
    upload(ran, wrong)
    ran.wait_for_selector(".hg-complaint")
    sentence = ran.locator(".hg-complaint").inner_text()
    assert "notes.nii.gz" in sentence
    assert "Traceback" not in sentence
    expect(ran.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    expect(ran.locator(".hg-step-choices .hg-blocked:has-text('refused')")).to_have_count(1)
    expect(ran.locator(".hg-title").first).to_contain_text("lifelike in three slices")
    ran.get_by_role("button", name="Go on with lifelike").click()
    ran.wait_for_selector(".hg-complaint", state="detached")
    ran.get_by_role("button", name="Run", exact=True).click(trial=True)  # once it is enabled


def test_a_label_map_is_read_as_one_after_one_click(ran, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    wall = samples.lifelike_lv(2.5).mask
    filled = np.stack([binary_fill_holes(p) for p in np.moveaxis(wall.voxels, 2, 0)], axis=2)
    labels = (2 * wall.voxels + 3 * (filled & ~wall.voxels)).astype(np.uint8)
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ wall.affine
    nibabel.save(nibabel.Nifti1Image(labels, ras), tmp_path / "labels.nii.gz")
    upload(ran, tmp_path / "labels.nii.gz")
    ran.wait_for_selector(".hg-complaint:has-text('labels.nii.gz')")
    sentence = ran.locator(".hg-complaint").inner_text()
    assert "say under File is what they are" in sentence
    assert "--" not in sentence
    ran.get_by_role("button", name="Read it as a label map").click()
    ran.wait_for_selector(".hg-side .hg-step-input .hg-done:has-text('labels.nii.gz')")
    expect(ran.locator(".hg-title").first).to_contain_text("labels.nii.gz in three slices")
    choose(ran, "File is", "A mask, or structures with names")
    ran.wait_for_selector(".hg-complaint")
    ran.get_by_role("button", name="Go on with labels.nii.gz").click()


def test_cancel_takes_effect_at_once(ran, coarse):
    upload(ran, coarse)
    ran.wait_for_selector(".hg-side .hg-step-input .hg-done:has-text('coarse.nii.gz')")
    ran.get_by_role("button", name="All levels", exact=True).click()
    ran.wait_for_selector(".hg-bars .hg-now")
    ran.get_by_role("button", name="Cancel").click()
    ran.wait_for_selector(".hg-run-label .hg-cancelled", timeout=5_000)
    expect(ran.get_by_role("button", name="Run", exact=True)).to_be_enabled(timeout=5_000)


def test_levels_are_compared_and_a_point_loads_its_mesh(ran, coarse):
    ran.get_by_role("button", name="All levels", exact=True).click()
    ran.wait_for_selector(".hg-step-assess .hg-done", state="attached", timeout=180_000)
    ran.get_by_role("tab", name="5 Assess").click()
    expect(ran.locator(".hg-point")).to_have_count(5)
    expect(ran.locator(".hg-threshold")).to_have_count(1)
    ran.locator(".hg-point").nth(3).click()
    ran.wait_for_selector(".hg-verdict:has-text('LoD 4')")
    ran.locator(".hg-point").nth(1).focus()
    ran.keyboard.press("Enter")
    ran.wait_for_selector(".hg-verdict:has-text('LoD 2')")


def test_python_lines_are_copied(ran):
    ran.context.grant_permissions(["clipboard-read", "clipboard-write"])
    ran.get_by_role("tab", name="6 Export").click()
    ran.get_by_role("button", name="Copy", exact=True).click()
    ran.wait_for_selector(".hg-copy:has-text('Copied')")
    copied = ran.evaluate("() => navigator.clipboard.readText()")
    assert copied.startswith("import heartgen")
    assert "lod=2" in copied


def test_download_is_read_by_others(ran, tmp_path):
    ran.get_by_role("tab", name="6 Export").click()
    with ran.expect_download() as download:
        ran.get_by_role("button", name="Download zip").click()
    download.value.save_as(tmp_path / "heart.zip")
    with zipfile.ZipFile(tmp_path / "heart.zip") as archive:
        archive.extractall(tmp_path)
    folder = next(path for path in tmp_path.iterdir() if path.is_dir())
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["options"]["lod"] == 2
    assert manifest["input"]["name"] == "coarse.nii.gz"
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(folder / "mesh.vtu")
    assert grid.n_cells == 72
    assert zinc_elements(folder / "mesh.exf") == 72
    one, other = (heartgen.read_mesh(folder / name) for name in ("mesh.exf", "mesh.vtu"))
    xi = np.random.default_rng(0).random((5, 3))
    np.testing.assert_allclose(one.evaluate(xi), other.evaluate(xi), atol=1e-9)
    assert (folder / "report.html").stat().st_size > 100_000
    assert "heartgen.read_mask('coarse.nii.gz')" in (folder / "reproduce.py").read_text()


def test_real_mask_at_another_level(ran, shared_data):
    upload(ran, shared_data / "lv" / "mesa0054_ED.nii.gz")
    ran.wait_for_selector(".hg-side .hg-step-input .hg-done:has-text('mesa0054')")
    ran.get_by_role("slider").first.focus()
    ran.keyboard.press("ArrowRight")
    ran.wait_for_selector(".hg-side .widget-readout:has-text('2')")
    ran.get_by_role("button", name="Run", exact=True).click()
    ran.wait_for_selector(".hg-step-view .hg-done:has-text('mesa0054_ED.nii.gz · LoD 2')")
    wait_for_view(ran, is_mesh)


def zinc_elements(path: Path) -> int:
    """Elements that zinc, the field's own reader, finds in an EX file."""
    zinc = pytest.importorskip("cmlibs.zinc.context")
    context = zinc.Context("test")  # owns what comes of it
    region = context.getDefaultRegion()
    assert region.readFile(str(path)) == 1
    return region.getFieldmodule().findMeshByDimension(3).getSize()
