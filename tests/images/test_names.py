"""Names that writers give to parts of hearts tell what they are; names of other things do not."""

from __future__ import annotations

import pytest

from heartgen.images.names import role_of, scheme_of_names
from heartgen.images.volume import Coded

ROLES = {
    "lv_pool": "LV; lv; LV blood pool; LV cavity; left ventricle; Left Ventricular Cavity; LVBP; "
    "LV_endo; endoLV; LV endocardium; heart_ventricle_left; LeftVentricle; LVC",
    "lv_myocardium": "Myo; myocardium; LV myocardium; LVM; LV-Myocardium 2; LVMyo; lvmyo; LV wall; "
    "heart_myocardium; Left ventricular wall; LV epicardium; interventricular septum",
    "rv_pool": "RV; RV blood pool; right ventricle; RVBP; heart_ventricle_right; RVendo",
    "rv_myocardium": "RV wall; RV myocardium; Right ventricular free wall; RVW; RV Epi",
    "scars": "scar; LV infarct; MVO; no-reflow; LGE",
    "rv_openings": "RA; right atrium; heart_atrium_right; pulmonary artery; PA; RVOT",
    "others": "LA; left atrium; atrial_appendage_left; aorta; Ao; pulmonary vein; atrial septum",
}
NO_PARTS = (
    "Heart; wall; chest wall; Segment_1; lung_upper_lobe_left; Left-Lateral-Ventricle; ribs; BODY; "
    "left kidney; pericardium; papillary muscles; gluteus_maximus_left; nasal septum"
)


@pytest.mark.parametrize(
    ("name", "role"),
    [(name, role) for role, names in ROLES.items() for name in names.split("; ")]
    + [(name, None) for name in NO_PARTS.split("; ")],
)
def test_names(name, role):
    assert role_of(name) == role
    assert role_of(f" {name} ") == role


@pytest.mark.parametrize(
    ("name", "code", "meaning", "role"),
    [
        ("Segment_1", "87878005", "", "lv_pool"),
        ("Segment_2", "49848007", "", "lv_myocardium"),
        ("Segment_2", "T-32620", "", "lv_myocardium"),
        ("Segment_2", "0", "Myocardium of left ventricle", "lv_myocardium"),
        ("Segment_3", "53085002", "", "rv_pool"),
        ("LV", "49848007", "", "lv_myocardium"),  # a side alone says less than a code
        ("LV blood pool", "49848007", "Myocardium", "lv_pool"),  # a side and a part say more
        ("Myo", "87878005", "Left ventricle", "lv_myocardium"),
        ("Myocardium", "53085002", "Right ventricle", "rv_myocardium"),
        ("wall", "87878005", "Left ventricle", "lv_myocardium"),
        ("Segment_4", "272673000", "Bone", None),
    ],
)
def test_codes(name, code, meaning, role):
    assert role_of(name, Coded((code,), (meaning,))) == role


def test_a_scheme_needs_a_wall_and_something_else():
    scheme = scheme_of_names({1: "LV", 4: "Myo", 2: "RV", 7: "ribs", 9: "LA"})
    assert (scheme.lv_pool, scheme.lv_myocardium, scheme.rv_pool) == ((1,), (4,), (2,))
    assert scheme.others == (9,)
    assert scheme_of_names({1: "LV", 2: "RV"}) is None
    assert scheme_of_names({1: "Myo", 2: "aorta"}) is None
