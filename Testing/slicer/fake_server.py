"""A stand-in for the registration server that answers at once, or misbehaves on request. Not a test."""

import json
import os
import sys
import threading
import time


def say(**event: object) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()


cancelled = threading.Event()


def work(request: dict) -> None:
    number, do = request["id"], request["do"]
    if do == "crash":
        print("Fatal: no more memory", file=sys.stderr, flush=True)
        os._exit(3)
    if do == "garbage":
        print("this is not JSON", flush=True)
        return
    if do == "endless":
        sys.stdout.write("x" * (2 << 20))
        sys.stdout.flush()
        return
    if do == "hang":  # deaf to cancel
        return
    if do == "slow":
        for k in range(30):
            if cancelled.is_set():
                say(id=number, event="failed", code="cancelled", message="cancelled")
                return
            say(id=number, event="progress", stage="elastic", fraction=k / 30)
            time.sleep(0.02)
    say(id=number, event="done", echo=request)


def main() -> None:
    if "--refuse" in sys.argv:
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
            threading.Thread(target=work, args=(request,), daemon=True).start()


main()
