"""What a splat read from a file must be, told by a second, plain reading of the same bytes."""

from __future__ import annotations

import numpy as np

from organphys.points.gaussians import Gaussians
from organphys.points.point_sets import GaussianCloud

FORMATS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
TYPES = {
    **dict.fromkeys((b"char", b"int8"), "i1"), **dict.fromkeys((b"uchar", b"uint8"), "u1"),
    **dict.fromkeys((b"short", b"int16"), "i2"), **dict.fromkeys((b"ushort", b"uint16"), "u2"),
    **dict.fromkeys((b"int", b"int32"), "i4"), **dict.fromkeys((b"uint", b"uint32"), "u4"),
    **dict.fromkeys((b"float", b"float32"), "f4"), **dict.fromkeys((b"double", b"float64"), "f8"),
}  # fmt: skip


@np.errstate(all="ignore")
def splat_problem(content: bytes, cloud: GaussianCloud, gaussians: Gaussians) -> str | None:
    """Why the result is no true reading of the file; None if it is one."""
    count = len(cloud)
    if len(gaussians) != count or count < 1:
        return f"{count} and {len(gaussians)} Gaussians"
    if cloud.centres.shape != (count, 3) or cloud.colours.shape != (count, 3) or cloud.valid.dtype != bool:
        return "shapes"
    if not (cloud.opacities.shape == cloud.valid.shape == gaussians.valid.shape == (count,)):
        return "shapes of opacities or validity"
    if not np.array_equal(cloud.valid, gaussians.valid) or not np.array_equal(
        cloud.centres, gaussians.means, equal_nan=True
    ):
        return "cloud and full record differ"
    for values, low, high in ((cloud.centres, -np.inf, np.inf), (cloud.opacities, 0, 1), (cloud.colours, 0, 1)):
        seen = values[cloud.valid]
        if not np.isfinite(seen).all() or (seen < low).any() or (seen > high).any():
            return "a valid Gaussian with numbers out of range"
    return _same_places(content, cloud)


def _same_places(content: bytes, cloud: GaussianCloud) -> str | None:
    """Centres as the plain reading has them, where they are not packed."""
    head, _, body = content.partition(b"\nend_header")
    lines = [line.split() for line in head.splitlines()]
    elements = [(k, line) for k, line in enumerate(lines) if line[:1] == [b"element"]]
    if elements[0][1][1] != b"vertex":
        return None if len(cloud) == int(dict((e[1], e[2]) for _, e in elements)[b"vertex"]) else "count"
    at, (_, _, number) = elements[0]
    if int(number) != len(cloud):
        return f"{len(cloud)} of {int(number)} declared vertices"
    fields = []
    for line in lines[at + 1 :]:
        if line[:1] == [b"element"]:
            break
        if line[:1] == [b"property"]:
            fields.append((line[2], TYPES[line[1]]))
    if b"x" not in dict(fields):
        return None
    order = FORMATS[next(line[1] for line in reversed(lines) if line[:1] == [b"format"])]
    body = body[body.find(b"\n") + 1 :]
    if order:
        dtype = np.dtype([(name.decode(errors="replace"), order + kind) for name, kind in fields])
        rows = np.frombuffer(body, dtype, len(cloud))
        places = np.stack([rows[name].astype("f8") for name in "xyz"], axis=1)
    else:
        columns = [[name for name, _ in fields].index(axis) for axis in (b"x", b"y", b"z")]
        table = [line.split() for line in body.splitlines() if line.split()][: len(cloud)]
        places = np.array([[float(row[k]) for k in columns] for row in table])
    with np.errstate(all="ignore"):
        same = np.array_equal(places.astype(cloud.centres.dtype), cloud.centres, equal_nan=True)
    return None if same else "centres differ from a plain reading"
