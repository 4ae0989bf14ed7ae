"""What does each effect of the catalogue do to a robot?

    python -m experiments.effect_cards --out effect_cards

One card per effect: its words, its equation, its numbers, and a picture. The picture holds the path of the published
robot with and without the effect at its typical size, and how far the two are apart. The documentation shows the cards;
`effects_sheet` draws the same robots against what an effect could depend on.
"""

import argparse
import pathlib

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from jaxident.effects import CATALOGUE, NEUTRAL, SITES, run_full, to_vector
from jaxident.effects.effect import EffectRecord, Parameter
from jaxident.files.atomic import write_bytes
from jaxident.plot.style import BLUE, GREY, VERMILLION
from jaxident.robot.model import Effect
from jaxident.study.synthetic import excite

SECONDS, HOLD = 12.0, 15
TITLES = {
    "actuation": "Actuation: between the command and the motor's push",
    "drive": "Drive: motors, gears and masses",
    "contact": "Contact: wheels and ground",
    "time": "Time: what changes within a session",
    "camera": "Camera: what is reported",
}
HEAD = f"""# The catalogue of effects

{len(CATALOGUE)} effects that the model of a differential drive leaves out. A diagnosis looks for them, a simulation can
have them: `jaxident simulate published --effect transport_delay:delay=0.05 ...`, or in Python
`ji.Effect("transport_delay", {{"delay": 0.05}})`. Symbols are those of `docs/how_it_works.md`.

Each picture shows {SECONDS:.0f} s of one robot under the same commands: its path without the effect (grey) and with it
(blue), then how far the two are apart in position and in heading. Sizes are typical ones.
"""


@jax.jit
def simulated(drive, dead_zone, vector, log, key):
    """Reported poses (samples, 3) from rest, without camera noise."""
    start = ji.State(0.0, 0.0, 0.0, 0.0, 0.0)
    return jnp.stack(run_full(drive, dead_zone, vector, log.t, log.command, start, key=key), axis=1)


def paths() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times (samples,), and the poses (samples, 3) of the robot under each effect; under "none" without any."""
    robot = ji.load_model("published")
    rows = int(SECONDS / robot.sample_period)
    log = excite(jax.random.key(2), "multilevel", rows, robot.sample_period, hold=HOLD)
    vectors = {"none": NEUTRAL} | {
        name: to_vector([Effect(name, record.typical(SECONDS))]) for name, record in CATALOGUE.items()
    }
    body = robot.physical, jnp.asarray(robot.dead_zone)
    key = jax.random.key(1)
    return np.asarray(log.t), {
        name: np.asarray(simulated(*body, jnp.asarray(vector), log, key)) for name, vector in vectors.items()
    }


def picture(t: np.ndarray, plain: np.ndarray, changed: np.ndarray) -> bytes:
    """Both paths, and their distance in position and in heading over time, as PNG."""
    figure, (way, apart, turned) = ji.plot.figure(1, 3, size=(7.2, 2.1))
    way.plot(*plain[:, :2].T, color=GREY, linewidth=3.0)
    way.plot(*changed[:, :2].T, color=BLUE, linewidth=1.0)
    way.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", adjustable="datalim")
    distance = np.round(1e3 * (changed - plain), 6)
    position, heading = np.hypot(distance[:, 0], distance[:, 1]), distance[:, 2]
    apart.plot(t, position, color=BLUE)
    apart.set(xlabel="time [s]", ylabel="apart [mm]", ylim=(0.0, max(1.1 * position.max(), 0.1)))
    turned.plot(t, heading, color=VERMILLION)
    turned.set(xlabel="time [s]", ylabel="turned [mrad]")
    turned.set_ylim(min(1.1 * heading.min(), -1.0), max(1.1 * heading.max(), 1.0))
    return ji.plot.image(figure)


def card(record: EffectRecord) -> str:
    """One effect as Markdown."""
    title = record.name.replace("_", " ")
    lines = [
        f"### {title} {{: #{record.name} }}",
        f'<div class="card" markdown>\n\n`{record.name}`{" (extension)" if record.extension else ""}: {record.words}.',
        f"![Paths with and without {title}, and how far they are apart](effects/{record.name}.png)",
        "    " + record.equation.replace("\n", "\n    "),
        "\n".join(map(line, record.parameters)),
    ]
    if record.confused_with:
        twins = ", ".join(f"[{name.replace('_', ' ')}](#{name})" for name in record.confused_with)
        lines.append(f"Easily taken for: {twins}.")
    return "\n\n".join([*lines, "</div>\n"])


def line(parameter: Parameter) -> str:
    """One number of an effect as an item of a list."""
    typical = f"{parameter.typical:g} {parameter.unit}".strip()
    return f"* `{parameter.name}`: typically {typical}, none at {parameter.neutral:g}; {parameter.allowed}"


def pages() -> dict[str, str | bytes]:
    """The page and its pictures, by their place in the documentation."""
    t, found = paths()
    parts = [HEAD]
    for site in SITES:
        parts += [f"## {TITLES[site]}\n", *(card(entry) for entry in CATALOGUE.values() if entry.site == site)]
    drawn = {f"effects/{name}.png": picture(t, found["none"], found[name]) for name in CATALOGUE}
    return {"effects.md": "\n".join(parts), **drawn}


def main() -> None:
    """Write the page and its pictures to a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("effect_cards"))
    options = parser.parse_args()
    (options.out / "effects").mkdir(parents=True, exist_ok=True)
    for place, content in pages().items():
        write_bytes(options.out / place, content if isinstance(content, bytes) else content.encode())


if __name__ == "__main__":
    ji.start_jax()
    main()
