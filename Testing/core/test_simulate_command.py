"""organphys simulate and export: what they write, what they warn of, and what they refuse in one line."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from asset_examples import CENTRE_MM, bent_organ
from test_export_files import read_surface, splat

from organphys.asset.asset_file import save_asset
from organphys.exports.animation import write_animation
from organphys.exports.gaussian_ply import write_gaussians
from organphys.exports.recording_file import load_recording
from organphys.ground.checks import InputError
from organphys.pipeline import simulation_run
from organphys.pipeline.command_line import main
from organphys.readers.gaussian_ply import read_gaussians
from organphys.readers.pins_file import read_pins
from organphys.readers.trajectory_file import read_trajectory
from organphys.simulation.organ_body import metres_per_unit
from organphys.simulation.session import replay

SMALL = ("--handles", "6", "--quadrature", "150", "--fps", "10")
BASE = {"recording.npz", "states.npz", "forces.csv", "trajectory.csv", "summary.json", "strip.png"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An asset, a splat on its surface with points far away, and pins."""
    folder, organ = tmp_path_factory.mktemp("organ"), bent_organ()
    save_asset(organ, folder / "organ.organphys")
    means = np.concatenate([organ.scene_vertices[::4], organ.scene_vertices[:7] + 9.0])
    write_gaussians(folder / "splat.ply", splat(means, np.array([0.7, 0.3, 0.2])))
    points = [
        {"label": "ligament", "description": "falciform, r=15", "position": [-80.0, 40.0, 110.0]},
        {"label": "other", "position": [40.0, 40.0, 110.0]},
        {"label": "not placed", "position": [0, 0, 0], "positionStatus": "undefined"},
    ]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm", "controlPoints": points}
    (folder / "pins.mrk.json").write_text(json.dumps({"markups": [markup]}))
    return folder


@pytest.fixture(scope="module")
def result(folder: Path) -> Path:
    """The default grasp, with everything that can be asked for."""
    asked = ("--splat", "splat.ply", "--splat-frames", "10", "--video", "gif", "--pins", "pins.mrk.json", "--detail")
    named = [str(folder / word) if (folder / word).exists() else word for word in asked]
    assert (
        main(["simulate", str(folder / "organ.organphys"), *SMALL, *named, "--quiet", "--out", str(folder / "run")])
        == 0
    )
    return folder / "run"


def refused(capsys: pytest.CaptureFixture[str], *argv: str | Path) -> str:
    """The one line of a command that ends with exit code 2 and leaves no folder."""
    code = main([str(word) for word in argv])
    out = capsys.readouterr()
    lines = [line for line in out.err.splitlines() if not re.match(r"organphys: +[\d.]+ s ", line)]
    assert code == 2 and len(lines) == 1 and lines[0].startswith("organphys: error: "), out.err
    return lines[0]


