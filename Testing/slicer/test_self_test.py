"""The test class that runs inside Slicer runs here as well, by the same script."""

from __future__ import annotations

import run_in_slicer
import slicer


def test_self_test_passes(module):
    assert run_in_slicer.run_self_test() == slicer.util.EXIT_SUCCESS


def test_failed_self_test_is_an_exit_failure(module, monkeypatch, capsys):
    def fail():
        raise AssertionError("not registered")

    monkeypatch.setitem(slicer.selfTests, run_in_slicer.MODULE, fail)
    assert run_in_slicer.run_self_test() == slicer.util.EXIT_FAILURE
    assert "not registered" in capsys.readouterr().err
