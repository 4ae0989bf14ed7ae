"""What a diagnosis discovered, in words and as a picture: laws that are in no catalogue."""

import dataclasses

from matplotlib.patches import Circle

from jaxident import plot
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.discovery.forms import PATCH, beyond
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.laws.not_shown import FEWEST, NotShown
from jaxident.effects.law_kinds import ANGLE, CHANGES, DIRECTIONS, MOST_LAWS, SENSE, SIGNAL_WORDS
from jaxident.report.page import Figure, Section, Table
from jaxident.report.words import number, percent, plain, together

TIMES_WORDS = {
    "1": "", "v": "speed times ", "w": "turn rate times ", "own push": "push of that wheel times ",
    "own speed": "speed of that wheel times ",
    "cos heading": "the heading's cosine times ", "sin heading": "the heading's sine times ",
    "v cos heading": "speed along x times ", "v sin heading": "speed along y times ",
    **{name: f"change of that wheel's command over {tau:g} s times " for name, tau in CHANGES.items()},
    **dict.fromkeys(DIRECTIONS, "direction times "),
    SENSE: "direction in which that wheel's command last changed times ",
}  # fmt: skip
SEEN = (
    "These laws are in no catalogue. They were found on the runs that fit, and runs that took no part in that confirm "
    "them. Each adds a curve of one signal, or a surface of two, at one place. The corrected model has them, and "
    "`predict`, `simulate`, `plan` and studies run them. Beyond the signals that these logs show, a law stays at its "
    "last value. That is a guess: `predict` warns where it is made, and is less sure there."
)
OF_WHEEL = (
    "No camera sees how a wheel stands, and each run begins at another angle. The angle of 0 is where the law is "
    "largest. `predict` finds the angle in the poses before each start, and is less sure where there are few. "
    "`simulate` draws one."
)
OF_CURVE = "Line: the curve; shade: two standard deviations; grey bars: how often the robot was there. "
OF_MAP = (
    "Colour: the surface; dots: its knots, larger where the robot was more often, hollow where the value is less than "
    "two standard deviations from 0; dashed: the circle that it looks like, if any. "
)
REST = "What the nominal model could have as well (in its rates and gains) is taken away; its doubt is not."
NOT_SHOWN = "What these logs cannot show"
"""The title where nothing was discovered, and some laws were not looked for."""
HEIGHT, MAP_HEIGHT = 2.1, 4.2
"""Of the picture of a curve and of a map [in]."""


def sentence(shown: Shown) -> str:
    """One law in a sentence."""
    law = shown.law
    return f"to the {law.acts_on} comes {_words(shown.kind)}{_each_turn(shown)}{_like(shown)}"


def _each_turn(shown: Shown) -> str:
    """How far a wheel rolls from turn to turn of what is on it."""
    period = shown.law.period
    return "" if period is None else f", once every {number(1000.0 * period)} mm of its way"


def _like(shown: Shown) -> str:
    """The closed form, if one explains the curve."""
    form = shown.form
    if form is None:
        return ""
    values = ", ".join(f"{key} = {number(value)}" for key, value in form.parameters.items())
    law = shown.law
    named = f"s = {law.signal}, " + (f"t = {law.second_signal}, " if law.second_signal else "")
    return f" ({percent(form.part_explained)} of it is {form.form} with {'' if 'x0' in values else named}{values})"


def discovered(found: Diagnosis) -> list[Section]:
    """The sections on laws of the model that was given, on discovered ones, and on those that were not looked for; none
    where there is nothing of that."""
    given, hidden = given_laws(found), not_looked_for(found.not_shown)
    before = [Section("Laws that the given model has", given)] if given else []
    if not found.discovered:
        return [*before, Section(NOT_SHOWN, hidden)] if hidden else before
    rows = [
        (shown.law.acts_on, f"{_words(shown.kind)}{_each_turn(shown)}",
         percent(shown.share), f"{shown.p_value:.2g}", _form(shown))
        for shown in found.discovered
    ]  # fmt: skip
    table = Table(("acts on", "what is added", "share of the error", "probability by chance", "looks like"), rows)
    pictures = [_picture(shown) for shown in found.discovered]
    wheels = [OF_WHEEL] if any(shown.law.signal == ANGLE for shown in found.discovered) else []
    return [*before, Section("What was discovered", [SEEN, *wheels, *pictures, table, *_other_forms(found),
                                                       *_alike(found), *hidden])]  # fmt: skip


