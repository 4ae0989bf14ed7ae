"""The rules of the house, checked on the source: floors, sizes, docstrings, a light import."""

import ast
import graphlib
import pathlib
import subprocess
import sys

import pytest

PACKAGE = pathlib.Path(__file__).resolve().parents[1] / "jaxident"

GROUND = (
    "array_types",
    "errors",
    "numerics",
    "origin",
    "rules",
    "columns",
    "log",
    "start",
    "parallel",
    "programs",
    "progress",
)
FLOORS = (
    ("ground",),
    ("robot",),
    ("effects",),
    ("estimation",),
    ("diagnosis",),
    ("study",),
    ("files", "plot", "report", "export"),
    ("results",),
    ("entry",),
    ("",),  # the package's own file of public names
    ("cli",),
    ("__main__",),
)
SIDEWAYS = {("report", "plot"), ("report", "files"), ("plot", "files"), ("export", "files")}
"""Importer and imported within a floor: files, plot, report and export stand side by side."""
ROWS = {
    "estimation": ("increments", "poses", "ahead online uncertainty suspicions"),
    "diagnosis": ("motion", "noise", "fit", "laws", "preparation", "causes", "discovery", "account planning"),
}
"""Inner rooms of a room, in the order in which data walk through them; its own files stand behind them all."""
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
UPSTAIRS = 6
"""The lowest floor that may print and draw."""

FILE_LINES, FUNCTION_LINES = 250, 40
HEAVY = ("matplotlib", "xarray", "dask")


def module_name(path: pathlib.Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {module_name(path): path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
TREES = {name: ast.parse(source) for name, source in SOURCES.items()}


def room(module: str) -> str:
    first = (*module.split("."), "")[1]
    return "ground" if first in GROUND else first


def imported(tree: ast.Module) -> set[str]:
    """All modules that a module imports, wherever in it the import stands."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import on line {node.lineno}"
            inside = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {name if name in TREES else node.module for name in inside}
    return names


IMPORTS = {module: imported(tree) for module, tree in TREES.items()}
GRAPH = {module: names & TREES.keys() for module, names in IMPORTS.items()}


def allowed(importer: str, target: str) -> bool:
    above, below = room(importer), room(target)
    return above == below or (above, below) in SIDEWAYS or FLOOR_OF[below] < FLOOR_OF[above]


def functions(tree: ast.AST) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def public_definitions(tree: ast.Module) -> list:
    """Public functions and classes of a module, and the public methods of those classes."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    top = [node for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]
    classes = [node for node in top if isinstance(node, ast.ClassDef)]
    methods = [node for owner in classes for node in owner.body if isinstance(node, kinds)]
    return top + [node for node in methods if not node.name.startswith("_")]


def test_every_room_has_a_floor():
    assert {room(module) for module in TREES} <= FLOOR_OF.keys()


def test_imports_go_down():
    found = [f"{a} -> {b}" for a, targets in GRAPH.items() for b in sorted(targets) if not allowed(a, b)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("house", ROWS)
def test_inner_rooms_stand_in_a_row(house):
    """A module imports from rooms before its own; rooms with the same place import nothing from each other."""
    place = {name: k for k, names in enumerate(ROWS[house]) for name in names.split()}
    inner = [(*module.split("."), "")[2] for module in TREES if module.startswith(f"jaxident.{house}.")]
    found = []
    assert place.keys() <= set(inner)
    for module, targets in GRAPH.items():
        own = module.split(".")
        for target in targets:
            other = target.split(".")
            if own[1:2] == other[1:2] == [house] and len(own) > 3 and own[2] != other[2:3][0]:
                found += [f"{module} -> {target}"] if place[own[2]] <= place.get(other[2], len(place)) else []
    assert not found, "\n".join(found)


@pytest.mark.parametrize("house", ROWS)
def test_tests_have_the_same_inner_rooms(house):
    tests = PACKAGE.parent / "tests" / house
    folders = {path.parent.name for path in tests.glob("*/test_*.py")}
    assert folders == set(" ".join(ROWS[house]).split())


def test_imports_run_in_no_circle():
    graphlib.TopologicalSorter(GRAPH).prepare()


def test_init_holds_names_only():
    lazy = ("__getattr__", "__dir__")
    for node in TREES["jaxident"].body:
        names = [target.id for target in node.targets] if isinstance(node, ast.Assign) else []
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        forwards = isinstance(node, ast.FunctionDef) and node.name in lazy
        named = bool(names) and all(name.startswith("_") for name in names)
        assert isinstance(node, ast.Import | ast.ImportFrom) or docstring or forwards or named, f"line {node.lineno}"


def test_printing_and_drawing_stay_upstairs():
    below = [module for module in TREES if FLOOR_OF[room(module)] < UPSTAIRS]
    calls = {m: [n.func for n in ast.walk(TREES[m]) if isinstance(n, ast.Call)] for m in below}
    printing = [m for m in below if any(isinstance(f, ast.Name) and f.id == "print" for f in calls[m])]
    drawing = [m for m in below if any(name.split(".")[0] in ("matplotlib", "click") for name in IMPORTS[m])]
    found = printing + drawing
    assert not found, "\n".join(found)


def test_files_are_short():
    lines = {module: len(source.splitlines()) for module, source in SOURCES.items()}
    found = [f"{module}: {count} lines" for module, count in lines.items() if count >= FILE_LINES]
    assert not found, "\n".join(found)


def code_lines(node):
    """Lines of a function without its docstring, which may list many arguments."""
    lines = node.end_lineno - node.lineno + 1
    return lines - (node.body[0].end_lineno - node.body[0].lineno + 1 if ast.get_docstring(node) else 0)


def test_functions_are_short():
    lengths = {f"{module}.{node.name}": code_lines(node) for module, tree in TREES.items() for node in functions(tree)}
    found = [f"{name}: {count} lines" for name, count in lengths.items() if count >= FUNCTION_LINES]
    assert not found, "\n".join(found)


def test_everything_public_has_a_docstring():
    modules = [module for module, tree in TREES.items() if not ast.get_docstring(tree)]
    definitions = [
        f"{module}.{node.name}"
        for module, tree in TREES.items()
        for node in public_definitions(tree)
        if not ast.get_docstring(node)
    ]
    found = modules + definitions
    assert not found, "\n".join(found)


def test_import_is_light():
    code = f"import sys, jaxident; print([name for name in {HEAVY!r} if name in sys.modules])"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert shown.stdout.strip() == "[]"
