"""The account of a diagnosis, for pages and terminals: who causes how many millimetres."""

from typing import TYPE_CHECKING

from jaxident import plot
from jaxident.diagnosis.account.account import (
    AFTER,
    BEFORE,
    CAMERA,
    DISCOVERED,
    REST,
    SLIP,
    START,
    UNNAMED,
    Account,
    Row,
)
from jaxident.report.page import PHONE, Figure, Section, Table
from jaxident.report.words import SPACE, angle, length, part, percent, plain_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAR = 30
"""Characters of a bar of text that stand for the whole error."""
NOISE = (CAMERA, START, SLIP)


def draw_account(account: Account, ax: "Axes | None" = None) -> "Axes":
    """The waterfall of an account, on some axes or on new ones."""
    shown = _shown(account)
    return plot.waterfall(
        {part(row.part): row.share for row in shown},
        {part(row.part): row.interval for row in shown},
        notes={part(row.part): f"{length(row.rms_position)}, {angle(row.rms_heading)}" for row in shown},
        noise=[part(name) for name in NOISE],
        rest=part(REST),
        ax=ax,
    )


def _shown(account: Account) -> list[Row]:
    """The rows of an account, without an empty one for what was discovered."""
    return [row for row in account.rows if row.part != DISCOVERED or row.share]


def account_section(account: Account, details: str = "") -> Section:
    """The waterfall, what else the verdict tells, and the waterfall as a table."""
    heading = "Who causes how much"
    shown = _shown(account)
    if not shown:
        return Section(heading, ["No stretch of the logs is left to judge by.", *([details] if details else [])])
    figure, ax = plot.figure(size=(PHONE, 0.9 + 0.28 * len(shown)))
    draw_account(account, ax)
    rows = [
        (part(row.part), length(row.rms_position), angle(row.rms_heading), percent(row.share),
         f"{percent(row.interval[0])} to {percent(row.interval[1])}")
        for row in shown
    ]  # fmt: skip
    table = Table(("part", "position", "heading", "share", f"90{SPACE}% interval"), rows, CAPTION)
    failed = f" {account.failed} more count in nothing: a model's prediction was not finite." if account.failed else ""
    text = TEXT.format(horizon=account.horizon, windows=account.windows)
    return Section(
        heading,
        [
            f"{text}{failed}",
            Figure(plot.image(figure), "Shares of the error by cause", PICTURE),
            *([details] if details else []),
            table,
            places_line(account),
        ],
    )


TEXT = (
    "The nominal model, its parameters refitted, predicts {horizon:.3g} s ahead from {windows} places in runs that "
    "took no part in any fit. Its mean squared error is split into what noise makes, what each named effect makes, "
    "and what is left."
)
PICTURE = (
    "Each bar begins where the one above ends; all together are the whole error. Grey: what no model can take away. "
    "Blue: named effects and what was discovered. Black: not explained. "
    f"Red lines: 90{SPACE}% intervals of where a bar ends."
)
CAPTION = (
    "Root mean squares; squares add up, millimetres do not. The share of an effect is what adding it to the model "
    "takes away, averaged over all orders of adding (Shapley value). A negative share: the part makes up for another."
)


PLACE_WORDS = {
    BEFORE: "before the wheel (command, motors, load)", AFTER: "after the wheel (ground, random slip)",
    CAMERA: "in the camera", START: "in the start", UNNAMED: "without a name",
}  # fmt: skip


def places_line(account: Account) -> str:
    """How much of the error lies before the wheel, after it, and elsewhere, in a sentence."""
    parts = [f"{percent(share)} {PLACE_WORDS[place]}" for place, share in account.places.items()]
    return f"Where the error lies: {', '.join(parts)}."


def account_lines(account: Account) -> list[str]:
    """The account as lines of text with bars."""
    shown = _shown(account)
    if not shown:
        return []
    names = [part(row.part) for row in shown]
    width = max(map(len, names))
    lines = [f"who causes the error {account.horizon:.3g} s ahead ({account.windows} starts in runs that no fit saw):"]
    for name, row in zip(names, shown, strict=True):
        bar = "#" * round(BAR * min(max(row.share, 0.0), 1.0))
        cells = f"{length(row.rms_position):>9} {angle(row.rms_heading):>10} {percent(row.share):>6}"
        lines.append(plain_text(f"  {name:<{width}} {cells}  {bar}").rstrip())
    return [*lines, plain_text(places_line(account))]
