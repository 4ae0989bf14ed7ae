"""Do damaged files escape the readers? A fuzzer that follows the branches of the readers looks for such files.

    pip install atheris
    python -m experiments.fuzz_readers [--seconds 600] [--keep FOLDER]

The first byte of an input chooses the reader: log, model, study, commands or poses. The rest is the file's content. An
input escapes if anything but the program's own errors comes out, or if it takes longer than five seconds. The fuzzer
stops there, and FOLDER holds the input. `tests/sturdy` mutates files without a look at the code; this one keeps each
input that reaches a new branch, and mutates it further.
"""

import argparse
import contextlib
import json
import pathlib
import sys
import warnings

import atheris

with atheris.instrument_imports(include=["jaxident.files", "jaxident.columns", "jaxident.study"]):
    from jaxident.files.logs import read_log
    from jaxident.files.models import load_model, model_to_dict
    from jaxident.files.streams import read_commands, read_poses
    from jaxident.files.studies import read_study
    from jaxident.files.study_example import EXAMPLE
    from jaxident.study.dataset import describe

from jaxident.errors import InputError, WorkError
from jaxident.start import start_jax

LOG = "run,t,u_r,u_l,x,y,theta\n0,0,1,1,0,0,0\n0,0.1,1,-1,,,\n1,0,0.5,1,1e-3,2,3.1\n1,0.1,0,0,0,2,-3.1\n"
COMMANDS = "t,v,w\n0,0.1,0\n0.5,0.1,0.2\n0.5,0,0\n1,0.2,-0.2\n"
POSES = "t;qx;qy;qz;qw;x;y\n0;0;0;0;1;0;0\n0.2;0;0;0.6;0.8;1e3;2\n"
READERS = {
    "log.csv": read_log,
    "model.json": load_model,
    "study.toml": lambda path: describe(read_study(path)),
    "commands.csv": read_commands,
    "poses.csv": read_poses,
}
LONGEST_INPUT = 4096
"""Bytes: long enough for every branch of a reader, short enough for thousands of inputs a second."""


def seeds(folder: pathlib.Path) -> None:
    """Write one good file of each kind, which the fuzzer begins from."""
    texts = (LOG, json.dumps(model_to_dict(load_model("published"))), EXAMPLE, COMMANDS, POSES)
    for number, text in enumerate(texts):
        (folder / f"seed_{number}").write_bytes(bytes([number]) + text.encode()[: LONGEST_INPUT - 1])


def main() -> None:
    """Fuzz until the time is over or an input escapes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzzed"), metavar="FOLDER")
    options = parser.parse_args()
    start_jax()
    corpus, here = options.keep / "corpus", options.keep / "input"  # the fuzzer ends the process: no temporary folder
    corpus.mkdir(parents=True, exist_ok=True)
    here.mkdir(exist_ok=True)

    def feed(content: bytes) -> None:
        name, read = list(READERS.items())[(content[0] if content else 0) % len(READERS)]
        path = here / name
        path.write_bytes(content[1:])
        with warnings.catch_warnings(), contextlib.suppress(InputError, WorkError):
            warnings.simplefilter("ignore", UserWarning)  # the program's own
            read(path)

    seeds(corpus)
    limits = [f"-max_total_time={options.seconds}", f"-max_len={LONGEST_INPUT}", "-timeout=5", "-rss_limit_mb=2048"]
    atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={options.keep}/escaped_", str(corpus)], feed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
