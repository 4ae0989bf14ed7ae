"""The rooms of the package and who imports whom, drawn from the code.

    python -m experiments.architecture

Writes docs/assets/architecture.svg. A room stands above all rooms that it imports. An arrow from one room to another is
left out where a longer way of arrows leads there, too.
"""

import ast
import graphlib
import pathlib
from html import escape

from jaxident.files.atomic import write_text

ROOT = pathlib.Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "assets" / "architecture.svg"

LEFT, MIDDLE, RIGHT = 180, 360, 540
ROOMS = {
    "ground": ("single files: arrays, logs, errors, start of JAX", MIDDLE),
    "robot": ("what is simulated: dead zone, drive, pose, noise", MIDDLE),
    "effects": ("the catalogue: one record for each effect", MIDDLE),
    "estimation": ("from logs to a model, with intervals", MIDDLE),
    "study": ("many trials: Monte Carlo, clusters", LEFT),
    "diagnosis": ("which effect causes the gap, how much", RIGHT),
    "files": ("reads and writes logs, models, bags, studies", MIDDLE),
    "export": ("a model in a simulator's words", LEFT),
    "plot": ("pictures; they compute nothing", RIGHT),
    "report": ("HTML pages", RIGHT),
    "results": ("what Python users hold", RIGHT),
    "cli": ("one file for each command", LEFT),
    "entry": ("public functions that take any log", RIGHT),
}
"""What is in each room, and where its box stands [px]."""
SINGLE = ("entry", "results")
"""Files that are rooms of their own; all other single files are the ground."""
OUTSIDE = ("__init__", "__main__")
"""Files that only pass on names."""
WIDTH, BOX, HEIGHT, STEP = 720, 340, 46, 74
"""Width of the picture, width and height of a box, and from one floor to the next [px]."""


def room_of(parts: tuple[str, ...]) -> str:
    """The room of a module, from the parts of its name below the package."""
    if len(parts) > 1 or (ROOT / "jaxident" / parts[0]).is_dir() or parts[0] in SINGLE:
        return parts[0]
    return "ground"


def imports() -> dict[str, set[str]]:
    """The rooms that each room imports."""
    found: dict[str, set[str]] = {}
    for path in sorted((ROOT / "jaxident").rglob("*.py")):
        parts = path.relative_to(ROOT / "jaxident").with_suffix("").parts
        if parts[0] in OUTSIDE:
            continue
        own = found.setdefault(room_of(parts), set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            own |= {room_of(name) for name in imported(node)}
    return {room: targets - {room} for room, targets in found.items()}


def imported(node: ast.AST) -> list[tuple[str, ...]]:
    """Names of the package's modules in an import, without the package's own; none for any other node."""
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
    if isinstance(node, ast.ImportFrom):
        names = [node.module or ""]
        if node.module == "jaxident":
            names = [f"jaxident.{alias.name}" for alias in node.names]
    return [tuple(name.split(".")[1:]) for name in names if name.startswith("jaxident.")]


def floors(graph: dict[str, set[str]]) -> dict[str, int]:
    """The floor of each room: one above the highest that it imports."""
    found: dict[str, int] = {}
    for room in graphlib.TopologicalSorter(graph).static_order():
        found[room] = max((found[below] + 1 for below in graph.get(room, ())), default=0)
    return found


def arrows(graph: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Importer and imported, without those that a longer way leads to."""

    def below(room: str) -> set[str]:
        return graph[room].union(*(below(target) for target in graph[room]))

    through = {room: set().union(*(below(target) for target in graph[room])) for room in graph}
    return [(room, target) for room in graph for target in sorted(graph[room] - through[room])]


def drawing() -> str:
    """The picture as SVG."""
    graph = imports()
    floor = floors(graph)
    top = max(floor.values())
    height = (top + 1) * STEP
    place = {room: (ROOMS[room][1], (top - floor[room]) * STEP + STEP // 2) for room in graph}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif">',
        '<defs><marker id="tip" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#555"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for importer, target in arrows(graph):
        (x, y), (to_x, to_y) = place[importer], place[target]
        end = f'x1="{x}" y1="{y + HEIGHT // 2}" x2="{to_x}" y2="{to_y - HEIGHT // 2}"'
        lines.append(f'<line {end} stroke="#555" stroke-width="1.5" marker-end="url(#tip)"/>')
    for room, (x, y) in place.items():
        box = f'x="{x - BOX // 2}" y="{y - HEIGHT // 2}" width="{BOX}" height="{HEIGHT}"'
        lines += [
            f'<rect {box} rx="5" fill="#eef3f8" stroke="#3b6ea5"/>',
            f'<text x="{x}" y="{y - 4}" text-anchor="middle" font-size="16" font-weight="bold">{room}</text>',
            f'<text x="{x}" y="{y + 15}" text-anchor="middle" font-size="13">{escape(ROOMS[room][0])}</text>',
        ]
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    write_text(PICTURE, drawing())
    print(f"wrote {PICTURE.relative_to(ROOT)}")
