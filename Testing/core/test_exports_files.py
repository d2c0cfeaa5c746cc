"""surface.vtp and registration.json, read back."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import bent_organ

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.exports.registration_json import write_registration_json
from organphys.exports.surface_vtp import write_surface_vtp
from organphys.ground.checks import InputError
from organphys.ground.notices import Notice
from organphys.ground.plain_json import plain


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


def test_surface_file_comes_back(organ: RegisteredOrgan, tmp_path: Path) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    distance = np.linspace(0, 9, len(organ.vertices))
    write_surface_vtp(tmp_path / "surface.vtp", organ, distance)
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "surface.vtp"))
    reader.Update()
    data = reader.GetOutput()
    assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), organ.scene_vertices)
    assert np.array_equal(vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3), organ.faces)
    arrays = {
        name: vtk_to_numpy(data.GetPointData().GetArray(name)) for name in ("distance_mm", "displacement_mm", "det_F")
    }
    assert np.allclose(arrays["distance_mm"], distance, rtol=1e-6)
    assert np.allclose(arrays["displacement_mm"], organ.surface_displacement_mm, atol=1e-5)
    assert np.allclose(arrays["det_F"], np.linalg.det(organ.deformation_gradient(organ.vertices)), atol=1e-5)
    assert data.GetFieldData().GetAbstractArray("SPACE").GetValue(0) == "RAS"
    assert [p.name for p in tmp_path.iterdir()] == ["surface.vtp"]


def test_surface_file_holds_the_error_radii_of_an_organ_that_knows_them(organ: RegisteredOrgan, tmp_path: Path) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    factor = 0.002 * np.random.default_rng(0).normal(size=(3 * organ.basis.size + 1, 4))
    sure = replace(organ, uncertainty=ReducedCovariance(factor, 6.0))
    write_surface_vtp(tmp_path / "surface.vtp", sure)
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "surface.vtp"))
    reader.Update()
    data = reader.GetOutput().GetPointData()
    for percent in (68, 95):
        found = vtk_to_numpy(data.GetArray(f"error_{percent}_mm"))
        assert np.allclose(found, sure.surface_error_mm(percent / 100), rtol=1e-5)


def test_surface_file_needs_one_distance_per_vertex(organ: RegisteredOrgan, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="one number for each"):
        write_surface_vtp(tmp_path / "surface.vtp", organ, np.zeros(3))
    assert not list(tmp_path.iterdir())


def test_no_rendering_module_is_loaded(tmp_path: Path) -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path\n"
        "from asset_examples import bent_organ\n"
        "from organphys.exports.surface_vtp import write_surface_vtp\n"
        "import organphys.exports.report\n"
        "assert 'matplotlib' not in sys.modules and 'PIL' not in sys.modules\n"
        "write_surface_vtp(Path(sys.argv[2]) / 's.vtp', bent_organ())\n"
        "bad = [m for m in sys.modules if 'vtkRendering' in m or m.split('.')[0] in ('torch', 'warp')]\n"
        "assert not bad, bad\n"
    )
    subprocess.run([sys.executable, "-c", code, str(Path(__file__).parent), str(tmp_path)], check=True)


def test_registration_json(tmp_path: Path) -> None:
    write_registration_json(
        tmp_path / "registration.json",
        method="organphys",
        scale_scene_per_mm=0.0102,
        seconds={"read": np.float64(1.5), "total": 2},
        peak_memory_mb=None,
        metrics={"elastic": {"mean": {"value": np.nan, "unit": "mm"}}},
        stops={"elastic": "converged"},
        warnings=[Notice("few_seen", "Only 9 % seen.")],
        extra={"schema": 7, "seed": 3},
    )
    text = (tmp_path / "registration.json").read_text(encoding="utf-8")
    data = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert data["schema"] == 1 and data["seed"] == 3 and data["method"] == "organphys"
    assert data["metrics"]["elastic"]["mean"] == {"value": None, "unit": "mm"}
    assert data["warnings"] == [{"code": "few_seen", "message": "Only 9 % seen."}]
    assert data["seconds"] == {"read": 1.5, "total": 2} and data["peak_memory_mb"] is None


def test_plain_values() -> None:
    assert plain({"a": (np.int64(3), np.array([1.0, np.inf])), 2: Path("x")}) == {"a": [3, [1.0, None]], "2": "x"}
    with pytest.raises(TypeError):
        plain(object())
