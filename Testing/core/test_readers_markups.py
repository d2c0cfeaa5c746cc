"""Landmarks and regions of interest from Slicer files, JSON and text."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.points.point_sets import Box
from organphys.readers.json_file import MAX_JSON_BYTES, read_json
from organphys.readers.landmarks_file import describe_landmarks, read_landmarks
from organphys.readers.roi_file import describe_box, read_box


def save(path, content):
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def markup(points, **fields):
    control = [{"label": f"L-{i}", "position": list(p)} for i, p in enumerate(points)]
    return {"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": control} | fields]}


def test_markups_in_both_coordinate_systems(tmp_path):
    lps = read_landmarks(save(tmp_path / "a.mrk.json", markup([(1, 2, 3), (-4, 5, 6)])))
    assert lps.positions.tolist() == [[-1, -2, 3], [4, -5, 6]] and lps.names == ("L-0", "L-1")
    ras = read_landmarks(
        save(tmp_path / "b.mrk.json", markup([(1, 2, 3)], coordinateSystem="RAS", coordinateUnits="mm"))
    )
    assert ras.positions.tolist() == [[1, 2, 3]]
    assert describe_landmarks(tmp_path / "b.mrk.json") == [("L-0", (1.0, 2.0, 3.0))]


def test_undefined_points_do_not_count(tmp_path):
    content = markup([(1, 2, 3), (4, 5, 6)])
    content["markups"][0]["controlPoints"][0]["positionStatus"] = "undefined"
    assert read_landmarks(save(tmp_path / "a.mrk.json", content)).positions.tolist() == [[-4, -5, 6]]
    content["markups"][0]["controlPoints"][1]["positionStatus"] = "preview"
    with pytest.raises(InputError, match="no landmark in the file"):
        read_landmarks(save(tmp_path / "a.mrk.json", content))


@pytest.mark.parametrize(
    ("system", "expected"), [("0", [1, 2, 3]), ("RAS", [1, 2, 3]), ("1", [-1, -2, 3]), ("LPS", [-1, -2, 3])]
)
def test_fcsv(tmp_path, system, expected):
    text = f"# Markups fiducial file version = 4.11\n# CoordinateSystem = {system}\n"
    text += "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    text += '1,1.0,2.0,3.0,0,0,0,1,1,1,0,"F-1, left",,\n'
    landmarks = read_landmarks(save(tmp_path / "a.fcsv", text))
    assert landmarks.positions.tolist() == [expected] and landmarks.names == ("F-1, left",)
    with pytest.raises(InputError, match="no landmark"):
        read_landmarks(save(tmp_path / "a.fcsv", text.rsplit("1,1.0", 1)[0]))
    with pytest.raises(InputError):
        read_landmarks(save(tmp_path / "a.fcsv", text + "2,abc,1,1\n"))
    with pytest.raises(InputError):
        read_landmarks(save(tmp_path / "a.fcsv", text + "2,1\n"))


def test_long_text_is_refused_quickly():
    for text in ("123456,123456,123456;" * 2000 + "x", "a" * 100_000, "a\0b"):
        with pytest.raises(InputError, match="no such file"):
            read_landmarks(text)


def test_text():
    assert read_landmarks("1,2,3; -4.5,5e1,.6").positions.tolist() == [[1, 2, 3], [-4.5, 50, 0.6]]
    assert read_landmarks(" 1 , 2, 3 ;").positions.tolist() == [[1, 2, 3]]
    for wrong in ("", "1,2", "1,2,3,4", "a,b,c", "1,2,3;;"):
        with pytest.raises(InputError, match="no such file"):
            read_landmarks(wrong)


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        "{}",
        "[" * 200_000,
        '{"markups": []}',
        '{"markups": [3]}',
        '{"markups": [{"coordinateSystem": "XYZ"}]}',
        '{"markups": [{"controlPoints": 7}]}',
        '{"markups": [{"controlPoints": [{"position": [1, 2]}]}]}',
        '{"markups": [{"controlPoints": [{"position": [1, 2, NaN]}]}]}',
        '{"markups": [{"controlPoints": [{"position": "abc"}]}]}',
        '{"markups": [{"controlPoints": [{}]}]}',
        '{"markups": [{"coordinateUnits": "cm", "controlPoints": [{"position": [1, 2, 3]}]}]}',
        '{"markups": [{"type": "ROI", "center": [1, 2], "size": [1, 1, 1]}]}',
        '{"markups": [{"type": "ROI", "center": [1, 2, 3], "size": [1, -1, 1]}]}',
        '{"markups": [{"type": "ROI", "center": [1, 2, 3], "size": [1, 1, 1], "orientation": [1]}]}',
        '{"center": [0, 0, 0]}',
        '{"center": [0, 0, 0], "size": [1, 1, 1], "axes": [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}',
        '{"center": [0, 0, "x"], "size": [1, 1, 1]}',
    ],
)
def test_damaged_json_is_an_input_error_of_one_line(tmp_path, content):
    path = save(tmp_path / "a.mrk.json", content)
    for reader in (read_landmarks, read_box):
        with pytest.raises(InputError) as caught:
            reader(path)
        assert "\n" not in str(caught.value) and "a.mrk.json" in str(caught.value)


def test_json_size_and_path(tmp_path):
    with pytest.raises(InputError, match="larger than 16 MB"):
        read_json(save(tmp_path / "a.json", " " * (MAX_JSON_BYTES + 1)))
    with pytest.raises(InputError, match="no such file"):
        read_json(tmp_path / "none.json")
    with pytest.raises(InputError, match="this is a folder"):
        read_json(tmp_path)
    (tmp_path / "b.json").write_bytes(b"\xff\xfe{}")
    with pytest.raises(InputError, match="no valid JSON"):
        read_json(tmp_path / "b.json")


def corners_inside(box: Box, centre, size, columns) -> bool:
    """Just inside the face centres is in the box, just outside is not."""
    inside = [centre + sign * 0.499 * size[k] * columns[:, k] for k in range(3) for sign in (1, -1)]
    outside = [centre + sign * 0.501 * size[k] * columns[:, k] for k in range(3) for sign in (1, -1)]
    return bool(box.contains(np.array(inside)).all() and not box.contains(np.array(outside)).any())


def test_slicer_roi_orientation_columns_are_the_axes(tmp_path):
    columns = Rotation.from_rotvec([0.4, 0.2, -0.7]).as_matrix()
    centre, size = np.array([1.0, -2.0, 5.0]), np.array([1.0, 2.0, 4.0])
    for system, flip in (("RAS", np.ones(3)), ("LPS", np.array([-1.0, -1, 1]))):
        region = {"type": "ROI", "coordinateSystem": system, "roiType": "Box"}
        region |= {"center": (centre * flip).tolist(), "size": size.tolist()}
        region["orientation"] = (columns * flip[:, None]).ravel().tolist()
        box = read_box(save(tmp_path / "roi.mrk.json", {"markups": [region]}))
        assert corners_inside(box, centre, size, columns)


def test_json_roi_plain_and_nested(tmp_path):
    rows = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
    region = {"center": [1, 2, 3], "size": [4, 5, 6], "axes": rows.tolist()}
    box = read_box(save(tmp_path / "a.json", {"name": "case", "roi": region}))
    assert np.allclose(box.axes, rows) and corners_inside(box, np.array([1.0, 2, 3]), np.array([4.0, 5, 6]), rows.T)
    plain = read_box(save(tmp_path / "b.json", {"center": [1, 2, 3], "size": [4, 5, 6]}))
    assert np.array_equal(plain.axes, np.eye(3))
    assert describe_box(tmp_path / "b.json")["size"] == [4.0, 5.0, 6.0]
    with pytest.raises(InputError, match="holds no region"):
        read_box(save(tmp_path / "c.json", {"roi": None}))
