"""Tables of the documentation from stored outputs of proofs and benchmarks."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tests.support.stored_output import newest
from tests.tables.markdown import code_block, markdown_table

FIGURE = re.compile(
    r"(?P<trial>.{14})(?P<quantity>.+?) +(?P<value>-?\d+\.\d{3})  (?P<expected>.+?)"
    r" \((?P<runs>\d+)\)(?P<missed>  MISSED.*)?$"
)
"""A line of `tests.proofs.figure.Figure`."""
SITUATION = re.compile(
    r"(?P<name>.{46})\s*(?:\d+ )?\s*(?P<accepted>\d+%) +(?P<coverage>[\d.]+%)(?P<rest>( +([\d.]+%|-))*)"
)
SPECKLE_WIDTHS_PX = ("0.75", "1.50")
SPEED_ROWS = {
    "flat": "flat",
    "incline": "incline",
    "cylinder": "cylinder",
    "flat at 3 m": "flat at 3 m, overlapping spots",
    "flat, one not seen": "flat, one laser without a spot",
    "worst": "ambiguous, then each laser alone (5 or 9 pairs)",
}
"""Scenes of the benchmark, and how the documentation calls them."""


@dataclass(frozen=True)
class ProofFigure:
    """One figure of the proof of the trials."""

    trial: str
    quantity: str
    value: float
    expected: str
    runs: str
    is_missed: bool

    @property
    def head(self) -> str:
        """Beginning of the quantity that figures share which differ in a place or a number alone."""
        return re.split(r", \d| at \d", self.quantity)[0]


def shapes(heading: str) -> str:
    """A table of `tests.proofs.shapes`, which are in Markdown."""
    return "\n".join(newest("shapes").section(heading))


def campaigns() -> str:
    """Speed of a campaign, as printed by `tests.benchmarks.campaigns`."""
    return code_block("\n".join(newest("campaigns").lines))


def campaign_archive() -> str:
    """Time of an archive that is fitted again, as printed by `tests.benchmarks.campaigns`."""
    return code_block("\n".join(newest("campaign-archive").lines[2:]))


def campaign_kills() -> str:
    """Results of a campaign with and without kills, as printed by `tests.crash.campaign_long`."""
    return code_block("\n".join(newest("campaign-kills").lines))


def speed() -> str:
    """Times of a reading: `make bench`."""
    rows = ranging_times()
    heading = ("", "one line", "p99", "readings/s", "both lines", "p99", "readings/s")
    return markdown_table(
        heading,
        [(name, *rows["horizontal", key], *rows["both lines", key]) for key, name in SPEED_ROWS.items()],
    )


def ranging_times() -> dict[tuple[str, str], tuple[str, str, str]]:
    """By lines and scene of the benchmark: processor time and 99th percentile (us), readings/s."""
    rows = {}
    for line in newest("ranging").lines:
        if found := re.match(r" *(horizontal|both lines), (.+?)((?: +[\d.]+){6})  ", line):
            _, p99, cpu, per_second, *_ = found[3].split()
            rows[found[1], found[2]] = (cpu, p99, per_second)
    return rows


def speckle() -> str:
    """Centres in speckle, single spots: `python -m tests.benchmarks.speckle`."""
    rows = []
    for line in newest("speckle").lines:
        cells = line.split()
        if len(cells) == 11 and cells[0] == "1" and cells[1] in SPECKLE_WIDTHS_PX:
            _, width, peak, rms, repeats, stated, shared, z_single, z_mean, inside, _ = cells
            z = f"{float(z_single):.2f}, {float(z_mean):.2f}"
            rows.append((f"{float(width):g}", peak, rms, repeats, stated, shared, z, inside))
    heading = ("width px", "peak DN", "rms px", "repeats px", "stated px", "speckle px", "z", "within 95 %")
    return markdown_table(heading, rows, numbers_from=0)


def situations() -> str:
    """Wrong rig files and data: `python -m tests.proofs.situations`."""
    rows = []
    for line in newest("situations").lines:
        if found := SITUATION.match(line):
            worst, named, _, best = _cells(found["rest"])
            cells = (found["accepted"], found["coverage"], worst, named, best)
            rows.append((found["name"].strip(), *(cell.replace("%", " %") for cell in cells)))
    return markdown_table(("situation", "accepted", "coverage", "worst", "cause named", "best"), rows)


def _cells(rest: str) -> Sequence[str]:
    """Cells worst, named, silent, best; a row of few calibrations has the second alone."""
    cells = rest.split()
    return cells if len(cells) == 4 else ("-", cells[0], "-", "-")


def validation() -> str:
    """False alarms of the checks of a fit: `python -m tests.proofs.validation`."""
    row = re.compile(r"  (.+?) +(\d+) +([\d.]+ \+- [\d.]+ %) +stated: (.+)$")
    rows = [found.groups() for line in newest("validation").lines if (found := row.match(line))]
    return markdown_table(("of 2000 sound fits", "fits", "share", "stated"), rows)


def trials() -> str:
    """Statistics of the trials, without the changes that a verification finds.

    Figures that differ in a place or a number alone are one row.
    """
    rows: dict[tuple[str, ...], list[ProofFigure]] = {}
    for one in proof_figures():
        if not _is_about_a_change(one):
            rows.setdefault((one.trial, one.head, one.expected, one.runs), []).append(one)
    texts, previous = [], ""
    for (trial, head, expected, runs), figures in rows.items():
        quantity = figures[0].quantity if len(figures) == 1 else f"{head}, {len(figures)} cases"
        texts.append((trial if trial != previous else "", quantity, _found(figures), expected, runs))
        previous = trial
    return markdown_table(("trial", "figure", "found", "expected", "runs"), texts, numbers_from=2)


def verification() -> str:
    """Changes of a sensor that a verification finds and names, per cent."""
    found = {one.quantity: f"{100 * one.value:.0f}" for one in proof_figures() if _is_about_a_change(one)}
    changes = [re.fullmatch("best test: (.+), other bench", quantity) for quantity in found]
    rows = [
        (
            change,
            *(
                found[f"{what}: {change}, {bench}"]
                for bench in ("other bench", "same bench")
                for what in ("refused", "best test", "named where refused")
            ),
        )
        for change in (match[1] for match in changes if match)
    ]
    heading = ("change since the calibration", "other bench: found", "best", "named")
    return markdown_table((*heading, "same bench: found", "best", "named"), rows)


def control_charts() -> str:
    """Run lengths of `workbench history`."""
    rows = [line.split(": ", 1) for line in newest("control_charts").lines if ": " in line]
    return markdown_table(("sensor", "result"), rows, numbers_from=2)


def scanning() -> str:
    """Coverage of calibrated scanning heads: `python -m tests.proofs.scanning`."""
    found = list(proof_figures("scanning"))
    rows = []
    for trial, one in (("parameter", "a parameter"), ("scan", "a point at one angle: x, range, deviation")):
        single = [figure.value for figure in found if figure.trial == trial]
        share = f"{100 * min(single):.1f} to {100 * max(single):.1f} %"
        rows.append((f"{one}: smallest and largest of {len(single)}", share))
    rows += [
        (figure.quantity + ", together" * (figure.trial == "together"), f"{100 * figure.value:.1f} %")
        for figure in found
        if figure.trial in ("together", "blind")
    ]
    (precision,) = (line for line in newest("scanning").lines if line.startswith("median sd"))
    rows.append(("median standard deviation of a range", precision.partition(": ")[2]))
    heads = max(int(figure.runs) for figure in found)
    return markdown_table((f"95 % intervals of {heads} heads", "contain the truth"), rows)


def colours() -> str:
    """Lasers of three colours: `python -m tests.proofs.colours`."""
    lines = [line.split(" | ") for line in newest("colours").lines if " | " in line]
    rows = [
        (
            way,
            pairs,
            rate,
            f"{100 * float(missing):.1f} %",
            f"{beside} of {count}",
            f"{100 * float(wrong):.1f} %",
            lost,
        )
        for way, _, pairs, rate, missing, wrong, count, beside, lost in lines[1:]
    ]
    heading = (
        "",
        "pairs a reading",
        "readings/s",
        "missing",
        "beside an object",
        "wrong",
        "ranges of lost beams",
    )
    return markdown_table(heading, rows)


def proof_figures(subject: str = "trials") -> Iterator[ProofFigure]:
    """All figures of the newest proof of a subject."""
    for line in newest(subject).lines:
        if found := FIGURE.match(line):
            yield ProofFigure(
                found["trial"].strip(),
                found["quantity"],
                float(found["value"]),
                found["expected"],
                found["runs"],
                bool(found["missed"]),
            )


def _is_about_a_change(one: ProofFigure) -> bool:
    return one.trial == "verify" and ": " in one.quantity


def _found(figures: Sequence[ProofFigure]) -> str:
    """Smallest and largest value, as they are printed."""
    values = sorted({one.value for one in figures})
    text = " to ".join(f"{value:.3f}" for value in dict.fromkeys((values[0], values[-1])))
    return f"{text}, missed" if any(one.is_missed for one in figures) else text


def worlds() -> str:
    """Missed obstacles and false stops of drawn drives: `tests.proofs.worlds`."""
    heading = ("rig", "world", "drives", "courses", "met", "missed: nearest", "closest", "sonar", "at most")
    more = ("not met, missed: nearest", "sonar", "false stops: nearest", "closest", "sonar", "least at rest")
    rows = []
    for line in newest("worlds").section("drives")[1:]:
        cells = line.split(" | ")
        cells[8], cells[-1] = f"{float(cells[8]):.1%}", f"{float(cells[-1]):.0f} mm"
        rows.append(cells)
    return markdown_table((*heading, *more), rows, numbers_from=2)


def worlds_errors() -> str:
    """Errors of lasers on faces in drawn drives."""
    rows = []
    for line in newest("worlds").section("errors of lasers")[1:]:
        rig, count, *shares = line.split(" | ")
        rows.append((rig, count, *(f"{float(share):.2%}" for share in shares)))
    return markdown_table(("rig", "readings", "median abs error", "wrong", "inside"), rows)


def layouts_view() -> str:
    """Fields of view of layouts: `tests.proofs.layouts`."""
    heading = ("rig", "lasers", "rows", "all in view from", "width", "height", "width, 3 m", "height, 3 m")
    rows = [line.split(" | ") for line in newest("layouts").section("field of view")[1:]]
    return markdown_table(heading, [[*row[:3], *(f"{mm} mm" for mm in row[3:])] for row in rows])


def layouts_resolution() -> str:
    """Resolution of layouts: `tests.proofs.layouts`."""
    names = [f"{which}, {mm} mm" for mm in (300, 1000, 3000) for which in ("one laser", "all")]
    rows = []
    for line in newest("layouts").section("resolution")[1:]:
        rig, *shares, per_px = line.split(" | ")
        rows.append((rig, *(f"{float(share):.3%}" for share in shares), f"{per_px} mm"))
    return markdown_table(("rig", *names, "per px"), rows)


def layouts_missed() -> str:
    """Thin rods that no beam of a layout meets: `tests.proofs.layouts`."""
    rows = []
    for line in newest("layouts").section("missed rods")[1:]:
        rig, *shares = line.split(" | ")
        rows.append((rig, *(f"{float(share):.1%}" for share in shares)))
    heading = ("rig", "vertical rods", "at most", "horizontal", "at most", "any direction", "at most")
    return markdown_table(heading, rows)