def trajectory(path: Path, *rows: str, frame: str = "ct", unit: str = "mm") -> Path:
    lines = [f"# frame: {frame}", f"# unit: {unit}", "time_s,x,y,z,jaw_deg,dx,dy,dz", *rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_all_files_are_there_and_agree(folder: Path, result: Path) -> None:
    frames = {f"splat/splat_{k:05d}.ply" for k in (0, 10, 20)}
    files = {path.relative_to(result).as_posix() for path in result.rglob("*") if path.is_file()}
    assert files == BASE | frames | {"video.gif"}
    with np.load(result / "states.npz", allow_pickle=False) as arrays:
        states = dict(arrays)
    names = (result / "forces.csv").read_text().splitlines()[0].split(",")
    rows = np.genfromtxt(result / "forces.csv", delimiter=",", skip_header=1)
    assert len(rows) == 21 and np.allclose(rows[:, 0], np.arange(21) / 10, atol=1e-5)
    assert np.allclose(rows[:, names.index("force_n_x")], states["force_n"][:, 0], rtol=1e-4, atol=1e-6)
    assert rows[:, names.index("held")].max() > 0  # the default grasp does grasp
    summary = json.loads((result / "summary.json").read_text())
    assert summary["steps"] == 20 and summary["min_det_f"] > 0 and summary["deepest_mm"] < 0.3
    assert summary["largest_force_n"] == pytest.approx(np.linalg.norm(states["force_n"], axis=1).max())
    assert [warning["code"] for warning in summary["warnings"]] == ["generic_tissue"]  # "ellipsoid" names no organ
    assert summary["pins"][0]["radius_m"] == pytest.approx(0.015) and len(summary["pins"]) == 2
    assert states["volume_ml"][0] == pytest.approx(summary["volume_ml"]["start"])
    assert all(len(states[name]) == 21 for name in ("time_s", "z_m", "tool_position_m", "jaw_deg", "torque_nm"))


def test_the_written_trajectory_is_the_path_as_driven(result: Path) -> None:
    trajectory = read_trajectory(result / "trajectory.csv")
    with np.load(result / "states.npz") as states:
        hinges = trajectory.positions - 0.0102 * trajectory.rotations[:, :, 2]  # the large needle driver's jaws
        assert np.allclose(hinges, states["tool_position_m"], atol=1e-9)
        assert np.allclose(trajectory.jaw_deg, states["jaw_deg"]) and (trajectory.frame, len(trajectory)) == ("m", 21)


def test_the_recording_replays_to_the_written_states(result: Path) -> None:
    moments = replay(load_recording(result / "recording.npz"))
    with np.load(result / "states.npz") as states:
        last = moments[-1]
        z = simulation_run.handle_coordinates(last.scene.bodies[0], last.state.bodies[0].z)
        assert np.array_equal(states["z_m"][-1], z)
        assert np.array_equal(states["tool_position_m"][-1], last.state.tools[0].position)


def test_splat_frames_and_exported_moments_are_the_same(folder: Path, result: Path, tmp_path: Path, capsys) -> None:
    start, end = (read_gaussians(result / "splat" / f"splat_{k:05d}.ply") for k in (0, 20))
    assert np.allclose(start.means, read_gaussians(folder / "splat.ply").means, atol=1e-6)
    moved = np.linalg.norm(end.means - start.means, axis=1)
    assert moved.max() > 0.02 and (moved[-7:] == 0).all()  # 2 mm at 100 mm per unit; what is far away stays
    export = ["export", folder / "organ.organphys", "--recording", result / "recording.npz", "--quiet"]
    out = tmp_path / "moment.ply"
    more = ["--format", "splat", "--splat", folder / "splat.ply", "--out", out]
    assert main([str(word) for word in [*export, *more, "--at", "2"]]) == 0
    assert np.abs(read_gaussians(out).means - end.means).max() < 1e-6  # a single moment is evaluated in another order
    for distance, far_away in (("3", 7), ("2000", 0)):
        assert main([str(word) for word in [*export[:-1], *more, "--at", "2", "--follow-mm", distance]]) == 0
        assert f" {len(moved) - far_away} of them follow" in capsys.readouterr().out
    more = ["--format", "splat", "--splat", folder / "splat.ply", "--out", tmp_path / "all", "--at", "all"]
    assert main([str(word) for word in [*export, *more]]) == 0
    names = sorted(path.name for path in (tmp_path / "all").iterdir())
    assert names == [f"splat_{k:05d}.ply" for k in range(21)]
    assert (tmp_path / "all" / names[-1]).read_bytes() == (result / "splat" / names[-1]).read_bytes()
    (tmp_path / "all" / "splat_00021.ply").touch()
    assert "frames of a longer sequence (splat_00021.ply)" in refused(capsys, *export, *more)
    surface = tmp_path / "moment.vtp"
    assert (
        main([str(word) for word in [*export, "--format", "vtp", "--frame", "m", "--out", surface, "--at", "0"]]) == 0
    )
    with np.load(result / "states.npz") as states:
        assert np.allclose(read_surface(surface)[0], states["vertices_m"], atol=1e-6)


def test_a_trajectory_is_followed_and_what_cannot_be_is_told(folder: Path, tmp_path: Path, capsys) -> None:
    x, y, z = CENTRE_MM
    path = trajectory(tmp_path / "t.csv", f"1,{x},{y},{z},10,0,0,-1", f"1.2,{x + 40},{y},{z},10,0,0,-1")
    argv = ["simulate", str(folder / "organ.organphys"), *SMALL, "--trajectory", str(path), "--gravity", "0,-1,0"]
    assert main([*argv, "--tissue", "spleen", "--out", str(tmp_path / "run")]) == 0
    told = capsys.readouterr().out
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["steps"] == 2 and summary["tissue"]["name"] == "spleen"
    codes = {warning["code"] for warning in summary["warnings"]}
    assert {"unpinned", "psm_limits", "tool_inside"} <= codes
    assert all(warning["message"] in told for warning in summary["warnings"])
    down = bent_organ().T_scene_ct.turn(np.array([0.0, -1.0, 0.0]))
    assert np.allclose(summary["gravity_m_s2"], 9.80665 * down)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tissue", "stone"], "--tissue"),
        (["--gravity", "0,0,0"], "--gravity"),
        (["--fps", "0", "--trajectory", "LONG"], "--fps"),
        (["--pins", "0,0,0"], "no tissue within"),
        (["--pins", "NONE"], "no such file"),
        (["--trocar", "1,2"], "--trocar"),
        (["--trocar", "9999,0,0"], "bring it nearer"),
        (["--video", "mp4"], "ffmpeg is not on the PATH"),
        (["--splat-frames", "3"], "together with --splat"),
        (["--device", "cuda"], "name one with --splat"),
        (["--quadrature", "3"], "--quadrature"),
        (["--trajectory", "NAN"], "not finite"),
        (["--trajectory", "LONG"], "more than 100000 steps"),
    ],
)
def test_bad_input_leaves_one_line_and_no_folder(folder, tmp_path, capsys, monkeypatch, options, message) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))  # no ffmpeg
    nan = trajectory(tmp_path / "nan.csv", "0,nan,0,0,10,0,0,-1")
    long = trajectory(tmp_path / "long.csv", "0,0,0,0,10,0,0,-1", "99999,0,0,0,10,0,0,-1")
    words = [{"NAN": nan, "LONG": long}.get(word, word) for word in options]
    line = refused(capsys, "simulate", folder / "organ.organphys", *SMALL, *words, "--out", tmp_path / "run")
    assert message in line
    assert not (tmp_path / "run").exists()


