"""Files appear whole or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from heartgen.errors import HeartgenError, InputError
from heartgen.files import replacing
from heartgen.formats import FORMATS, file_name, write_mesh, write_text
from heartgen.mesh import MeshField

OLD, NEW = "the file as it was\n", "the file as it should be\n"


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "report.json"
    path.write_text(OLD)
    return path


def assert_untouched(path):
    assert path.read_text() == OLD
    assert list(path.parent.iterdir()) == [path], "something was left behind"


def test_text_is_written_as_it_is(path):
    text = "Ångström < 1 µm\nξ\r\n"
    write_text(text, path)
    assert path.read_bytes() == text.encode()
    assert list(path.parent.iterdir()) == [path]


def test_folders_are_made(tmp_path):
    write_text(NEW, str(tmp_path / "a" / "b" / "c.txt"))
    assert (tmp_path / "a" / "b" / "c.txt").read_text() == NEW


@pytest.mark.parametrize("step", ["os.fsync", "pathlib.Path.replace", "pathlib.Path.write_bytes"])
def test_a_full_disk_leaves_the_old_file(path, monkeypatch, step):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(step, fail)
    with pytest.raises(HeartgenError, match=r"report\.json: .* \(No space left on device\)"):
        write_text(NEW, path)
    monkeypatch.undo()
    assert_untouched(path)


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_writer_leaves_the_old_file(path, error):
    def write():
        with replacing(path) as temporary:
            assert temporary.parent == path.parent
            assert temporary.suffix == path.suffix
            temporary.write_text(NEW[:5])
            raise error

    with pytest.raises(error):
        write()
    assert_untouched(path)


def test_a_killed_process_leaves_the_old_file(path):
    code = (
        "import os, sys; from heartgen.files import replacing\n"
        "with replacing(sys.argv[1]) as temporary:\n"
        f"    temporary.write_text({NEW[:5]!r}); os._exit(9)"
    )
    answer = subprocess.run([sys.executable, "-c", code, path], check=False)
    assert answer.returncode == 9
    assert path.read_text() == OLD


def test_a_writer_that_writes_nothing_is_an_error(path):
    with pytest.raises(HeartgenError, match=r"report\.json"), replacing(path):
        pass
    assert_untouched(path)


@pytest.mark.parametrize("name", ["file/mesh.exf", "folder"])
def test_an_impossible_place_is_one_sentence(tmp_path, name):
    (tmp_path / "file").write_text(OLD)
    (tmp_path / "folder").mkdir()
    with pytest.raises(HeartgenError, match=f"{name}: .*: choose .*"):
        write_text(NEW, tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is forbidden to this user"
)
def test_a_folder_that_may_not_be_written_is_one_sentence(path):
    path.parent.chmod(0o500)
    try:
        with pytest.raises(HeartgenError, match=r"report\.json: .*denied"):
            write_text(NEW, path)
        assert_untouched(path)
    finally:
        path.parent.chmod(0o700)


@pytest.mark.skipif(os.name != "posix", reason="no such file here")
def test_a_device_is_not_replaced():
    with pytest.raises(HeartgenError, match="not a file"):
        write_text(NEW, os.devnull)
    assert not Path(os.devnull).is_file()


@pytest.mark.skipif(os.name != "posix", reason="links need rights here")
def test_a_link_stays_a_link(path):
    link = path.with_name("latest.json")
    link.symlink_to(path)
    write_text(NEW, link)
    assert link.is_symlink()
    assert path.read_text() == NEW


@pytest.mark.skipif(os.name != "posix", reason="no such permissions here")
def test_others_may_read_it_as_they_may_any_new_file(path):
    other = path.with_name("other")
    other.touch()
    write_text(NEW, path)
    assert path.stat().st_mode == other.stat().st_mode


# --- the format is in the name -------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mesh.exf", "mesh.vtu", "MESH.EXF", "a.b.vtu"])
def test_the_ending_decides(small, tmp_path, name):
    written = write_mesh(small, tmp_path / name)
    assert written.files == (tmp_path / name,)
    FORMATS[name[-3:].lower()].write(small, tmp_path / "directly", ())
    assert (tmp_path / name).read_bytes() == (tmp_path / "directly").read_bytes()


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_a_file_name_that_it_accepts(small, tmp_path, name):
    if name == "fieldml":
        pytest.importorskip("cmlibs.zinc.context")
    written = write_mesh(small, tmp_path / file_name("mesh", name), format=name)
    assert all(file.stat().st_size > 0 for file in written.files)
    assert {file.name.partition(".")[0] for file in written.files} <= {"mesh", f"mesh-{name}"}


def test_a_format_that_is_named_wants_its_own_ending(small, tmp_path):
    with pytest.raises(InputError, match=r"mesh\.vtu.*end the name in \.exf\."):
        write_mesh(small, tmp_path / "mesh.vtu", format="exf")
    with pytest.raises(InputError, match="format 'docx' is not known: choose one of exf, "):
        write_mesh(small, tmp_path / "mesh.vtu", format="docx")
    assert list(tmp_path.iterdir()) == []


def test_fields_that_a_format_cannot_hold_are_named(small, tmp_path, monkeypatch):
    bare = replace(FORMATS["vtu"], fields=False)
    monkeypatch.setitem(FORMATS, "vtu", bare)
    fields = [MeshField("depth", np.zeros((small.n_elements, 64, 1)))]
    written = write_mesh(small, tmp_path / "mesh.vtu", fields)
    assert written.notes == ("mesh.vtu does not hold the fields, which have no place in it: depth",)


@pytest.mark.parametrize("name", ["mesh.docx", "mesh", ".exf", "mesh.exf.gz"])
def test_an_unknown_ending_is_one_sentence(small, tmp_path, name):
    with pytest.raises(InputError, match=r"end the name in .*\.exf.*\.vtu") as caught:
        write_mesh(small, tmp_path / name)
    assert name in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_that_cannot_be_written_leaves_the_old_one(small, path, monkeypatch):
    target = path.rename(path.with_name("mesh.exf"))

    def fail(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(HeartgenError, match=r"mesh\.exf"):
        write_mesh(small, target)
    monkeypatch.undo()
    assert_untouched(target)
