from __future__ import annotations

import pandas as pd
import pytest

from heartgen import samples
from heartgen.cohort import Case, find_cases
from heartgen.cohort.cases import check_names
from heartgen.errors import InputError
from heartgen.images.selecting import Selection


def write(path, text):
    path.write_text(text)
    return path


def test_every_image_of_a_folder_is_a_case(hearts):
    cases = find_cases(hearts)
    assert [c.name for c in cases] == ["a", "b", "odd/block", "odd/slice", "odd/text"]
    assert [c.group for c in cases] == ["", "", "odd", "odd", "odd"]
    assert cases[0].read().voxels.any()


def test_a_folder_of_dicom_files_is_one_case(tmp_path):
    (tmp_path / "patient").mkdir()
    for name in ("1.dcm", "2.dcm"):
        (tmp_path / "patient" / name).write_bytes(b"")
    assert [c.name for c in find_cases(tmp_path)] == ["patient"]


def test_rows_of_a_table_are_cases_with_options_of_their_own(hearts):
    path = write(
        hearts.parent / "table.csv",
        "mask, case,group,lod,elements,labels,rv_wall\n"
        "masks/a.nii.gz,first,normal,2,1x10x5,,\n"
        "masks/b.nrrd,,,,,acdc,4\n",
    )
    first, second = find_cases(path, Selection(label=("2",)))
    assert (first.name, first.group) == ("first", "normal")
    assert first.choices == {"lod": 2, "elements": (1, 10, 5)}
    assert first.selection == Selection(label=("2",))
    assert first.source == hearts / "a.nii.gz"
    assert (second.name, second.choices) == ("b", {})
    assert second.selection == Selection(labels="acdc", rv_wall=4.0)


@pytest.mark.parametrize(
    ("text", "name", "chosen"),
    [
        ("mask;case;rv_wall;labels;frame\nm.nii;x;3;auto;ED\n", "x", ((), "auto", 3.0, "ED")),
        ("mask;case;label\nm.nii;x,y;2+3\n", "x,y", (("2", "3"),)),
    ],
)
def test_tables_with_semicolons(tmp_path, text, name, chosen):
    (case,) = find_cases(write(tmp_path / "table.csv", text))
    assert (case.name, case.selection) == (name, Selection(*chosen))


def test_a_frame_of_the_row_or_of_all_rows(hearts):
    path = write(
        hearts.parent / "table.csv",
        "mask,case,frame,labels\nmasks/a.nii.gz,x,2,\nmasks/a.nii.gz,y,,acdc\n",
    )
    first, second = find_cases(path, Selection(frame="ED"))
    assert first.selection == Selection(frame="2")
    assert second.selection == Selection(labels="acdc", frame="ED")


def test_tables_may_be_parquet(hearts):
    path = hearts.parent / "table.parquet"
    pd.DataFrame({"mask": ["masks/a.nii.gz"], "lod": [2.0], "optimize": [False]}).to_parquet(path)
    (case,) = find_cases(path)
    assert case.choices == {"lod": 2, "optimize": False}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("file,lod\na.nii,1\n", "no column 'mask'"),
        ("mask,lods\na.nii,1\n", "column 'lods' is not known: name columns mask"),
        ("mask,lod\na.nii,high\n", "row 1: level of detail 'high' does not exist"),
        ("mask,lod\n,1\n", "row 1: there is no mask"),
        ("mask,case\na.nii,x\nb.nii,X\n", "have the same name"),
        ("mask,case\na.nii,../x\n", "cannot be the name of a folder"),
        (f"mask,case\na.nii,{'n' * 300}\n", "nnn... has a name of 300 bytes, more than the 200"),
        ("mask,rv_wall\na.nii,3\n", "row 1: --rv-wall needs a label map"),
        ("", "the table cannot be read"),
    ],
)
def test_bad_tables_are_a_sentence(tmp_path, text, sentence):
    with pytest.raises(InputError, match=sentence):
        find_cases(write(tmp_path / "table.csv", text))


def test_an_empty_folder_is_a_sentence(tmp_path):
    with pytest.raises(InputError, match="there is no image in this folder"):
        find_cases(tmp_path)


def test_a_case_changes_with_its_file_and_with_what_is_read_of_it(tmp_path):
    path = write(tmp_path / "a.nii", "1")
    stamp = Case("a", path).stamp()
    assert Case("a", path).stamp() == stamp
    assert Case("a", path, selection=Selection(labels="acdc")).stamp() != stamp
    write(path, "12")
    assert Case("a", path).stamp() != stamp


def test_a_mask_is_a_case_of_its_own():
    mask = samples.lifelike_lv(4.0).mask
    case = Case(mask.name, mask)
    assert case.read() is mask
    assert case.stamp() == Case(mask.name, samples.lifelike_lv(4.0).mask).stamp()
    with pytest.raises(InputError, match="have the same name"):
        check_names([case, case])
