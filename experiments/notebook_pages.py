"""Notebooks as pages of the documentation: their text, their code, and the outputs that are stored in them."""

import base64
import json
import pathlib
import re

COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


def pages(folder: pathlib.Path) -> dict[str, str | bytes]:
    """Every notebook of a folder as Markdown and its pictures, by their place in the documentation."""
    found: dict[str, str | bytes] = {}
    for path in sorted(folder.glob("*.ipynb")):
        found |= page(path)
    return found


def page(path: pathlib.Path) -> dict[str, str | bytes]:
    """One notebook as Markdown and its pictures."""
    pictures: dict[str, str | bytes] = {}
    parts = []
    for cell in json.loads(path.read_text("utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            for name, data in cell.get("attachments", {}).items():
                pictures[f"notebooks/{path.stem}_{name}"] = base64.b64decode(data["image/png"])
                text = text.replace(f"attachment:{name}", f"{path.stem}_{name}")
            parts.append(text)
            continue
        parts.append(f"```python\n{text}\n```")
        for output in cell["outputs"]:
            if png := output.get("data", {}).get("image/png"):
                name = f"{path.stem}_{len(pictures)}.png"
                pictures[f"notebooks/{name}"] = base64.b64decode(png)
                parts.append(f"![output of the cell above]({name})")
            elif told := output.get("text") or output.get("data", {}).get("text/plain"):
                parts.append(f"```text\n{COLOURS.sub('', ''.join(told)).rstrip()}\n```")
    parts.append(f"The notebook itself: `experiments/notebooks/{path.name}`.")
    return {f"notebooks/{path.stem}.md": "\n\n".join(parts) + "\n", **pictures}
