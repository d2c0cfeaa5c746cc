"""Which organ is meant: ids, names in files, schemes; never a guess."""

import numpy as np
import pytest
import SimpleITK as sitk
from reader_samples import blob, write_labels

from organphys.ground.checks import InputError
from organphys.readers.label_schemes import SCHEMES, scheme_labels
from organphys.readers.segmentation_file import describe_segmentation, read_organ


def two_organs() -> np.ndarray:
    labels = np.zeros((40, 30, 20), np.uint8)
    labels[:20][blob((20, 30, 20))] = 2
    labels[20:][blob((20, 30, 20))] = 5
    return labels


def test_bare_name_without_scheme_lists_what_there_is(tmp_path):
    path = write_labels(tmp_path / "a.nii.gz", two_organs())
    with pytest.raises(
        InputError, match=r"names no organs.*--label-scheme totalsegmentator\|.*present: 2 \(\d.\d ml\), 5"
    ):
        read_organ(path, organ="liver")


def test_scheme_gives_the_label(tmp_path):
    path = write_labels(tmp_path / "a.nii.gz", two_organs())
    liver = read_organ(path, organ="Liver", label_scheme="totalsegmentator")
    assert liver.name == "liver" and liver.volume_points[:, 0].min() >= 20
    kidney = read_organ(path, organ="right  Kidney", label_scheme="totalsegmentator")
    assert kidney.name == "kidney_right" and kidney.volume_points[:, 0].max() < 20
    assert read_organ(path, organ="5", label_scheme="amos").name == "esophagus"
    with pytest.raises(InputError, match=r"'spleen' \(label 1\) is not in the map; .* present: 2 kidney_right"):
        read_organ(path, organ="spleen", label_scheme="totalsegmentator")
    with pytest.raises(InputError, match="knows an organ 'hart'; present: 2 kidney_right"):
        read_organ(path, organ="hart", label_scheme="totalsegmentator")
    with pytest.raises(InputError, match="expected one of totalsegmentator"):
        read_organ(path, organ=5, label_scheme="total")


def test_union_of_labels(tmp_path):
    labels = blob().astype(np.uint8)
    labels[12:][labels[12:] > 0] = 2
    path = write_labels(tmp_path / "a.nii.gz", labels)
    whole = read_organ(path, organ="1+2")
    assert len(whole.volume_points) == pytest.approx((labels > 0).sum(), rel=0.05)
    combined = read_organ(path, organ="prostate", label_scheme="msd-prostate")
    assert np.array_equal(whole.volume_points, combined.volume_points) and combined.name == "prostate"


def test_slicer_segment_names(tmp_path):
    keys = {
        "Segment0_Name": "Right kidney",
        "Segment0_LabelValue": 2,
        "Segment0_Layer": 0,
        "Segment0_Extent": "0 9 0 9 0 9",
    }
    keys |= {"Segment1_Name": "My_Liver", "Segment1_LabelValue": 5, "Segment1_Layer": 0}
    path = write_labels(tmp_path / "a.seg.nrrd", two_organs(), metadata=keys)
    assert read_organ(path, organ="my liver").volume_points[:, 0].min() >= 20
    assert read_organ(path, organ="kidney_RIGHT").name == "Right kidney"
    assert read_organ(path, organ="5").name == "My_Liver"
    with pytest.raises(InputError, match=r"no segment is named 'spleen'; present: 2 Right kidney .* 5 My_Liver"):
        read_organ(path, organ="spleen")
    assert [c.name for c in describe_segmentation(path).labels] == ["Right kidney", "My_Liver"]


