"""Label numbers of public segmentation tools and data sets: one table, id to organ name.

Sources:
totalsegmentator, -mr, -v1: wasserth/TotalSegmentator, totalsegmentator/map_to_binary.py, class maps "total" (that is
version 2), "total_mr" and "total_v1".
auto3dseg: MONAI's whole-body model (Project-MONAI/model-zoo, wholeBody_ct_segmentation, metadata.json), trained on
version 1 and numbered like it. Smaller Auto3DSeg models number differently; 3D Slicer saves their names (.seg.nrrd).
btcv: "Multi-Atlas Labeling Beyond the Cranial Vault" 2015 (synapse syn3193805). amos: Ji et al., NeurIPS 2022.
flare: MICCAI FLARE 2022. word: Luo et al., Medical Image Analysis 2022. kits: KiTS21 and 23 (KiTS19 has no cyst).
msd-*: Medical Segmentation Decathlon, dataset.json of tasks 3, 5, 7, 9 (Antonelli et al., Nature Communications 2022).
"""

from __future__ import annotations

from ..ground.checks import InputError


def _numbered(names: str) -> dict[int, str]:
    return dict(enumerate(names.split(), start=1))


_SPINE = " ".join(f"vertebrae_{name}" for name in ("L5", "L4", "L3", "L2", "L1"))
_SPINE += "".join(f" vertebrae_T{k}" for k in range(12, 0, -1)) + "".join(f" vertebrae_C{k}" for k in range(7, 0, -1))
_RIBS = " ".join(f"rib_{side}_{k}" for side in ("left", "right") for k in range(1, 13))
_SHOULDER = "humerus_left humerus_right scapula_left scapula_right clavicula_left clavicula_right"
_LEGS = "femur_left femur_right hip_left hip_right"
_MUSCLES = (
    "gluteus_maximus_left gluteus_maximus_right gluteus_medius_left gluteus_medius_right gluteus_minimus_left "
    "gluteus_minimus_right autochthon_left autochthon_right iliopsoas_left iliopsoas_right"
)
_LUNGS = "lung_upper_lobe_left lung_lower_lobe_left lung_upper_lobe_right lung_middle_lobe_right lung_lower_lobe_right"
_ILIAC = "iliac_artery_left iliac_artery_right iliac_vena_left iliac_vena_right"
_UPPER = "spleen kidney_right kidney_left gallbladder liver stomach"
_ADRENALS = "adrenal_gland_right adrenal_gland_left"

_TOTAL_V1 = _numbered(
    f"{_UPPER} aorta inferior_vena_cava portal_vein_and_splenic_vein pancreas {_ADRENALS} {_LUNGS} {_SPINE} esophagus "
    "trachea heart_myocardium heart_atrium_left heart_ventricle_left heart_atrium_right heart_ventricle_right "
    f"pulmonary_artery brain {_ILIAC} small_bowel duodenum colon {_RIBS} {_SHOULDER} {_LEGS} sacrum face {_MUSCLES} "
    "urinary_bladder"
)
_TOTAL_V2 = _numbered(
    f"{_UPPER} pancreas {_ADRENALS} {_LUNGS} esophagus trachea thyroid_gland small_bowel duodenum colon "
    f"urinary_bladder prostate kidney_cyst_left kidney_cyst_right sacrum vertebrae_S1 {_SPINE} heart aorta "
    "pulmonary_vein brachiocephalic_trunk subclavian_artery_right subclavian_artery_left common_carotid_artery_right "
    "common_carotid_artery_left brachiocephalic_vein_left brachiocephalic_vein_right atrial_appendage_left "
    f"superior_vena_cava inferior_vena_cava portal_vein_and_splenic_vein {_ILIAC} {_SHOULDER} {_LEGS} spinal_cord "
    f"{_MUSCLES} brain skull {_RIBS} sternum costal_cartilages"
)
_TOTAL_MR = _numbered(
    f"{_UPPER} pancreas {_ADRENALS} lung_left lung_right esophagus small_bowel duodenum colon urinary_bladder prostate "
    "sacrum vertebrae intervertebral_discs spinal_cord heart aorta inferior_vena_cava portal_vein_and_splenic_vein "
    f"{_ILIAC} {_SHOULDER} {_LEGS} {_MUSCLES} brain"
)

SCHEMES: dict[str, dict[int, str]] = {
    "totalsegmentator": _TOTAL_V2,
    "totalsegmentator-mr": _TOTAL_MR,
    "totalsegmentator-v1": _TOTAL_V1,
    "auto3dseg": _TOTAL_V1,
    "btcv": _numbered(
        "spleen kidney_right kidney_left gallbladder esophagus liver stomach aorta inferior_vena_cava "
        f"portal_vein_and_splenic_vein pancreas {_ADRENALS}"
    ),
    "amos": _numbered(
        "spleen kidney_right kidney_left gallbladder esophagus liver stomach aorta inferior_vena_cava pancreas "
        f"{_ADRENALS} duodenum urinary_bladder prostate_or_uterus"
    ),
    "flare": _numbered(
        f"liver kidney_right spleen pancreas aorta inferior_vena_cava {_ADRENALS} gallbladder esophagus stomach "
        "duodenum kidney_left"
    ),
    "word": _numbered(
        "liver spleen kidney_left kidney_right stomach gallbladder esophagus pancreas duodenum colon intestine adrenal "
        "rectum urinary_bladder femur_head_left femur_head_right"
    ),
    "kits": _numbered("kidney tumour cyst"),
    "msd-liver": _numbered("liver tumour"),
    "msd-pancreas": _numbered("pancreas tumour"),
    "msd-spleen": _numbered("spleen"),
    "msd-prostate": _numbered("peripheral_zone transition_zone"),
}

# organs that a scheme splits over several labels
COMBINED: dict[str, dict[str, tuple[int, ...]]] = {
    "kits": {"kidney_with_tumour": (1, 2, 3)},
    "msd-liver": {"liver_with_tumour": (1, 2)},
    "msd-pancreas": {"pancreas_with_tumour": (1, 2)},
    "msd-prostate": {"prostate": (1, 2)},
}


def scheme_names(scheme: str | None) -> dict[int, str]:
    """Organ name by label id of a scheme; empty for None, InputError for an unknown one."""
    if scheme is None:
        return {}
    if scheme not in SCHEMES:
        raise InputError(f"label scheme: expected one of {', '.join(SCHEMES)}, got {scheme!r}")
    return SCHEMES[scheme]


def scheme_labels(scheme: str) -> dict[str, tuple[int, ...]]:
    """Label ids by organ name, also of organs that the scheme splits over several labels."""
    return {name: (label,) for label, name in scheme_names(scheme).items()} | COMBINED.get(scheme, {})
