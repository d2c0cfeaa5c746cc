"""A registration session in a process of its own, kept warm between runs: JSON lines on stdin and stdout.

    python -m organphys.pipeline.session_server --folder DIR

Large arrays travel as files in DIR. Requests and their replies, each with the request's "id":
  {"id": 1, "do": "load", "case": FILE}                   a case of ``outcome_files.save_case`` in DIR
  {"id": 2, "do": "coarse"|"rigid"|"elastic", "start": M}  M: T_scene_ct set by hand, 4 x 4, or null (not for coarse)
  {"id": 5, "do": "prepare"}                               gets to know more poses for "update": some seconds
  {"id": 6, "do": "update", "landmarks": L, "names": N, "stiffness": S}   registers again with what is named changed:
                     L (l, 3) RAS mm or null, S a preset or a number; the outcome is the elastic stage's surface alone
  {"id": 7, "do": "settle"}                                the whole outcome after "update"
  {"id": 8, "do": "follow", "splats": S, "fps": F}         follows the loaded case's organ through a sequence of splats;
                     done names a folder ("sequence", see follow_request.py)
  {"id": 3, "do": "grids"}                                 the elastic outcome with its displacement grids
  {"id": 4, "do": "report", "folder": PATH}                the files of ``write_outputs``
  {"do": "cancel"}                                         ends the requests sent before it
  {"do": "quit"}                                           as does the end of stdin
Events: "progress" (stage, fraction), "surface" (file with vertices (Nv, 3) in scene units, stage), "done" (outcome: a
folder in DIR for ``load_outcome``, where there is one) and "failed" (code: input, cancelled, internal; message: one
line). The first line says {"event": "ready", "organphys": version, "file": path, "pid": number}.
"""

from __future__ import annotations

import argparse
import os
import signal
import threading
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .. import __file__ as package_file
from .. import __version__
from ..ground.checks import InputError
from ..ground.progress import Cancelled
from .server_channel import Channel, Request


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until quit or the end of stdin; 0."""
    parser = argparse.ArgumentParser(prog="python -m organphys.pipeline.session_server")
    parser.add_argument("--folder", required=True, type=Path, help="folder shared with the client")
    folder: Path = parser.parse_args(argv).folder
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the client's terminal is the client's to handle
    serve(Channel.of_this_process(), folder)
    return 0


def serve(channel: Channel, folder: Path) -> None:
    """Answer the channel's requests in their order."""
    channel.tell(event="ready", organphys=__version__, file=package_file, pid=os.getpid())
    from .server_requests import Requests, warm_up  # loads readers and solvers while the client prepares its case

    warm_up()
    requests = Requests(channel, folder)
    while (request := channel.next()) is not None:
        answer(channel, requests.run, request)


def answer(channel: Channel, run: Callable[[Request], dict[str, Any]], request: Request) -> None:
    """Run one request; every way it can end is a reply."""
    number = request.fields.get("id")
    try:
        channel.tell(id=number, event="done", **run(request))
    except Cancelled:
        channel.tell(id=number, event="failed", code="cancelled", message="the registration was cancelled")
    except InputError as error:
        channel.tell(id=number, event="failed", code="input", message=" ".join(str(error).split()))
    except MemoryError:
        message = "not enough memory: crop the segmentation or the splat and try again"
        channel.tell(id=number, event="failed", code="input", message=message)
    except Exception as error:  # the server must outlive any error of one run
        traceback.print_exc()
        message = " ".join(f"{type(error).__name__}: {error}".split())
        channel.tell(id=number, event="failed", code="internal", message=message)


if __name__ == "__main__":
    raise SystemExit(main())
