"""All questions that a small study answers, on one page: each with its answer first, then its picture.

    python -m experiments.gallery --out gallery

Writes gallery/index.html. Answers are computed, not written down: with another `--seeds` they may differ.
"""

import argparse
import pathlib
from collections.abc import Callable

import jaxident as ji
from experiments.gallery import estimators, inputs, paper, robots
from experiments.gallery.answer import Answer
from jaxident.report.page import Page, Section, write_page

QUESTIONS: tuple[Callable[[int], Answer], ...] = (
    *(estimators.bears_noise, estimators.setup_time, estimators.forgetting),
    *(inputs.excitation, inputs.sample_period, inputs.sensors),
    *(robots.smallest_effect, robots.asymmetry, paper.one_draw),
)
"""Every question is the docstring of the function that answers it, given the number of noise seeds."""


def main() -> None:
    """Answer every question and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("gallery"))
    parser.add_argument("--seeds", type=int, default=40)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    sections = []
    for question in QUESTIONS:
        answer = question(options.seeds)
        sections.append(Section(question.__doc__ or "", [answer.sentence, answer.picture]))
        print(f"{question.__doc__}\n  {answer.sentence}", flush=True)
    lead = "Each question has its answer as the first sentence; the picture below shows where it comes from."
    write_page(Page("What small studies tell", lead, sections, f"{options.seeds} seeds"), options.out / "index.html")


if __name__ == "__main__":
    ji.start_jax()
    main()
