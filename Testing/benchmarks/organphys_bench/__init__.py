"""OrganPhys beside its peers: methods x cases, measured against known truth, as JSON and one HTML page.

problem (what a method is given) -> peers (one thin adapter each, fem for the finite elements) -> figures (TRE,
distances, deformation) -> runs (a process each, resumable) -> report. The scripts beside this package that read cases,
make them harder and keep RESULTS.md are imported by name: their folder joins the path here.
"""

import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[1]

if str(SCRIPTS) not in sys.path:
    sys.path.append(str(SCRIPTS))
