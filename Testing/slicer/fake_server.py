"""A stand-in for the registration server that answers at once, or misbehaves as it is told. Not a test.

``--outcomes DIR``: the stages' outcomes, ready-made in subfolders; ``--at STAGE=WHAT``: crash, garbage, endless, hang
(deaf to cancel), slow (until cancelled), refused (bad input) in place of that stage's outcome.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import threading
import time
from pathlib import Path
from typing import Any

cancelled = threading.Event()


def say(**event: Any) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()


def misbehave(what: str, number: int) -> bool:
    """Whether there is still a proper answer to give."""
    if what == "crash":
        print("Fatal: no more memory", file=sys.stderr, flush=True)
        os._exit(3)
    elif what == "garbage":
        print("this is not JSON", flush=True)
    elif what == "endless":
        sys.stdout.write("x" * (2 << 20))
        sys.stdout.flush()
    elif what == "refused":
        say(id=number, event="failed", code="input", message="landmark 1 lies 80 mm from the organ; check it")
    elif what == "slow":
        return not waited(number)
    return what not in ("crash", "garbage", "endless", "refused", "hang")


def waited(number: int) -> bool:
    """Half a second of progress; True if it was cancelled."""
    for k in range(30):
        if cancelled.is_set():
            say(id=number, event="failed", code="cancelled", message="cancelled")
            return True
        say(id=number, event="progress", stage="elastic", fraction=k / 30)
        time.sleep(0.02)
    return False


def work(request: dict[str, Any], options: argparse.Namespace) -> None:
    number, do = request["id"], request["do"]
    stage, _, what = (options.at or "").partition("=")
    if not misbehave(what if do == stage else do, number):
        return
    outcome = f"outcome_{number}"
    if options.outcomes and (options.outcomes / do).is_dir():
        if do == "elastic":
            shutil.copy(options.outcomes / "surface.npy", options.folder / "surface_1.npy")
            say(id=number, event="surface", file="surface_1.npy", stage=do)
        shutil.copytree(options.outcomes / do, options.folder / outcome)
    say(id=number, event="done", outcome=outcome, echo=request)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--outcomes", type=Path)
    parser.add_argument("--at")
    parser.add_argument("--refuse", action="store_true")
    options = parser.parse_args()
    if options.refuse:
        sys.exit("ModuleNotFoundError: No module named 'scipy'")
    say(event="ready", organphys="0", file=__file__, pid=os.getpid())
    for line in sys.stdin:
        request = json.loads(line)
        if request["do"] == "quit":
            break
        if request["do"] == "cancel":
            cancelled.set()
        else:
            cancelled.clear()
            threading.Thread(target=work, args=(request, options), daemon=True).start()


main()