@pytest.mark.parametrize("with_keys", [True, False])
def test_overlapping_segments_in_layers(tmp_path, with_keys):
    shape = (20, 30, 20)
    layers = np.stack([blob(shape), np.zeros(shape, bool)], axis=-1).astype(np.uint8)
    layers[6:14, 8:20, 5:15, 1] = 1
    keys = {"Segment0_Name": "liver", "Segment1_Name": "tumour"}
    if with_keys:  # else the older convention: one layer each, value 1
        keys |= {f"Segment{k}_{name}": value for k in (0, 1) for name, value in (("LabelValue", 1), ("Layer", k))}
    path = write_labels(tmp_path / "a.seg.nrrd", layers, metadata=keys, vector=True)
    assert len(read_organ(path, organ="tumour", opening=False).volume_points) == 8 * 12 * 10
    assert len(read_organ(path, organ="liver", opening=False).volume_points) == blob(shape).sum()
    with pytest.raises(
        InputError, match="2 layers, so a label id is ambiguous; give a segment name: 'liver', 'tumour'"
    ):
        read_organ(path, organ=1)
    assert [(c.layer, c.name) for c in describe_segmentation(path).labels] == [(0, "liver"), (1, "tumour")]


def test_names_in_a_nifti_extension(tmp_path):
    data = write_labels(tmp_path / "plain.nii", two_organs()).read_bytes()
    text = b'<LabelTable><Label Key="2" Red="1"><![CDATA[kidney_right]]></Label>\n<Label Key="5">liver</Label>'
    text += b" " * (-(len(text) + 8) % 16)
    header = bytearray(data[:352])
    header[108:112] = np.array([352 + 8 + len(text)], "<f4").tobytes()
    header[348] = 1
    extension = np.array([len(text) + 8, 0], "<i4").tobytes() + text
    path = tmp_path / "named.nii"
    path.write_bytes(bytes(header) + extension + data[352:])
    assert read_organ(path, organ="liver").volume_points[:, 0].min() >= 20


def test_schemes_known_numbers():
    assert [SCHEMES["totalsegmentator"][k] for k in (5, 22, 51, 117)] == [
        "liver",
        "prostate",
        "heart",
        "costal_cartilages",
    ]
    assert [SCHEMES["auto3dseg"][k] for k in (10, 44, 104)] == ["pancreas", "heart_myocardium", "urinary_bladder"]
    assert [SCHEMES["totalsegmentator-mr"][k] for k in (7, 26, 50)] == ["pancreas", "iliac_artery_left", "brain"]
    assert (len(SCHEMES["totalsegmentator"]), len(SCHEMES["auto3dseg"]), len(SCHEMES["totalsegmentator-mr"])) == (
        117,
        104,
        50,
    )
    livers = {"btcv": 6, "amos": 6, "flare": 1, "word": 1, "msd-liver": 1, "totalsegmentator-v1": 5}
    assert all(scheme_labels(scheme)["liver"] == (label,) for scheme, label in livers.items())
    assert scheme_labels("btcv")["pancreas"] == (11,) and scheme_labels("amos")["pancreas"] == (10,)
    for scheme, names in SCHEMES.items():
        assert len(set(names.values())) == len(names), scheme


def test_slicers_list_axis_and_4d_volumes(tmp_path):
    layers = np.stack([blob((20, 30, 20)), blob((20, 30, 20))[::-1]], axis=-1).astype(np.uint8)
    keys = {"Segment0_Name": "a", "Segment1_Name": "b"}
    data = write_labels(tmp_path / "v.seg.nrrd", layers, metadata=keys, vector=True).read_bytes()
    (tmp_path / "list.seg.nrrd").write_bytes(data.replace(b"kinds: vector", b"kinds: list", 1))
    second = read_organ(tmp_path / "list.seg.nrrd", organ="b", opening=False).volume_points
    assert np.array_equal(np.sort(second[:, 0]), np.sort(np.argwhere(layers[..., 1])[:, 0]))
    image = sitk.JoinSeries([sitk.GetImageFromArray(blob().astype(np.uint8).transpose(2, 1, 0))])
    sitk.WriteImage(image, str(tmp_path / "one.nii.gz"))
    assert len(read_organ(tmp_path / "one.nii.gz", organ=1, opening=False).volume_points) == blob().sum()
    sitk.WriteImage(sitk.JoinSeries([image[..., 0]] * 3), str(tmp_path / "three.nii.gz"))
    with pytest.raises(InputError, match="3 layers, so a label id is ambiguous; give a segment name: none is named"):
        read_organ(tmp_path / "three.nii.gz", organ=1)
