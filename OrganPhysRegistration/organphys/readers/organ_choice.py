"""Which labels the user means: an id, a name the file carries, or a name of a label scheme; never a guess."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..ground.checks import InputError
from .label_counts import count_labels
from .label_schemes import SCHEMES, scheme_labels, scheme_names
from .label_volume import VolumeHeader
from .segment_table import Segment, named_segments


@dataclass(frozen=True)
class OrganChoice:
    """Labels of one layer that make up the organ, and its name."""

    labels: tuple[int, ...]
    layer: int
    name: str


def choose_organ(header: VolumeHeader, organ: str | int, label_scheme: str | None = None) -> OrganChoice:
    """What ``organ`` means in this file: a name in it, label ids ("5", "1+2"), or a name of the scheme.

    InputError lists what there is. Case, word order and space against underscore make no difference in names.
    """
    scheme_names(label_scheme)  # an unknown scheme is an error whether it is needed or not
    segments, wanted = named_segments(header), name_key(str(organ))
    matches = [s for s in segments if s.name and name_key(s.name) == wanted]
    if len(matches) > 1:
        raise InputError(f"{header.path}: {len(matches)} segments are named {organ!r}; rename all but one")
    if matches:
        return OrganChoice((matches[0].label,), matches[0].layer, str(matches[0].name))
    if isinstance(organ, int) or re.fullmatch(r"\s*[-+]?\d+(\s*\+\s*\d+)*\s*", organ):
        labels = tuple(int(label) for label in re.findall(r"-?\d+", str(organ)))
        return _by_labels(header, segments, labels, label_scheme)
    if label_scheme is not None:
        for name, labels in scheme_labels(label_scheme).items():
            if name_key(name) == wanted:
                return OrganChoice(labels, _only_layer(header, segments, labels), name)
    raise InputError(f"{header.path}: {_unknown(organ, bool(segments), label_scheme)}; {present(header, label_scheme)}")


def name_key(name: str) -> str:
    """Lower-case words in alphabetical order, so that "Right kidney" and "kidney_right" agree."""
    return " ".join(sorted(re.split(r"[\s_\-]+", name.lower().strip())))


def present(header: VolumeHeader, label_scheme: str | None) -> str:
    """'present: ...' with all labels, their names where known, and volumes; InputError where there is none."""
    found = ", ".join(str(count) for count in count_labels(header, label_scheme=label_scheme))
    if not found:
        raise InputError(f"{header.path}: the label map is empty, every voxel is 0; give the map that holds the organ")
    return f"present: {found}"


def _by_labels(
    header: VolumeHeader, segments: tuple[Segment, ...], labels: tuple[int, ...], label_scheme: str | None
) -> OrganChoice:
    if min(labels) < 1:
        raise InputError(f"organ: label {min(labels)} is the background or negative; give an id above 0 or a name")
    layer = _only_layer(header, segments, labels)
    in_file = {s.label: s.name for s in segments if s.layer == layer}
    names = [in_file.get(label) or scheme_names(label_scheme).get(label) for label in labels]
    return OrganChoice(labels, layer, " + ".join(n or f"label {k}" for n, k in zip(names, labels, strict=True)))


def _only_layer(header: VolumeHeader, segments: tuple[Segment, ...], labels: tuple[int, ...]) -> int:
    """The one layer the labels can be in; in a file of several layers the named segments must settle it."""
    if header.layers == 1:
        return 0
    layers = {s.layer for s in segments if s.label in labels}
    carriers = [s for s in segments if s.label in labels]
    if len(layers) == 1 and len(carriers) == len(labels):
        return layers.pop()
    names = ", ".join(repr(s.name) for s in segments) or "none is named"
    raise InputError(f"{header.path}: {header.layers} layers, so a label id is ambiguous; give a segment name: {names}")


def _unknown(organ: str | int, named: bool, label_scheme: str | None) -> str:
    if label_scheme is not None:
        return f"neither the file nor scheme {label_scheme} knows an organ {organ!r}"
    if named:
        return f"no segment is named {organ!r}"
    return f"the file names no organs: give a label id, or {organ!r} with --label-scheme {'|'.join(SCHEMES)}"
