"""Which messages do the tests raise? A pytest plugin that writes them down, and the count of what is missing.

    export PYTHONPATH=Testing/core PYTEST_ADDOPTS="-p raised_messages" ORGANPHYS_RAISED=/tmp/raised.txt
    make test
    python Testing/core/raised_messages.py /tmp/raised.txt [LEAST PERCENT]

Every error, notice and reason of a verdict that is made while the tests run is written as one line; it counts for the
message of the code whose words it has. Texts that are shown without any of these (the panel's hints) are not counted.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

RAISED: set[str] = set()


def pytest_configure(config: Any) -> None:
    """From now on every message is noted."""
    from organphys.ground.checks import InputError
    from organphys.ground.notices import Notice
    from organphys.pipeline.verdict import Reason

    for kind, index in ((InputError, 0), (Notice, 1), (Reason, 2)):
        _note(kind, index)


def pytest_sessionfinish(session: Any) -> None:
    if "ORGANPHYS_RAISED" in os.environ:
        path = os.environ["ORGANPHYS_RAISED"]
        with open(path, "a", encoding="utf-8", errors="backslashreplace") as file:  # names of files may be no text
            file.writelines(f"{text}\n" for text in sorted(RAISED))


def _note(kind: Any, index: int) -> None:
    original = kind.__init__

    def noting(self: Any, *arguments: Any, **named: Any) -> None:
        original(self, *arguments, **named)
        text = named["message"] if "message" in named else arguments[index] if len(arguments) > index else ""
        RAISED.add(" ".join(str(text).split()))

    kind.__init__ = noting


def main(file: str, least_percent: float = 0.0) -> int:
    """Print what no test raised; 1 if fewer than ``least_percent`` of the messages were raised."""
    from message_scan import all_messages
    from message_texts import GAP

    raised = set(Path(file).read_text(encoding="utf-8").splitlines())
    places = {m.text: m.place for m in all_messages() if m.raised}
    missing = []
    for text, place in places.items():
        pattern = re.compile(".*".join(re.escape(part) for part in text.split(GAP)), re.IGNORECASE)
        if not any(pattern.fullmatch(one) for one in raised):
            missing.append(f"{place}: {text}")
    print("\n".join(sorted(missing)))
    percent = 100 * (1 - len(missing) / len(places))
    print(f"{len(places) - len(missing)} of {len(places)} messages are raised by tests ({percent:.0f} %)")
    return int(percent < least_percent)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], *map(float, sys.argv[2:])))
