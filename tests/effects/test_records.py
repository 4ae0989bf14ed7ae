"""Every record is complete, names of effects stand in `jaxident.effects` alone, and one record makes an effect."""

import ast
import inspect
import math
import pathlib
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.effects.catalogue import BY_CHANCE, CATALOGUE, SITES
from jaxident.effects.coordinates import COORDINATES, from_catalogue, seeds, to_catalogue
from jaxident.effects.effect import Chance, Search
from jaxident.effects.fast_input import scanned
from jaxident.effects.full import KEYS
from jaxident.effects.signals import Push
from jaxident.effects.stages import CHAIN, STAGES
from jaxident.robot.drive import Physical

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "jaxident"
EXAMPLES = {"cli/session.py", "diagnosis/planning/question.py", "files/study_example.py"}
"""Files with a message or a template for users that shows an effect as an example, within a longer text."""
WORDS = {"backlash", "outliers", "slope", "stiction"}
"""Names that are words of English or of another trade as well: the slope of a curve, outliers of a fit."""

records = pytest.mark.parametrize("record", CATALOGUE.values(), ids=lambda record: record.name)
searched = pytest.mark.parametrize("name", COORDINATES)


@records
def test_a_record_is_complete(record):
    assert all((record.name, record.words, record.equation, record.source, record.parameters, record.channels))
    assert record.site in SITES
    assert record in CHAIN[record.stage]
    assert isinstance(record.search, Search) != isinstance(record.chance, Chance)
    assert record.chance is None or set(record.chance.keys) <= set(range(KEYS))
    assert len({parameter.name for parameter in record.parameters}) == len(record.parameters)


def test_stages_and_kinds_of_chance_are_told_apart():
    assert CHAIN.keys() == set(STAGES)
    assert sum(len(effects) for effects in CHAIN.values()) == len(CATALOGUE)
    assert set(BY_CHANCE.values()) == {name for name, record in CATALOGUE.items() if record.random}


def functions(law) -> list:
    return list(law) if isinstance(law, tuple) else [law]


@records
def test_laws_take_the_numbers_of_the_record(record):
    names = {parameter.name for parameter in record.parameters}
    for law in functions(record.act):
        assert names <= set(inspect.signature(law).parameters)
    if record.search is not None:
        for law in functions(record.law) if record.stage != "load" else [record.fast]:
            assert {c.name for c in record.search.coordinates} <= set(inspect.signature(law).parameters)


@searched
def test_parameters_and_coordinates_lead_to_and_fro(name):
    typical = CATALOGUE[name].typical()
    values = from_catalogue(name, typical)
    assert tuple(values) == tuple(c.name for c in COORDINATES[name])
    assert all(c.low <= values[c.name] <= c.high for c in COORDINATES[name])
    again = to_catalogue(name, values)
    assert again.keys() == typical.keys()
    np.testing.assert_allclose(list(again.values()), list(typical.values()), rtol=1e-12)


@searched
def test_a_search_reaches_beyond_all_that_real_robots_show(name):
    """A fit at a bound of its search counts for nothing, so that none may lie within what the catalogue tells."""
    typical = CATALOGUE[name].typical()
    for parameter in CATALOGUE[name].parameters:
        for end in () if parameter.shape else parameter.range:
            values = from_catalogue(name, {**typical, parameter.name: end})
            for own in COORDINATES[name]:
                if not own.shape and values[own.name] != own.neutral:
                    assert own.low < values[own.name] < own.high, (parameter.name, end)


@searched
def test_neutral_coordinates_are_neutral_parameters(name):
    neutral, search = CATALOGUE[name].neutral(), CATALOGUE[name].search
    found = to_catalogue(name, {c.name: c.neutral for c in search.coordinates})
    for parameter in CATALOGUE[name].parameters:
        if not parameter.shape and not (math.isinf(parameter.neutral) and search.transform is None):
            assert found[parameter.name] == neutral[parameter.name]


@searched
def test_seeds_are_points_of_the_search(name):
    own = {c.name: c for c in COORDINATES[name]}
    suggested = CATALOGUE[name].search.suggested
    points = seeds(name, 60.0)
    if suggested is not None:
        points = [*points, suggested.seed(0.1, 0.2)]
    for point in points:
        assert point.keys() <= own.keys()
        assert all(own[key].low <= value <= own[key].high for key, value in point.items())


def strings(tree: ast.Module) -> list[str]:
    """All strings of a module but its docstrings."""
    owners = (ast.Module, ast.ClassDef, ast.FunctionDef)
    texts = {
        id(node.body[k].value)
        for node in ast.walk(tree) if isinstance(node, owners)
        for k in range(len(node.body)) if isinstance(node.body[k], ast.Expr)
    }  # fmt: skip
    constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in texts]
    return [node.value for node in constants if isinstance(node.value, str)]


