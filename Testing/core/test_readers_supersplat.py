"""SuperSplat's compressed PLY against an encoder written here from the format's description."""

import numpy as np
import pytest
from reader_samples import ply_bytes

from organphys.ground.checks import InputError
from organphys.readers.gaussian_ply import describe_splat, read_gaussians, read_splat

COUNT = 600  # two full chunks and a part


def pack(values, low, high, bits):
    """Three columns within bounds into one word, most significant first."""
    word = np.zeros(len(values), np.uint64)
    for k, b in enumerate(bits):
        span = np.where(high[:, k] > low[:, k], high[:, k] - low[:, k], 1)
        step = np.rint((values[:, k] - low[:, k]) / span * (2**b - 1)).astype(np.uint64)
        word = (word << np.uint64(b)) | step
    return word


def pack_rotation(quaternions):
    words = []
    for q in quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True):
        largest = int(np.abs(q).argmax())
        q = q * np.sign(q[largest])
        word = largest
        for k in range(4):
            if k != largest:
                word = (word << 10) | int(np.rint((q[k] / np.sqrt(2) + 0.5) * 1023))
        words.append(word)
    return np.array(words, "u4")


def compressed(seed=0, colour_bounds=True, degree=0):
    rng = np.random.default_rng(seed)
    chunk = np.arange(COUNT) // 256
    means, scales = rng.normal(size=(COUNT, 3)) + 5 * chunk[:, None], rng.uniform(-9, -3, (COUNT, 3))
    quaternions = rng.normal(size=(COUNT, 4))
    colours = rng.uniform(-0.3, 1.3, (COUNT, 3)) if colour_bounds else rng.uniform(0, 1, (COUNT, 3))
    alpha = rng.uniform(0, 1, COUNT)
    alpha[:2] = 0, 1
    table, low, high = {}, {}, {}
    for name, values in (("", means), ("scale_", scales), ("rgb", colours)):
        low[name] = np.stack([values[chunk == c].min(0) for c in range(3)]).astype("f4")
        high[name] = np.stack([values[chunk == c].max(0) for c in range(3)]).astype("f4")
        if name == "rgb" and not colour_bounds:
            low[name], high[name] = np.zeros((3, 3)), np.ones((3, 3))
            continue
        for bound, numbers in (("min", low[name]), ("max", high[name])):
            for k, axis in enumerate("rgb" if name == "rgb" else "xyz"):
                table[f"{bound}_{axis if name == 'rgb' else name + axis}"] = numbers[:, k].copy()
    position = pack(means, low[""][chunk], high[""][chunk], (11, 10, 11))
    scale = pack(scales, low["scale_"][chunk], high["scale_"][chunk], (11, 10, 11))
    colour = (pack(colours, low["rgb"][chunk], high["rgb"][chunk], (8, 8, 8)) << np.uint64(8)) | np.rint(
        alpha * 255
    ).astype(np.uint64)
    vertex = {"packed_position": position, "packed_rotation": pack_rotation(quaternions), "packed_scale": scale}
    vertex["packed_color"] = colour
    elements = {"chunk": table, "vertex": {n: w.astype("u4") for n, w in vertex.items()}}
    rest = rng.uniform(-3, 3, (COUNT, 3 * ((degree + 1) ** 2 - 1)))
    if degree:
        elements["sh"] = {
            f"f_rest_{i}": np.rint((rest[:, i] / 8 + 0.5) * 255).astype("u1") for i in range(rest.shape[1])
        }
    return elements, {
        "means": means,
        "scales": scales,
        "quaternions": quaternions,
        "colours": colours,
        "alpha": alpha,
        "rest": rest,
    }


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("colour_bounds", "degree"), [(True, 0), (False, 1), (True, 3)])
def test_decoded_within_the_quantisation(tmp_path, order, colour_bounds, degree):
    elements, truth = compressed(colour_bounds=colour_bounds, degree=degree)
    path = tmp_path / "a.compressed.ply"
    path.write_bytes(ply_bytes(elements, order))
    cloud, full, info = read_splat(path), read_gaussians(path), describe_splat(path)
    assert np.abs(cloud.centres - truth["means"]).max() < 8 / 1023 / 2 * 1.01
    assert np.abs(cloud.opacities - truth["alpha"]).max() < 0.51 / 255
    assert np.abs(cloud.colours - np.clip(truth["colours"], 0, 1)).max() < 1.6 * 0.51 / 255
    assert np.abs(full.log_scales - truth["scales"]).max() < 6 / 1023 / 2 * 1.01
    unit = truth["quaternions"] / np.linalg.norm(truth["quaternions"], axis=1, keepdims=True)
    assert np.abs((full.quaternions * unit).sum(1)).min() > 1 - 1e-5
    assert np.allclose(np.linalg.norm(full.quaternions, axis=1), 1, atol=1e-5)
    assert full.sh_rest.shape == (COUNT, 3, (degree + 1) ** 2 - 1)
    assert np.allclose(full.sh_rest.reshape(COUNT, -1), truth["rest"], atol=8 / 255 / 2 * 1.01)
    assert np.allclose(0.5 + 0.28209479 * full.sh_dc, truth["colours"], atol=1.6 * 0.51 / 255)
    assert np.isfinite(full.opacity_logits).all() and np.array_equal(full.means, cloud.centres)
    assert (info.kind, info.count, info.sh_degree) == ("SuperSplat compressed", COUNT, degree)


def test_broken_chunk_masks_its_gaussians(tmp_path):
    elements, _ = compressed()
    elements["chunk"]["max_y"][1] = np.inf
    path = tmp_path / "a.ply"
    path.write_bytes(ply_bytes(elements))
    cloud = read_splat(path)
    assert np.array_equal(np.flatnonzero(~cloud.valid), np.arange(256, 512))
    assert [n.code for n in cloud.notices] == ["non_finite_gaussians"]


def test_incomplete_layouts_are_input_errors(tmp_path):
    def reading(change):
        elements, _ = compressed(degree=1)
        change(elements)
        (tmp_path / "a.ply").write_bytes(ply_bytes(elements))
        with pytest.raises(InputError, match="export"):
            read_splat(tmp_path / "a.ply")

    reading(lambda e: e.pop("chunk"))
    reading(lambda e: e["chunk"].pop("max_scale_z"))
    reading(lambda e: e["vertex"].pop("packed_rotation"))
    reading(lambda e: e["sh"].pop("f_rest_8"))
    reading(lambda e: e.update(chunk={n: c[:2] for n, c in e["chunk"].items()}))
    data = ply_bytes(compressed()[0])
    (tmp_path / "cut.ply").write_bytes(data[:-100])
    with pytest.raises(InputError, match="truncated"):
        read_splat(tmp_path / "cut.ply")
