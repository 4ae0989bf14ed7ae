"""Every miss of a diagnosis as a row: what was hidden, what was said, which marks are wrong."""

from typing import Any

HEADER = "| case | kind | hidden (strength) | slip | input | said | wrong |\n|---|---|---|---|---|---|---|"


def misses(answers: dict[str, dict], marks: dict[str, dict]) -> str:
    """A Markdown table of the cases with a wrong mark."""
    rows = [HEADER]
    for name in sorted(marks):
        answer, own = answers[name], marks[name]
        found = wrong(own)
        if found:
            cells = (
                name.removeprefix("case_"),
                own["kind"],
                hidden_of(answer),
                "yes" if answer.get("slip") else "",
                answer["inputs"],
                said_of(own),
                ", ".join(found),
            )
            rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def hidden_of(answer: dict) -> str:
    """The hidden effects and their strengths."""
    effects = zip(answer["effects"], answer["strength"], strict=True)
    return ", ".join(f"{effect['name']} ({strength:.2f})" for effect, strength in effects)


def said_of(marks: dict[str, Any]) -> str:
    """The effects named, or else the verdict."""
    return ", ".join(marks["selected"]) or marks["verdict"]


def wrong(marks: dict[str, Any]) -> list[str]:
    """In words, what is wrong with a diagnosis by its marks (`marks.mark`, with `interval` and `shrink`)."""
    found = {
        "name": marks["right"] is False,
        "site": marks["site"] is False,
        "channel": marks["channel"] is False,
        "claimed": marks["kind"] == "none" and marks["claimed"],
        "nothing unexplained": marks["kind"] in ("outside", "mixed") and not marks["unexplained"],
        "unexplained": marks["kind"] in ("single", "pair", "many") and marks["unexplained"],
    }
    words = [word for word, missed in found.items() if missed]
    low, high = marks.get("interval") or (None, None)
    shrink = marks.get("shrink")
    if low is not None and shrink is not None and not low <= shrink <= high:
        words.append(f"shrink {low:.3f} to {high:.3f} said, {shrink:.3f} true")
    return words
