"""Messages say what to do in the words of where they are shown."""

from __future__ import annotations

import nibabel as nib
import numpy as np
import pytest

from heartgen import read_labels, read_mask
from heartgen.errors import InputError
from heartgen.wording import worded_for

WORDS = {
    "Python": ("label=", "read_labels"),
    "command line": ("--label,", "--labels"),
    "page": ("under File is",),
}

FRAMES = {"Python": "as frame=", "command line": "as --frame", "page": "under Frame"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("images")
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[2:6, 2:10, 2:10], labels[6:10, 2:10, 2:10] = 1, 2
    nib.save(nib.Nifti1Image(labels, np.eye(4)), folder / "labels.nii")
    nib.save(nib.Nifti1Image(np.stack([labels] * 3, -1), np.eye(4)), folder / "cine.nii")
    return folder


def told(place, read):
    with worded_for(place), pytest.raises(InputError) as error:
        read()
    return str(error.value)


@pytest.mark.parametrize("place", WORDS)
def test_labels_are_told_in_the_words_of_the_place(folder, place):
    sentence = told(place, lambda: read_mask(folder / "labels.nii"))
    assert all(word in sentence for word in WORDS[place])
    others = [w for other, words in WORDS.items() if other != place for w in words]
    assert not any(word in sentence for word in others)
    sentence = told(place, lambda: read_labels(folder / "labels.nii", "mmwhs"))
    assert ("scheme=" in sentence, "--labels" in sentence, "File is" in sentence) == (
        place == "Python",
        place == "command line",
        place == "page",
    )


@pytest.mark.parametrize("place", FRAMES)
def test_frames_are_told_in_the_words_of_the_place(folder, place):
    sentence = told(place, lambda: read_mask(folder / "cine.nii"))
    assert [other for other, word in FRAMES.items() if word in sentence] == [place]
