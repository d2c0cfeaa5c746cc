"""The campaign's part of RESULTS.md: faults by kind, what became of them, failures found and fixed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from injected import KINDS
from results_file import machine_lines, write_part

TITLE = "# Faults"
FIXED = (
    "kill -9 while results were moved into a folder left some of the new files beside some of the older ones, or only "
    "some of the new ones; a new folder now appears in one step, and in one that was there older files go first and "
    "the next run finishes the move",
    "kill -9 left hidden temporary files and folders that no later run removed",
    "two runs into one folder at once both ran to the end and mixed their files; the second is now refused at once",
    "a .vtp cut short by a full disk was taken for written, because VTK's writer says nothing; in a folder of results "
    "VTK's own words came on stderr beside the one line",
    "Ctrl-C while a hidden folder was removed left it there beside whole results",
    "a disk that filled up in numpy's, Pillow's, matplotlib's or plyfile's writing gave a traceback, not one line",
    "an output folder made for a file that could then not be written stayed behind, empty",
    "Ctrl-C while the last words were printed said that nothing was written although all was",
    "Slicer: every run stayed in memory for good (0.28 MB each for the tests' small organ), held by its timer's "
    "connection",
)


def write_results(path: Path, state: dict, trials: int, scene_trials: int) -> None:
    """Put the part of this campaign into RESULTS.md."""
    rows, scenes = list(state["commands"].values()), list(state["scenes"].values())
    failures = [row for row in [*rows, *scenes] if row["failure"]]
    lines = [
        TITLE,
        "",
        *machine_lines("make faults, or Testing/faults/campaign.py with other numbers of trials"),
        "",
        f"{len(rows)} trials of `register`, `simulate` and `export` (one file, and a folder of frames): a child "
        "meets a fault at a random moment of its writing, into a new place or over older results; in every tenth trial "
        "the whole command runs, computing included. Judged are exit code, stderr (one line), files (each is read "
        "again), and what a second run without a fault makes of what is left. Older: the older results are "
        "untouched, or nothing is there where nothing was. New: all new results are there. Between: killed while files "
        "moved into a folder that was there, or the disk "
        "refused the moves; the second run finished it. Lost: results broken, mixed or gone, or a "
        "second run that fails or leaves debris. The fixes below were made while the campaign ran; what had failed was "
        "tried again with the final code, what had passed was not.",
        "",
        "| fault | what | trials | killed | one line | stopped | done | died | older | new | between | lost |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
        *(_row(kind, [row for row in rows if row["kind"] == kind]) for kind in KINDS),
        _row("all", rows),
        "",
        f"{_kills(rows, 'kill')} of these trials were killed with signal 9, {_kills(rows, 'half')} in the middle of "
        "a write.",
        "",
        *_scenes(scenes, state["growth"]),
        *_big(state["big"]),
        f"Failures open: {len(failures)}.",
        "",
        *(f"- {row.get('command', row.get('module'))}: {row['failure'][:300]}" for row in failures),
        *([""] if failures else []),
        "Found and fixed:",
        "",
        *(f"- {text}" for text in FIXED),
        "",
        *_short(len(rows), trials, len(scenes), scene_trials),
    ]
    write_part(path, "\n".join(lines) + "\n")


def _row(kind: str, rows: list[dict]) -> str:
    ended, left = Counter(row["ended"] for row in rows), Counter(row["left"] for row in rows)
    figures = [ended[name] for name in ("killed", "told", "stopped", "done", "died")]
    figures += [left["older"] + left["absent"], left["new"], left["between"], sum(bool(row["failure"]) for row in rows)]
    return f"| {kind} | {KINDS.get(kind, '')} | {len(rows)} | " + " | ".join(str(n) for n in figures) + " |"


def _kills(rows: list[dict], kind: str) -> int:
    return sum(row["ended"] == "killed" and row["kind"].startswith(kind) for row in rows)


def _scenes(scenes: list[dict], growth: dict) -> list[str]:
    if not scenes:
        return ["The Slicer modules were not tried.", ""]
    acts = Counter((trial["module"], trial["act"].split()[0]) for trial in scenes)
    told = ", ".join(f"{module} {act} {count}" for (module, act), count in sorted(acts.items()))
    observers = [trial["observers"] for trial in scenes]
    lines = [
        f"Slicer modules, headless host: {len(scenes)} runs and simulations, cancelled, robbed of a node, or with "
        f"their scene closed at a random moment ({told}). Nodes left over, or errors in callbacks: in "
        f"{sum(bool(trial['failure']) for trial in scenes)}. Observers of the scene after a trial: at most "
        f"{max(observers)}, after the last {observers[-1]}. Runs and simulations still in memory: at most "
        f"{max(sum(trial['held']) for trial in scenes)}.",
        "",
    ]
    memory = growth.get("memory_mb", [])
    if memory:
        resident, allocated = zip(*memory, strict=True)
        steps = range(0, len(memory), max(1, len(memory) // 10))
        after = ", ".join(f"{allocated[k]:.2f} ({k + 1})" for k in steps)
        step = 1024 * (allocated[-1] - allocated[9]) / (len(memory) - 10)
        lines += [
            f"Memory over {len(memory)} whole runs, each in a new scene. Allocated and not freed (glibc's mallinfo2), "
            f"MB after run: {after}; at the end {allocated[-1]:.2f}, that is {step:.0f} kB a run. Resident, with what "
            f"the allocator keeps: {resident[0]:.0f} MB after the first, at most {max(resident):.0f} MB, in the end "
            f"{resident[-1]:.0f} MB.",
            "",
        ]
    return lines


def _big(big: dict) -> list[str]:
    return [line for name, text in sorted(big.items()) for line in (f"Big input, {name}: {text}", "")]


def _short(rows: int, trials: int, scenes: int, scene_trials: int) -> list[str]:
    short = [f"{rows} of {trials} trials of the commands"] if rows < trials else []
    short += [f"{scenes} of {scene_trials} trials of the Slicer modules"] if scenes < scene_trials else []
    words = "Not reached: " + " and ".join(short) + "; `make faults` goes on." if short else ""
    never = "Not tried at all: a power failure (files are not synchronised before they are renamed), Windows, macOS."
    return [" ".join([words, never]).strip()]
