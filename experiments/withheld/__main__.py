"""`python -m experiments.withheld COMMAND`: see README.md here."""

import argparse
import pathlib

from .draw import draw
from .sets import COUNTS


def main() -> None:
    """Read the command line and run one step of the protocol."""
    parser = argparse.ArgumentParser(prog="python -m experiments.withheld", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("draw", help="draw a set of cases")
    one.add_argument("--set", choices=COUNTS, required=True)
    one.add_argument("--seed", type=int, required=True)
    one.add_argument("--out", type=pathlib.Path, required=True)
    one.add_argument("--answers", type=pathlib.Path, required=True, help="a file outside OUT")
    options = parser.parse_args()
    draw(options.set, options.seed, options.out, options.answers)


if __name__ == "__main__":
    main()
