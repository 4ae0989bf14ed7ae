"""Words that the pages use, each in a sentence or two."""

from jaxident.report.page import Section, Table

TERMS = {
    "account": "The mean squared error of a model, split among those who cause it. Shares add up to 100 %.",
    "bias": "The mean error over many repetitions. More data do not take it away.",
    "camera variance": "The square of the camera's own error: an error of 1 is as large as the camera's.",
    "corrected model": "The nominal model, its parameters refitted, with the effects that were found.",
    "coverage": "The share of intervals that hold the true value. Intervals of 95 % should cover 95 %.",
    "dead zone": "The commands around zero that do not move a wheel.",
    "determined": "The log alone tells the number to a tenth of its value, for a dead zone to a tenth of the largest "
    "command.",
    "effect": "One thing that real robots do and the nominal model leaves out, such as a delay.",
    "excess": "Error beyond the floor.",
    "floor": "The error that noise alone would leave: of the camera, of the start, of random slip.",
    "gain of an effect": "How much likelier the runs become with the effect in the model: a difference of logarithms, "
    "less what its numbers cost.",
    "gap": "The part of the error that is no noise.",
    "horizon": "How far ahead a model predicts, from a pose that the camera saw.",
    "interval": "The range that holds the true value in 95 (or 90) of 100 repetitions.",
    "Monte-Carlo error": "How much a statistic would differ with other random seeds.",
    "nominal model": "Dead zones and a linear drive, without effects.",
    "prior": "What is known of robots in general, before any log.",
    "residual": "A measured value less the model's.",
    "root mean square": "The root of the mean of squares. Large errors count more than in a mean.",
    "slip": "Random movement of the wheels over the floor. No model can tell when.",
    "start not known better": "Pose and speed at the beginning of a prediction are estimates. Their error grows ahead.",
    "white": "Without memory: the next error does not follow from this one.",
}
"""Meanings by term, in the order of the alphabet."""


def glossary(*terms: str) -> Section:
    """These terms as a folded section."""
    return Section("Words", [Table(("word", "meaning"), [(term, TERMS[term]) for term in terms])], folded=True)
