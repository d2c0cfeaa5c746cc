"""The part of RESULTS.md that the scaling benchmark writes: a table an axis, each measurement with its own date."""

from __future__ import annotations

from measured import machine
from scaling_plot import exponents, peak_memory
from scaling_target import target_lines

LINEAR = 1.05  # larger exponents are named
REASONS = {
    "elastic steps": "a step takes more evaluations with more handles; for one of them see the row below it",
    "error radii": "a quadratic form in the 4 H coordinates of every point; H is a setting of the method (32), not a "
    "size of the input",
    "select": "the system hands out the memory; called again in the same process it takes a half and is linear",
}


def report(records: list[dict], axes: list[str]) -> str:
    """Markdown; ``records``: lines of scaling.jsonl."""
    rows_of = {axis: sorted((r for r in records if r["axis"] == axis), key=lambda r: r["value"]) for axis in axes}
    rows_of = {axis: rows for axis, rows in rows_of.items() if rows}
    lines = [
        "# Scaling",
        "",
        "Processor seconds of every stage (one thread for BLAS), in a process of its own for each column, and peak "
        "memory of that process (MB, pages of the mapped splat file included). Exponent: slope of log seconds over log "
        "size, fitted to the last three columns; - where the stage takes under 0.05 s. Splats of the axis gaussians "
        "have spherical harmonics of degree 3 (248 bytes each). Plots: `scaling.png`; measurements: `scaling.jsonl`.",
        "",
        "- command: `OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/scaling.py [AXIS] [--fresh]`",
        f"- machine: {machine()}; date and commit below each table",
        *target_lines(records),
        "",
        *superlinear_lines(rows_of),
    ]
    for axis, rows in rows_of.items():
        lines += ["", *table(axis, rows), "", *made_lines(axis, rows)]
    return "\n".join(lines)


def superlinear_lines(rows_of: dict[str, list[dict]]) -> list[str]:
    """What grows faster than linearly, with the reason where one is known."""
    found = [
        f"- {name} over {axis}: exponent {slope:.2f}{_reason(name)}"
        for axis, rows in rows_of.items()
        for name, slope in exponents(rows).items()
        if slope is not None and slope > LINEAR
    ]
    return [f"Exponents above {LINEAR}:", "", *found] if found else [f"No exponent is above {LINEAR}."]


def _reason(name: str) -> str:
    return next((f" ({reason})" for part, reason in REASONS.items() if part in name), "")


def made_lines(axis: str, rows: list[dict]) -> list[str]:
    """When each column was measured."""
    groups: dict[str, list[str]] = {}
    for row in rows:
        groups.setdefault(row["made"], []).append(f"{row['value']:,}")
    if len(groups) == 1:
        return [f"Measured: {made}." for made in groups]
    return ["Measured: " + "; ".join(f"{axis} {', '.join(values)}: {made}" for made, values in groups.items()) + "."]


def table(axis: str, rows: list[dict]) -> list[str]:
    """Rows of Markdown: stages by size."""
    head = [f"{row['value']:,}" for row in rows]
    lines = ["| " + " | ".join([axis, *head, "exponent"]) + " |", "|---" * (len(head) + 2) + "|"]
    for name, slope in exponents(rows).items():
        cells = [f"{row['stages'][name]['processor_s']:.2f}" if name in row["stages"] else "" for row in rows]
        lines.append(_line(name, cells, "-" if slope is None else f"{round(slope, 2) + 0.0:.2f}"))
        if "elastic steps" in name:
            lines.append(evaluation_line(name, rows))
    for name, follows in (("peak memory, MB", False), ("peak memory of what follows, MB", True)):
        memory = peak_memory(rows, follows)
        if any(memory):
            lines.append(_line(name, [f"{peak:.0f}" for peak in memory], ""))
    return lines


def evaluation_line(stage: str, rows: list[dict]) -> str:
    """One evaluation of the energy in the elastic steps, matches counted with it: ms."""
    seconds = [row["stages"][stage]["processor_s"] / row["facts"]["evaluations"] for row in rows]
    one = [{"value": row["value"], "stages": {"one": {"processor_s": s}}} for row, s in zip(rows, seconds, strict=True)]
    slope = exponents(one, least_s=0.0)["one"]
    return _line("of these, one evaluation, ms", [f"{1e3 * s:.1f}" for s in seconds], f"{slope:.2f}")


def _line(name: str, cells: list[str], exponent: str) -> str:
    return "| " + " | ".join([name, *cells, exponent]) + " |"
