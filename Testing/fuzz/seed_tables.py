"""Seed tables and lists: the times and splats of a sequence, the cases of a batch, and the files that they name."""

from __future__ import annotations

from seed_texts import as_json, markups

FRAMES = ("t_1.ply", "t_2.ply", "t_10.ply")
CASES = """case,labels,organ,splat,camera,clean,mm_per_unit,seed
a,ct.nii.gz,5,t_1.ply,0 0 0,yes,,1
b 2,ct.nii.gz,liver,t_2.ply,-1e-1 0.5 2,no,25:5,
"""
MARKED = """case;labels;organ;splat;landmarks;roi;label-scheme
"c";ct.nii.gz;5;t_10.ply;marks.mrk.json;box.json;totalsegmentator
d;ct.nii.gz;5;t_1.ply;"-1,2,3;4,5,6";;
"""


def table_seeds() -> dict[str, dict[str, bytes]]:
    """Reader -> name -> content."""
    return {
        "times": {"plain.txt": b"0.5\n0.7\n1.0\n", "spaced.csv": b"\xef\xbb\xbf 0\r\n\r\n1e-1\r\n 2.5e0\r\n"},
        "frames": {"list.txt": b"# in this order\nt_2.ply\n\nt_1.ply\nt_10.ply\n", "twice.txt": b"t_1.ply\r\nt_1.ply"},
        "cases": {"cases.csv": CASES.encode(), "marked.csv": b"\xef\xbb\xbf" + MARKED.replace("\n", "\r\n").encode()},
    }


def named_files() -> dict[str, bytes]:
    """What the seeds name; of splats and label maps only the name is looked at."""
    small = {
        "marks.mrk.json": as_json(markups("RAS", descriptions=("", ""))),
        "box.json": b'{"center":[0,0,1],"size":[1,1,1]}',
    }
    return {**dict.fromkeys((*FRAMES, "ct.nii.gz"), b""), **small}
