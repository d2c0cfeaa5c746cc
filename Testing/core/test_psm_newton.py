"""Newton's solver against the closed form, and what is told where newton is missing."""

import importlib.util
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.simulation.psm import INSTRUMENTS, Psm
from organphys.simulation.psm_newton import newton_inverse
from organphys.simulation.state import ToolPose

needs_newton = pytest.mark.skipif(
    importlib.util.find_spec("newton") is None, reason="newton is not installed (pip install 'organphys[newton]')"
)


def arm(name: str = "large_needle_driver") -> Psm:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    pose[:3, 3] = [0.05, -0.12, 0.3]
    return Psm(INSTRUMENTS[name], pose)


def poses_inside(psm: Psm, count: int) -> list[ToolPose]:
    low, high = psm.instrument.limits.T
    joints = np.random.default_rng(7).uniform(low, high, (count, 6))
    return list(psm.poses(joints, np.full(count, 20.0)))


@needs_newton
@pytest.mark.parametrize("name", list(INSTRUMENTS))
def test_newton_and_the_closed_form_agree(name, capsys):
    psm = arm(name)
    poses = poses_inside(psm, 500 if name == "large_needle_driver" else 100)
    low, high = psm.instrument.limits.T
    for pose, found in zip(poses, newton_inverse(psm, poses), strict=True):
        exact = psm.inverse(pose, near=found.joints)
        assert found.position_error_m <= 1e-6 and found.rotation_error_deg <= 1e-3  # 1e-3 mm
        assert np.linalg.norm(found.pose.position - exact.pose.position) <= 1e-6
        assert found.limits == () and (found.joints >= low).all() and (found.joints <= high).all()
        assert found.jaw_deg == 20.0
    assert capsys.readouterr().out == ""


@needs_newton
def test_beyond_the_limits_newton_stays_inside_and_says_so():
    psm = arm()
    low, high = psm.instrument.limits.T
    wanted = psm.home + np.array([0, 0, 0.2, 0, 0, 0])
    (found,) = newton_inverse(psm, [psm.forward(wanted, 120.0)])
    assert (found.joints >= low).all() and (found.joints <= high).all()
    assert found.position_error_m > 0.05 and "jaw" in found.limits and "insertion" in found.limits


@needs_newton
def test_newton_refuses_what_it_cannot_use():
    psm = arm()
    assert newton_inverse(psm, []) == ()
    with pytest.raises(InputError, match="finite"):
        newton_inverse(psm, [ToolPose(np.array([np.nan, 0, 0]))])
    with pytest.raises(InputError, match="device"):
        newton_inverse(psm, poses_inside(psm, 1), device="abacus")


def test_without_newton_the_message_says_what_to_do(monkeypatch):
    psm = arm("mega")
    monkeypatch.setitem(sys.modules, "newton", None)
    monkeypatch.setattr("organphys.simulation.psm_newton._arm.cache_clear", lambda: None, raising=False)
    with pytest.raises(InputError, match=r"organphys\[newton\]"):
        newton_inverse(psm, poses_inside(psm, 1), device="none")