def test_an_asset_of_another_version_and_other_organs_are_refused(folder, result, tmp_path, capsys) -> None:
    content = (folder / "organ.organphys").read_bytes()
    newer = re.sub(rb'"version": \d', b'"version": 9', content)
    (tmp_path / "newer.organphys").write_bytes(newer)
    assert "newer.organphys" in refused(capsys, "simulate", tmp_path / "newer.organphys", "--out", tmp_path / "run")
    save_asset(bent_organ(0.5), tmp_path / "other.organphys")
    asked = ("--format", "stl", "--out", tmp_path / "x.stl", "--recording", result / "recording.npz")
    assert "another organ" in refused(capsys, "export", tmp_path / "other.organphys", *asked)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--format", "splat"], "--recording"),
        (["--format", "stl", "--at", "1"], "--recording"),
        (["--format", "stl", "--recording", "R", "--at", "7"], "from 0 s to 2 s"),
        (["--format", "stl", "--recording", "R", "--at", "all"], "--format splat"),
        (["--format", "stl", "--splat", "S"], "no colours"),
        (["--format", "npz", "--recording", "R"], "at rest"),
        (["--format", "stl", "--recording", "S"], "splat.ply"),
    ],
)
def test_export_refuses_what_does_not_go_together(folder, result, tmp_path, capsys, options, message) -> None:
    words = [{"R": result / "recording.npz", "S": folder / "splat.ply"}.get(word, word) for word in options]
    assert message in refused(capsys, "export", folder / "organ.organphys", *words, "--out", tmp_path / "x")
    assert not (tmp_path / "x").exists()