def names_in(path: pathlib.Path) -> set[str]:
    """Names of effects that stand in the code of a file: as a string, an attribute, a keyword or an import."""
    tree, found = ast.parse(path.read_text(encoding="utf-8")), set()
    for text in strings(tree):
        found |= {text} & CATALOGUE.keys()
        if str(path.relative_to(PACKAGE)) not in EXAMPLES:
            found |= {name for name in CATALOGUE if name in text and "_" in name}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            found |= {node.attr} & CATALOGUE.keys() - WORDS
        if isinstance(node, ast.keyword | ast.arg):
            found |= {node.arg} & CATALOGUE.keys() - WORDS
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("jaxident.effects"):
            found |= {alias.name for alias in node.names} & CATALOGUE.keys()
    return found


def test_no_effect_is_named_outside_the_folder_of_effects():
    files = [path for path in PACKAGE.rglob("*.py") if path.relative_to(PACKAGE).parts[0] != "effects"]
    found = {str(path.relative_to(PACKAGE)): names_in(path) for path in files}
    assert not {path: names for path, names in found.items() if names}


def test_integrators_name_no_effect_either():
    laws = {"actuation", "camera", "commands", "contact", "drive", "friction", "gears", "session"}
    files = [path for path in (PACKAGE / "effects").glob("*.py") if path.stem not in laws]
    assert not {path.name: names_in(path) for path in files if names_in(path)}


@pytest.mark.parametrize("name", [effect.name for effect in CHAIN["gear"]])
def test_a_law_of_whole_runs_is_its_law_of_a_substep_scanned(name):
    """Wheels that brake in their play or coast; steps differ."""
    record, rng = CATALOGUE[name], np.random.default_rng(2)
    drive = Physical(jnp.array([4.0, 5.0]), ((1.2, 1.1), (9.0, -8.5)), jnp.array([0.02, -1.0]))
    asked = Push(jnp.asarray(rng.normal(size=(300, 2, 2))), jnp.asarray(0.1 * rng.normal(size=(300, 2, 2))))
    step = jnp.asarray(rng.uniform(0.01, 0.03, (300, 2, 1)))
    values = record.typical() | ({"coasting": 0.7} if "coasting" in record.typical() else {})
    quick, slow = record.fast(asked, drive, step, **values), scanned(record, asked, drive, step, **values)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-11), quick, slow)
    assert np.abs(quick.mean - asked.mean).max() > 0.1


ADDED = """
import sys, types, pathlib
import jax
jax.config.update("jax_enable_x64", True)
import numpy as np
import jaxident
package = types.ModuleType("jaxident.effects")  # as if the records had been written into the files
package.__path__ = [str(pathlib.Path(jaxident.__file__).parent / "effects")]
sys.modules["jaxident.effects"] = package
from jaxident.effects import contact, actuation, gears
from jaxident.effects.effect import ALONG, BOTH, EffectRecord, Parameter, Search, positive, signed
from jaxident.robot.drive import Force

def wind(motion, strength):
    return Force(strength + 0.0 * motion.v, 0.0 * motion.w)

contact.RECORDS += (EffectRecord(
    "wind", "contact", "body", "wind from behind", "v' += a", (Parameter("strength", "m/s^2", 0.0, (-1.0, 1.0), 0.3),),
    (ALONG,), "weather", wind, search=Search((signed("strength", 1.0),))),)
actuation.RECORDS += (EffectRecord(
    "second_lag", "actuation", "gear", "one more lag", "q' = (m - q) / tau",
    (Parameter("tau", "s", 0.0, (0.0, 0.3), 0.05, least=0.0),), BOTH, "a filter in the driver",
    lambda push, memory, now, tau: gears.one_pole(push, memory, now.step, tau),
    search=Search((positive("tau", 0.5),))),)
from jaxident.effects.apply import with_effects
from jaxident.effects.coordinates import by_effect, vector_of
from jaxident.effects.fast_motion import report
from jaxident.effects.simulate import simulate
from jaxident.diagnosis.motion.paths import track
from jaxident.diagnosis.motion.windows import cut
from jaxident.files.models import load_model
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model

rng, rows = np.random.default_rng(4), 150
u = np.repeat(rng.uniform(-1.0, 1.0, (rows // 10, 2)), 10, axis=0)
t = 0.03 * np.arange(rows)
log = make_log(t, u[:, 0], u[:, 1], 0.0 * t, 0.0 * t, 0.0 * t)
drive = Physical(np.array([4.0, 5.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0]))
plain = Model(0.03, drive, np.array([0.1, 0.12]))
model = with_effects(plain, [("wind", {"strength": 0.3}), ("second_lag", {"tau": 0.05})])
full = [np.stack(simulate(one, log).pose) for one in (plain, model)]
windows = cut(log, rows)
path = lambda vector: report(by_effect(vector), *track(vector, np.zeros((5, 1)), windows).pose)
fast = [np.stack(jax.jit(path)(vector_of(one)))[..., 0] for one in (plain, model)]
wanted, found = full[1] - full[0], fast[1] - fast[0]
print(np.abs(wanted).max(), np.abs(found - wanted).max())
"""


def test_one_record_makes_an_effect_in_both_integrators():
    """A body force and a gear without a form for whole runs, put among the records before anything reads them."""
    shown = subprocess.run([sys.executable, "-c", ADDED], capture_output=True, text=True, check=True, timeout=300)
    effect, error = map(float, shown.stdout.split())
    assert effect > 0.1
    assert error < 0.01 * effect