def given_laws(found: Diagnosis) -> list[str]:
    """The laws that the given model has: what was done with them, and a line each."""
    laws = found.nominal_model.discovered
    if not laws:
        return []
    full = f" A model has room for {MOST_LAWS}: no more were looked for." if len(laws) == MOST_LAWS else ""
    words = [_words(Kind(law.acts_on, law.times, law.signal, law.second_signal)) for law in laws]
    return [f"The model that was given has laws in no catalogue. Every fit obeys them as they are, and so does the "
            f"corrected model: they are no gap.{full}",
            *(f"To the {law.acts_on} comes {told}." for law, told in zip(laws, words, strict=True))]  # fmt: skip


def not_looked_for(hidden: NotShown) -> list[str]:
    """Laws that were not looked for, and what would show them."""
    if hidden.windows is not None:
        return [f"No law beyond the catalogue was looked for. The runs that fit give {hidden.windows} stretches, and a "
                f"curve needs {FEWEST}. Longer or more runs would do."]  # fmt: skip
    lines = [
        f"No law by the {SIGNAL_WORDS[name]} was looked for: in these logs it hardly varies." for name in hidden.still
    ]
    for pair in hidden.together:
        one, other = (SIGNAL_WORDS[name] for name in pair)
        lines.append(f"No law by the {one} or the {other} was looked for: in these logs each follows from the other. A "
                     "run that tells them apart would show which of them counts.")  # fmt: skip
    return lines


def _picture(shown: Shown) -> Figure:
    """The curve or the map of one law."""
    law = shown.law
    surface = bool(law.second_signal)
    figure, ax = plot.figure(size=(6.3, MAP_HEIGHT if surface else HEIGHT))
    told = dataclasses.replace(law, value=beyond(law, shown.density))
    plot.discovered(told, shown.density, ax=ax)
    if shown.form is not None and shown.form.form == PATCH:
        at = shown.form.parameters
        ax.add_patch(Circle((at["x0"], at["y0"]), at["radius"], fill=False, linestyle="--"))
    caption = (OF_MAP if surface else OF_CURVE) + REST
    return Figure(plot.image(figure), _place(shown.kind), caption)


def _other_forms(found: Diagnosis) -> list[str]:
    """A line for each law that may be an effect of the catalogue in another form."""
    lines = []
    for shown in found.discovered:
        if shown.kind.effects:
            told = together(map(plain, shown.kind.effects), "or")
            lines.append(f"{_place(shown.kind)}: this may be {told} in another form than the catalogue's.")
    return lines


def _alike(found: Diagnosis) -> list[str]:
    """A line for each law that has others like it."""
    return [
        f"{_place(shown.kind)}: nearly as much would be explained by "
        f"{together((f'{kind.acts_on}, {_words(kind)}' for kind in shown.alike), 'or by')}."
        for shown in found.discovered
        if shown.alike
    ]


def _place(kind: Kind) -> str:
    """Where a law acts and what is added, at the beginning of a sentence."""
    return f"{kind.acts_on[0].upper()}{kind.acts_on[1:]}, {_words(kind)}"


def _words(kind: Kind) -> str:
    shape = f"a curve of the {SIGNAL_WORDS[kind.signal]}"
    if (kind.signal, kind.second_signal) == ("x", "y"):
        shape = "a map of the floor"
    elif kind.second_signal:
        shape = f"a surface of the {SIGNAL_WORDS[kind.signal]} and the {SIGNAL_WORDS[kind.second_signal]}"
    return f"{TIMES_WORDS[kind.times]}{shape}"


def _form(shown: Shown) -> str:
    form = shown.form
    return "no simple form" if form is None else f"{form.form} ({percent(form.part_explained)})"
