"""Do all notebooks run, and how long does each take?

    python -m experiments.run_notebooks [--keep] [NAME ...]

Executes the notebooks of `experiments/notebooks` (extra `notebook`) where they lie. Tells the seconds of each: of the
clock, and of the processor. A cell that fails ends the program with exit code 1. With `--keep` their outputs are
stored: texts and pictures, the last picture also at the top; nothing that changes from run to run.
"""

import argparse
import pathlib
import resource
import time

import nbformat
from nbclient import NotebookClient

FOLDER = pathlib.Path(__file__).resolve().parent / "notebooks"
KEPT = ("image/png", "text/plain")
WIDGET = "application/vnd.jupyter.widget-view+json"
"""A slider, which nothing but a kernel moves."""
PICTURE = "last.png"
LONGEST = 1200.0
"""Seconds that one cell may take on a busy machine."""


def execute(path: pathlib.Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of a fresh kernel. CellExecutionError where a cell fails."""
    book = nbformat.read(path, as_version=4)
    (path.parent / "out").mkdir(exist_ok=True)
    place = {"metadata": {"path": path.parent}}
    NotebookClient(book, timeout=LONGEST, kernel_name="python3", resources=place).execute()
    return book


def keep(book: nbformat.NotebookNode, path: pathlib.Path) -> None:
    """Write a notebook back with its texts and pictures, the last picture at the top."""
    pictures = []
    for cell in book.cells:
        cell.metadata = {}
        if "outputs" in cell:
            told = [one for one in cell.outputs if one.get("name") != "stderr"]
            cell.outputs = [one for one in told if WIDGET not in one.get("data", {})]
        for output in cell.get("outputs", []):
            if "data" in output:
                output["data"] = {kind: output["data"][kind] for kind in KEPT if kind in output["data"]}
                output["metadata"] = {}
                pictures += [output["data"]["image/png"]] if "image/png" in output["data"] else []
    if f"attachment:{PICTURE}" in book.cells[0].source:
        book.cells[0].attachments = {PICTURE: {"image/png": pictures[-1]}}
    book.metadata = {"kernelspec": book.metadata.kernelspec, "language_info": {"name": "python"}}
    nbformat.write(book, path)


def main() -> None:
    """Execute the notebooks named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--keep", action="store_true", help="store the outputs in the notebooks")
    options = parser.parse_args()
    for name in options.names or sorted(path.stem for path in FOLDER.glob("*.ipynb")):
        path = FOLDER / f"{name}.ipynb"
        began, used = time.perf_counter(), _processor_seconds()
        book = execute(path)
        if options.keep:
            keep(book, path)
        print(f"{name}: {time.perf_counter() - began:.0f} s, {_processor_seconds() - used:.0f} s of the processor")


def _processor_seconds() -> float:
    """Of all kernels that have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


if __name__ == "__main__":
    main()
