"""Brings the figures of README and method page up to date: ``python Testing/benchmarks/readme_figures.py``.

Their tables are copied, figure by figure, from RESULTS.md and RESULTS_PAPER.md, so that none can differ from what was
measured. Testing/core/test_docs_figures.py fails where this was forgotten.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGES = (ROOT / "README.md", ROOT / "Resources" / "Docs" / "method.md")
PAPER = "TRE aggressive"
KNOWN = ", unit known"  # how the ablation's settings with the stated unit end
NAMES = {"liver_scene_a": "liver, cluttered scene"}  # others: without the ending _a

Table = list[dict[str, str]]


def main() -> None:
    for page in PAGES:
        page.write_text(refreshed(page.read_text(encoding="utf-8")), encoding="utf-8")


def refreshed(page: str) -> str:
    """The page with what stands between its markers made anew."""
    for name, make in TABLES.items():
        between = re.compile(rf"(<!-- {name}: [^>]*-->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        page = between.sub(lambda found, make=make: f"{found[1]}{make()}{found[2]}", page)  # type: ignore[misc]
    return page


def accuracy() -> str:
    """Best similarity, OrganPhys and the paper's method, case by case."""
    ratios = table("RESULTS.md", "Registration against known truth", "oracle mm")
    after = {row["case"]: row["elastic"] for row in table("RESULTS.md", "Registration against known truth", "coarse")}
    paper = {row["case"]: row[PAPER] for row in table("RESULTS_PAPER.md", "The paper's method", "oracle mm")}
    head = ("case", "best similarity, mm", "OrganPhys, mm", "ratio", "ratio without landmarks", "ratio with the unit",
            "paper's method, mm")  # fmt: skip
    rows = []
    for row in ratios:
        case, ratio = row["case"], [row[f"ratio, {how}"] for how in ("landmarks", "no landmarks", "with the unit")]
        if case in after:
            rows.append([case_name(case), row["oracle mm"], after[case], *ratio, paper.get(case, "-")])
        else:  # mean and worst
            rows.append([case, "", "", *ratio, ""])
    return markdown(head, rows)


def ablation() -> str:
    """One setting changed at a time: mean and worst over the cases, without the unit and with it."""
    found = {row["setting"]: row for row in table("RESULTS.md", "Ablation of the elastic stage", "setting")}
    rows = []
    for setting, row in found.items():
        if not setting.endswith(KNOWN):
            known = found.get(setting + KNOWN, {"mean": "", "worst": ""})
            rows.append([setting, row["mean"], row["worst"], known["mean"], known["worst"]])
    return markdown(("setting", "mean TRE / best similarity", "worst", "unit known: mean", "worst"), rows)


def stress() -> str:
    """The default on harder inputs: mean and worst over the cases."""
    rows = table("RESULTS.md", "The default under stress", "setting")
    shown = [[row["setting"], row["mean"], row["worst"]] for row in rows if not row["setting"].startswith("default")]
    return markdown(("harder input", "mean TRE / best similarity", "worst"), shown)


def peers() -> str:
    """Every method once on all cases: mean and worst over them, and the time it takes."""
    part = "OrganPhys beside its peers"
    seconds = {row["method"]: row["processor s, mean"] for row in table("RESULTS.md", part, "processor s, mean")}
    rows = [
        [row["method"], row["mean ratio"].strip("*()"), row["worst ratio"].strip("*()"), seconds.get(row["method"], "")]
        for row in table("RESULTS.md", part, "mean ratio")
    ]
    rows = [[f"**{cell}**" for cell in row] if row[0] == "OrganPhys" else row for row in rows]
    return markdown(("method", "mean TRE / best similarity", "worst", "processor s"), rows)


TABLES: dict[str, Callable[[], str]] = {"accuracy": accuracy, "ablation": ablation, "stress": stress, "peers": peers}


def table(file: str, part: str, column: str) -> Table:
    """The first table that has ``column``, in the part of a results file whose title begins with ``part``."""
    parts = re.split(r"^# ", (HERE / file).read_text(encoding="utf-8"), flags=re.MULTILINE)
    text = next((one for one in parts if one.startswith(part)), None)
    if text is None:
        raise SystemExit(f"{file}: no part '{part}'; run its benchmark, or say here where these figures stand now")
    for block in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
        head, _, *rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block.splitlines()]
        if column in head:
            return [dict(zip(head, row, strict=True)) for row in rows]
    raise SystemExit(f"{file}: no table with a column '{column}' in the part '{part}'")


def case_name(case: str) -> str:
    return NAMES.get(case, case.removesuffix("_a"))


def markdown(head: tuple[str, ...], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n".replace("|  |", "| |") for cells in lines)


if __name__ == "__main__":
    main()
