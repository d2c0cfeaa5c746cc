"""Warp's kernels that move nodes and Gaussians: one thread each, the same on CPU and CUDA. Importing it loads warp."""

# mypy: disable-error-code="valid-type, no-untyped-def"
# Annotations are the types of the kernel's arguments, as warp reads them.

import warp as wp

wp.config.log_level = wp.LOG_WARNING  # standard output belongs to the command line
Motion = wp.types.vector(length=12, dtype=wp.float32)


@wp.kernel
def move_nodes(rows: wp.array(dtype=wp.float32, ndim=3), z: wp.array(dtype=wp.vec3), fields: wp.array(dtype=Motion)):
    """Motion of the node ``thread``: displacement, m, and F - I by columns, at Z (n,).

    rows (4, n, Nn): Phi and its three slopes with the nodes last, so that neighbouring threads read neighbours.
    """
    i = wp.tid()
    out = Motion()
    for k in range(rows.shape[1]):
        for m in range(4):
            for a in range(3):
                out[3 * m + a] += rows[m, k, i] * z[k][a]
    fields[i] = out


@wp.kernel
def move_gaussians(
    fields: wp.array(dtype=Motion),
    corners: wp.array(dtype=wp.int32, ndim=2),
    cell: wp.array(dtype=wp.int32),
    part: wp.array(dtype=wp.vec3),
    points: wp.array(dtype=wp.vec3),
    share: wp.array(dtype=wp.float32),
    share_slope: wp.array(dtype=wp.vec3),
    covariance: wp.array(dtype=wp.mat33),
    centres: wp.array(dtype=wp.vec3),
    weights: wp.array(dtype=wp.vec3),
    kernel_radius: wp.float32,
    middle: wp.vec3,
    reach: wp.float32,
    per_metre: wp.float32,
    first: wp.int32,
    gradients: wp.bool,
    moved: wp.array(dtype=wp.vec3),
    shape: wp.array(dtype=wp.mat33),
):
    """Displacement in scene units and F C F^T of Gaussian ``first`` + thread; see ``splat_numpy`` for the formulas.

    With ``gradients`` F itself is given instead of F C F^T.
    fields (Nn, 12): motion of the nodes; centres and weights (k,) of local functions, of which there may be none.
    """
    i = wp.tid() + first
    c = cell[i]
    t = part[i]
    body = Motion()
    for k in range(8):
        x = wp.where(k >= 4, t[0], 1.0 - t[0])
        y = wp.where((k // 2) % 2 == 1, t[1], 1.0 - t[1])
        z = wp.where(k % 2 == 1, t[2], 1.0 - t[2])
        body += x * y * z * fields[corners[c, k]]
    u = wp.vec3(body[0], body[1], body[2])
    f0 = wp.vec3(body[3], body[4], body[5])
    f1 = wp.vec3(body[6], body[7], body[8])
    f2 = wp.vec3(body[9], body[10], body[11])
    if wp.length(points[i] - middle) < reach:
        for k in range(centres.shape[0]):
            offset = points[i] - centres[k]
            r = wp.length(offset) / kernel_radius
            if r < 1.0:
                s = 1.0 - r
                u += s * s * s * s * (4.0 * r + 1.0) * weights[k]
                slope = -20.0 * s * s * s / (kernel_radius * kernel_radius)
                f0 += slope * offset[0] * weights[k]
                f1 += slope * offset[1] * weights[k]
                f2 += slope * offset[2] * weights[k]
    b = share[i]
    g = share_slope[i]
    f = wp.matrix_from_cols(b * f0 + g[0] * u, b * f1 + g[1] * u, b * f2 + g[2] * u) + wp.identity(n=3, dtype=float)
    moved[i] = b * per_metre * u
    shape[i] = wp.where(gradients, f, f * covariance[i] * wp.transpose(f))
