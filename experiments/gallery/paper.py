"""A question about the paper's table."""

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments.gallery.answer import Answer, picture
from jaxident.plot import style
from jaxident.plot.names import written
from jaxident.robot.model import DIFFERENCE_ORDER, difference_vector
from jaxident.study.reproduction import PAPER, noise_study, paper_log

LEVEL = 2e-5
"""Camera noise [m] at which the paper's errors are typical (`experiments/typical_noise.py`)."""


def one_draw(seeds: int) -> Answer:
    """How far is the paper's table from the draws that its noise makes likely?"""
    log = jax.tree.map(jnp.asarray, paper_log(ji.load_model("published"), jax.random.key(0)))
    study = noise_study(log, jax.random.key(1), jnp.array([LEVEL]), 5 * seeds)
    kept = np.asarray(study.estimates)[0, :, -1][np.asarray(study.ok)[0, :, -1]]
    simplified = ji.load_model("published-simplified")
    true = np.asarray(difference_vector(simplified.difference, simplified.dead_zone))
    ours, theirs = 100 * np.abs(kept / true - 1), 100 * np.abs(np.array(PAPER) / true - 1)
    low, middle, high = np.quantile(ours, (0.05, 0.5, 0.95), axis=0)
    figure, ax = ji.plot.figure(size=(6.3, 3.2))
    place = np.arange(len(true))
    ax.vlines(place, low, high, color=style.BLUE, linewidth=4, label="nine of ten draws of noise")
    ax.plot(place, middle, "_", color=style.BLACK, markersize=12, label="median draw")
    ax.plot(place, np.maximum(theirs, 1e-3), "D", color=style.VERMILLION, label="printed in the paper")
    symbols = [written(name).symbol for name in DIFFERENCE_ORDER]
    ax.set(yscale="log", ylabel="error [%]", xticks=place, xticklabels=symbols)
    ji.plot.legend_above(ax)
    inside = int(np.sum((theirs >= low) & (theirs <= high)))
    return Answer(f"{inside} of its {len(true)} errors lie among nine of ten draws of {1e3 * LEVEL:g} mm of camera "
                  f"noise ({len(kept)} of {5 * seeds} draws converged).",
                  picture(figure, "Errors of the paper among those of many draws"))  # fmt: skip
