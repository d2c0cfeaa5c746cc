"""Which label the user means: an id, a name the file carries, or a name of a label scheme; never a guess."""

from __future__ import annotations

from ..ground.checks import InputError
from .label_counts import count_labels
from .label_schemes import SCHEMES, scheme_names
from .label_volume import VolumeHeader
from .segment_table import Segment, named_segments


def choose_segment(header: VolumeHeader, organ: str | int, label_scheme: str | None = None) -> Segment:
    """The segment ``organ`` names; case and space against underscore make no difference. InputError lists the rest."""
    segments = named_segments(header)
    wanted = normalised_name(str(organ))
    matches = [s for s in segments if s.name and normalised_name(s.name) == wanted]
    if len(matches) > 1:
        raise InputError(f"{header.path}: {len(matches)} segments are named {organ!r}; rename them or give a label id")
    if matches:
        return matches[0]
    if wanted.lstrip("+-").isdigit():
        return _by_label(header, segments, int(wanted), label_scheme)
    return _by_scheme(header, segments, str(organ), label_scheme)


def normalised_name(name: str) -> str:
    """Lower case, with spaces, hyphens and underscores as one and the same."""
    return "_".join(name.lower().replace("-", " ").replace("_", " ").split())


def _by_label(header: VolumeHeader, segments: tuple[Segment, ...], label: int, label_scheme: str | None) -> Segment:
    if label < 1:
        raise InputError(f"organ: label {label} is the background or negative; give an id above 0 or a name")
    carriers = [s for s in segments if s.label == label]
    if len(carriers) == 1:
        return carriers[0]
    if header.layers > 1:
        names = ", ".join(repr(s.name) for s in carriers or segments) or "none named"
        raise InputError(f"{header.path}: label {label} is not unique in {header.layers} layers; give a name: {names}")
    name = scheme_names(label_scheme).get(label) if label_scheme else None
    return Segment(label, 0, name)


def _by_scheme(header: VolumeHeader, segments: tuple[Segment, ...], organ: str, label_scheme: str | None) -> Segment:
    if label_scheme is not None:
        for label, name in scheme_names(label_scheme).items():
            if normalised_name(name) == normalised_name(organ):
                return _by_label(header, (), label, label_scheme)
    present = ", ".join(str(count) for count in count_labels(header, label_scheme=label_scheme)) or "nothing"
    if label_scheme is not None:
        raise InputError(f"{header.path}: {label_scheme} has no organ {organ!r}; present: {present}")
    if segments:
        raise InputError(f"{header.path}: no segment is named {organ!r}; present: {present}")
    raise InputError(
        f"{header.path}: the file names no organs, so {organ!r} needs --label-scheme {'|'.join(SCHEMES)}, "
        f"or give a label id; present: {present}"
    )
