from __future__ import annotations

import hashlib
import io
import json
import subprocess
import sys
import zipfile
from dataclasses import replace

import pytest

pytest.importorskip("trame_vtk")

from heartgen.errors import HeartgenError
from heartgen.widgets.bundle import make_bundle, reproduce
from heartgen.widgets.runs import Outcome

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bundle(finished):
    return make_bundle(finished.shown, ("exf", "vtu"))


@pytest.fixture(scope="module")
def archive(bundle):
    with zipfile.ZipFile(io.BytesIO(bundle[1])) as opened:
        yield {name.partition("/")[2]: opened.read(name) for name in opened.namelist()}


def test_archive_holds_all_that_was_asked_for(bundle, archive):
    assert bundle[0].endswith("-lod1.zip")
    assert {
        "mesh.exf",
        "mesh.vtu",
        "report.json",
        "report.html",
        "reproduce.py",
        "manifest.json",
        "figures/slices.png",
        "figures/histograms.png",
    } <= set(archive)


def test_manifest_has_the_hash_of_every_file(archive):
    manifest = json.loads(archive["manifest.json"])
    assert set(manifest["files"]) == set(archive) - {"manifest.json"}
    for name, digest in manifest["files"].items():
        assert hashlib.sha256(archive[name]).hexdigest() == digest
    assert manifest["input"]["sha256"] == "0" * 64
    assert manifest["versions"]["heartgen"]


def test_what_was_not_asked_for_is_not_there(finished):
    _, content = make_bundle(finished.shown, ("vtu",), report=False, figures=False)
    names = {n.partition("/")[2] for n in zipfile.ZipFile(io.BytesIO(content)).namelist()}
    assert names == {"mesh.vtu", "report.json", "reproduce.py", "manifest.json"}


def test_script_makes_the_same_mesh(finished, tmp_path):
    code = reproduce(finished.shown).replace(
        finished.case.code, "heartgen.samples.lifelike_lv(3.0).mask"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    made = json.loads((tmp_path / "out" / "report.json").read_text())
    assert made["accuracy"]["mean"] == finished.shown.result.report.accuracy.mean


def test_mesh_that_is_not_valid_is_not_handed_out(finished):
    result = finished.shown.result
    quality = replace(result.report.quality, valid=False, invalid_elements=1)
    bad = replace(result, report=replace(result.report, quality=quality))
    with pytest.raises(HeartgenError, match="not valid"):
        make_bundle(Outcome(1, finished.case, bad), ("vtu",))
