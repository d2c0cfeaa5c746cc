"""The small interface that all skinning weights share, and how stored weights come back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from ..ground.checks import Array, InputError, one_of
from .learned import LearnedWeights
from .rkpm import RkpmWeights


class SkinningWeights(Protocol):
    """Smooth weight functions w_h(X), h < H, of the normalised organ (Modi et al., "Simplicits", ACM TOG 2024).

    The last one is the constant handle, w = 1 everywhere; the others have unit mean square over the organ.
    """

    @property
    def kind(self) -> str:
        """Name under which ``weights_from_arrays`` finds the class."""

    @property
    def handles(self) -> int:
        """Number H of handles, the constant one included."""

    def values(self, points: Array) -> Array:
        """Weights (N, H) at points (N, 3) of the normalised frame, also outside the organ."""

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Weights (N, H) and their derivatives (N, H, 3) with respect to the normalised coordinates."""

    def mixed(self, columns: Array, points: Array) -> Array:
        """sum_h w_h(X) columns_h (N, k) at points (N, 3), for columns (H, k)."""

    def mixed_with_gradient(self, columns: Array, points: Array) -> tuple[Array, Array]:
        """The same and its derivatives (N, k, 3) with respect to the normalised coordinates."""

    def arrays(self) -> dict[str, Array]:
        """All that is needed to build the weights again."""


def weights_from_arrays(kind: str, arrays: Mapping[str, Array]) -> SkinningWeights:
    """Weights of ``kind`` ("rkpm" or "learned") from what their ``arrays()`` gave."""
    one_of(kind, "kind of skinning weights", ("rkpm", "learned"))
    try:
        return RkpmWeights.from_arrays(arrays) if kind == "rkpm" else LearnedWeights.from_arrays(arrays)
    except KeyError as error:
        raise InputError(f"stored {kind} weights lack {error}: the file is damaged, write it again") from error
