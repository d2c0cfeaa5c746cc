"""Homogeneous matrices between VTK and numpy, and the way from a node up to the world."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from organphys.ground.checks import Array, InputError

ROLE = "OrganPhys.Role"
OVERLAY_FRAME = "overlay_frame"


def array_of(matrix: vtk.vtkMatrix4x4) -> Array:
    """A vtkMatrix4x4 as an array (4, 4)."""
    return np.array(matrix.GetData(), dtype=np.float64).reshape(4, 4)


def matrix_of(array: Array) -> vtk.vtkMatrix4x4:
    """An array (4, 4) as a vtkMatrix4x4."""
    matrix = vtk.vtkMatrix4x4()
    matrix.DeepCopy(np.asarray(array, dtype=np.float64).ravel())
    return matrix


def to_parent(node: Any) -> Array:
    """Matrix (4, 4) of a linear transform node."""
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToParent(matrix)
    return array_of(matrix)


def scale_of(matrix: Array) -> float:
    """Length ratio of a similarity (4, 4)."""
    return float(np.cbrt(np.linalg.det(np.asarray(matrix, dtype=np.float64)[:3, :3])))


def apply_matrix(T_target_source: Array, points: Array) -> Array:
    """Points (N, 3) or (3,) mapped by a homogeneous matrix (4, 4)."""
    mapped: Array = turn(T_target_source[:3, :3], np.asarray(points, dtype=np.float64)) + T_target_source[:3, 3]
    return mapped


def turn(matrix: Array, vectors: Array) -> Array:
    """Vectors (..., 3) times a matrix (3, 3). A matrix product would wait for BLAS threads: up to twenty times as long
    while a registration uses the processor."""
    turned: Array = np.einsum("...j,kj->...k", vectors, matrix)
    return turned


def world_from_node(node: Any, *, without_overlay: bool = False) -> Array:
    """T_world_node (4, 4): all parent transforms of a transformable node, which must be linear.

    ``without_overlay``: the matrix of the case's overlay frame counts as the identity, its own parents still apply.
    """
    T_world_node, parent = np.eye(4), node.GetParentTransformNode()
    while parent is not None:
        if not (without_overlay and parent.GetAttribute(ROLE) == OVERLAY_FRAME):
            if not parent.IsLinear():
                raise InputError(
                    f"{node.GetName()}: its parent transform {parent.GetName()} is not linear; "
                    "take the node out of it, or harden it there first"
                )
            T_world_node = to_parent(parent) @ T_world_node
        parent = parent.GetParentTransformNode()
    return T_world_node
