"""Seed texts: landmarks, pins, regions, trajectories and points, in every dialect that is read."""

from __future__ import annotations

import io
import json

import numpy as np

from organphys.pipeline.sample_case import SampleCase

FCSV = """# Markups fiducial file version = 4.11
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,10.5,-20.25,30,0,0,0,1,1,1,0,front,,
2,-1e1,22,3.5,0,0,0,1,1,1,0,"left, lower",text,
"""
OLD_FCSV = "# CoordinateSystem = 0\nvtkMRMLMarkupsFiducialNode_0,1,2,3,0,0,0,1,1,1,0,F-1,,\n"
TRAJECTORY = """# frame: scene
# unit: mm
time_s,x,y,z,qw,qx,qy,qz,jaw_deg
0,0,0,50,1,0,0,0,30
0.5,1,0.5,51,1,0,0,0,20
1,2,1e0,52,0.7071068,0.7071068,0,0,0
"""
DIRECTIONS = """# frame: ct
# axes: LPS
time_s,x,y,z,dx,dy,dz,roll_deg
0,10,20,30,0,0,1,0
1,11,20,30,0,1,1,90
"""


def landmark_seeds(case: SampleCase) -> dict[str, bytes]:
    """The sample's own, RAS, one undefined point, both fiducial lists."""
    return {
        "sample.mrk.json": case.landmarks.read_bytes(),
        "ras.mrk.json": as_json(markups("RAS", descriptions=("", "radius = 7.5 mm"))),
        "pins.mrk.json": as_json(markups("LPS", descriptions=("ligament r=12", "r=3mm"))),
        "list.fcsv": FCSV.encode(),
        "old.fcsv": OLD_FCSV.encode(),
    }


def markups(system: str, *, descriptions: tuple[str, str]) -> dict[str, object]:
    points = [
        {"id": str(k), "label": f"F-{k}", "description": text, "position": [1.5 + k, -20.0, 30.25],
         "orientation": [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0], "selected": True, "positionStatus": status}
        for k, (text, status) in enumerate(zip((*descriptions, ""), ("defined", "defined", "undefined"), strict=True))
    ]  # fmt: skip
    fiducial = {
        "type": "Fiducial", "coordinateSystem": system, "coordinateUnits": "mm", "locked": False,
        "labelFormat": "%N-%d", "controlPoints": points, "measurements": [], "display": {"opacity": 1.0},
    }  # fmt: skip
    return {"@schema": "https://raw.githubusercontent.com/slicer/markups-schema#", "markups": [fiducial]}


def region_seeds() -> dict[str, bytes]:
    turned = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    region = {
        "type": "ROI", "coordinateSystem": "LPS", "coordinateUnits": "mm", "roiType": "Box",
        "center": [0.1, 0.2, 5.0], "size": [1.0, 2.0, 3.0], "orientation": [-1, 0, 0, 0, -1, 0, 0, 0, 1],
        "insideOut": False, "controlPoints": [],
    }  # fmt: skip
    return {
        "roi.mrk.json": as_json({"@schema": "x", "markups": [region]}),
        "box.json": as_json({"center": [0, 0.5, 5], "size": [1, 1.5, 2], "axes": turned}),
        "case.json": as_json({"organ": 5, "roi": {"center": [0, 0, 5], "size": [1, 1, 1]}}),
    }


def trajectory_seeds() -> dict[str, bytes]:
    def pose(k: int, turn: dict[str, object]) -> dict[str, object]:
        return {"time_s": 0.5 * k, "position": [k, 0.5, 50], **turn, "jaw_deg": 30 - k}

    head = {"format": "organphys-trajectory", "version": 1, "frame": "scene", "unit": "mm"}
    turns = ({"quaternion": [1, 0, 0, 0]}, {"direction": [0, 0.6, 0.8], "roll_deg": 10})
    files = {f"poses_{n}.json": as_json(head | {"poses": [pose(k, t) for k in range(3)]}) for n, t in enumerate(turns)}
    return files | {"poses.csv": TRAJECTORY.encode(), "directions.csv": DIRECTIONS.encode()}


def point_seeds() -> dict[str, bytes]:
    rows = np.linspace(-50, 50, 15).reshape(5, 3)
    out = {"points.csv": b"x,y,z\n1,2,3\n4.5,-5,6e0\n", "bare.csv": b"1,2,3\n4,5,6\n"}
    for name, array in (("doubles", rows), ("floats", rows.astype("f4")), ("turned", np.asfortranarray(rows))):
        buffer = io.BytesIO()
        np.save(buffer, array)
        out[f"{name}.npy"] = buffer.getvalue()
    return out


def as_json(content: object) -> bytes:
    return json.dumps(content, indent=1).encode()
