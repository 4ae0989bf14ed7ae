"""A study so small that its compiled program is most of its time; all tests share that program."""

from jaxident.files.models import load_model
from jaxident.robot.model import Effect
from jaxident.study.design import Candidate, EffectSet, Study
from jaxident.study.sight import Choice

ROBOT = load_model("published")

SMALL = Study(
    robots=(Candidate("published", ROBOT, (0.0, 0.2, 0.0, 0.1)),),
    estimators=(Choice("key-term", "key-term-least-squares"),),
    seeds=6,
    noise=(1e-6, 1e-4),
    excitations=("staircase",),
    samples=(60,),
    hold=3,
    chunk=4,
)
"""Two noise levels, six seeds, chunks of four and two trials."""

UNDER_EFFECTS = SMALL._replace(
    effects=(
        EffectSet("none"),
        EffectSet("payload", (Effect("payload_change", {"ratio": 0.5, "instant": 1.0}),)),
        EffectSet("late", (Effect("transport_delay", {"delay": 0.05}),)),
    )
)
"""The same under no effect and under two, twelve chunks."""

SMALL_TOML = """
name = "study"
seeds = 6
noise = [1e-6, 1e-4]
excitations = ["staircase"]
samples = [60]
hold = 3
chunk = 4
robots = [{ model = "published", spread = { gain = 0.2, dead_zone = 0.1 } }]
estimators = [{ name = "key-term", method = "key-term-least-squares" }]
"""
"""The same as a file."""
