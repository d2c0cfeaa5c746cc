"""Nearest neighbours on several threads: the tree's own answer, and no thread left behind by an interrupt."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

from organphys.points.neighbours import nearest_neighbours

INTERRUPTED = """
import signal, threading
import numpy as np
from scipy.spatial import cKDTree
from organphys.points.neighbours import nearest_neighbours

def stop(number, frame):
    raise KeyboardInterrupt

points = np.random.default_rng(0).normal(size=(60_000, 3))
tree = cKDTree(points)
signal.signal(signal.SIGALRM, stop)
signal.setitimer(signal.ITIMER_REAL, 0.05)
try:
    nearest_neighbours(tree, points, k=20)
    print("finished")
except KeyboardInterrupt:
    print(threading.active_count())
"""


@pytest.mark.parametrize("count", [1, 3, 1000, 5000])
@pytest.mark.parametrize("options", [{}, {"k": 4}, {"k": [1]}, {"distance_upper_bound": 0.1}])
def test_the_answer_is_the_trees(count: int, options: dict[str, object]) -> None:
    random = np.random.default_rng(0)
    tree, scattered = cKDTree(random.normal(size=(500, 3))), random.normal(size=(count, 3))
    one_place, in_a_row = np.zeros((count, 3)), np.sort(scattered, axis=0)
    for points in (scattered, in_a_row, one_place):
        for mine, its in zip(nearest_neighbours(tree, points, **options), tree.query(points, **options), strict=True):
            np.testing.assert_array_equal(mine, its)


@pytest.mark.skipif(os.name == "nt", reason="needs an interval timer")
def test_an_interrupt_leaves_no_thread_behind() -> None:
    finished = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, check=False)
    assert (finished.returncode, finished.stdout.strip()) == (0, "1"), finished.stderr