def test_ctrl_c_ends_with_130_and_no_folder(folder, tmp_path, monkeypatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(simulation_run.SimulationLog, "add", stopped)
    assert main(["simulate", str(folder / "organ.organphys"), *SMALL, "--quiet", "--out", str(tmp_path / "run")]) == 130
    assert not (tmp_path / "run").exists()


def test_pins_have_their_own_radius_or_the_common_one(folder: Path, tmp_path: Path) -> None:
    pins = read_pins(folder / "pins.mrk.json", radius_mm=7.0)
    assert np.allclose(pins.centres, [[80, -40, 110], [-40, -40, 110]]) and pins.radii_mm.tolist() == [15.0, 7.0]
    assert read_pins("1,2,3; 4,5,6").radii_mm.tolist() == [10.0, 10.0]
    bad = tmp_path / "pins.mrk.json"
    bad.write_text((folder / "pins.mrk.json").read_text().replace("r=15", "r=0"))
    with pytest.raises(InputError, match="radius of 0"):
        read_pins(bad)


def test_the_instrument_enters_where_it_is_told_and_an_organ_without_pins_is_told(folder, tmp_path, capsys) -> None:
    x, y, z = CENTRE_MM
    path = trajectory(tmp_path / "t.csv", f"0,{x},{y},{z + 60},10,0,0,-1", f"0.1,{x},{y},{z + 55},10,0,0,-1")
    argv = ["simulate", str(folder / "organ.organphys"), *SMALL, "--trajectory", str(path), "--quiet"]
    trocar_mm = np.array([x + 20.0, y + 10.0, z + 150.0])
    where = ",".join(f"{value:g}" for value in trocar_mm)
    assert main([*argv, "--trocar", where, "--out", str(tmp_path / "run")]) == 0
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    organ = bent_organ()
    expected = metres_per_unit(organ) * organ.T_scene_ct.apply(trocar_mm)
    assert np.allclose(summary["trocar_m"], expected, atol=1e-9)
    assert next(w["message"] for w in summary["warnings"] if w["code"] == "unpinned").endswith("--pins holds it")


def test_mp4_goes_through_ffmpeg_where_it_is(tmp_path, monkeypatch) -> None:
    images = [np.full((21, 31, 3), 60 * k, np.uint8) for k in range(4)]
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="ffmpeg is not on the PATH"):
        write_animation(tmp_path / "none.mp4", images, fps=20, format="mp4")
    program = tmp_path / "ffmpeg"  # writes what it was told and given
    lines = ["#!" + sys.executable, "import sys", "out = open(sys.argv[-1], 'wb')"]
    lines += ["out.write(' '.join(sys.argv).encode() + sys.stdin.buffer.read())"]
    program.write_text("\n".join(lines))
    program.chmod(0o755)
    write_animation(tmp_path / "film.mp4", images, fps=20, format="mp4")
    content = (tmp_path / "film.mp4").read_bytes()
    assert b"-s 30x20 -r 20" in content and content.endswith(images[-1][:20, :30].tobytes())
    program.write_text("\n".join([lines[0], "import sys", "sys.exit('no such encoder')"]))
    with pytest.raises(InputError, match="no such encoder"):
        write_animation(tmp_path / "bad.mp4", images, fps=20, format="mp4")
    assert not (tmp_path / "bad.mp4").exists()


@pytest.mark.parametrize("format", ["webp", "gif", "png"])
def test_animations_have_all_frames_and_their_time(tmp_path, format) -> None:
    from PIL import Image

    images = [np.full((20, 30, 3), 60 * k, np.uint8) for k in range(4)]
    write_animation(tmp_path / "a", images, fps=20, format=format)
    with Image.open(tmp_path / "a") as movie:
        assert movie.n_frames == 4 and movie.size == (30, 20)
        movie.seek(2)
        movie.load()
        assert movie.info["duration"] == pytest.approx(50)
    with pytest.raises(InputError, match="no frames"):
        write_animation(tmp_path / "b", [], fps=20)
