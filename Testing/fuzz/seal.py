"""The seal of a recording, made to fit what a mutation left of it."""

from __future__ import annotations

import json

from mutate_archive import load_member, members_of, zipped

from organphys.exports.recording_file import seal


def resealed(content: bytes) -> bytes:
    """The recording with a seal that fits; as it is where it cannot be read at all."""
    try:
        members = members_of(content)
        header = json.loads(next(data for name, data in members if name == "recording.json"))
        arrays = {name.removesuffix(".npy"): load_member(data) for name, data in members if name.endswith(".npy")}
        header["seal"] = seal({name: value for name, value in header.items() if name != "seal"}, arrays)
    except (ValueError, OSError, StopIteration, TypeError, AttributeError, RecursionError, NotImplementedError):
        return content
    text = json.dumps(header).encode("utf-8", errors="surrogatepass")
    return zipped([(name, text if name == "recording.json" else data) for name, data in members])
