"""Model files: exact there and back, and every mistake named by its key."""

import copy
import dataclasses
import json
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.files.json_text import format_json, parse_json
from jaxident.files.models import SHIPPED, load_model, model_from_dict, model_to_dict, save_model
from jaxident.numerics import float64_switch
from jaxident.robot.difference import Difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance, Spread
from jaxident.robot.noise import Noise

EFFECTS = ("drag", "lag")


def draw(*shape):
    return np.random.default_rng(sum(shape)).normal(size=shape)


PHYSICAL = Model(1 / 30, Physical(np.array([0.54, 7.8]), draw(2, 2)), np.array([0.25, 0.2]))
FREE = Model(0.05, Difference(draw(2), draw(2, 2), draw(2, 2)), np.array([0.0, 0.2]))
FULL = Model(
    0.1,
    Physical(np.array([0.54, 7.8]), draw(2, 2), np.array([1e-4, -0.3])),
    np.array([0.1, 0.2]),
    noise=Noise(1e-3, 2e-3, 0.4, 1e-5, 0.0),
    effects=(Effect("lag", {"tau": 0.1, "b": -2.0}, {"tau": 0.01}), Effect("drag", {"c": 1 / 3})),
    standard_deviation=Spread(
        alpha=np.abs(draw(2)),
        dead_zone=np.array([0.1, np.nan]),
        physical=Physical(np.abs(draw(2)), np.abs(draw(2, 2)), np.array([0.0, 0.0])),
        noise=Noise(1e-4, 1e-4, None, 0.0, 0.0),
    ),
    covariance=draw(3, 3) @ draw(3, 3).T,
    parameter_order=("rate_v", "rate_w", "D_r"),
    provenance=Provenance("0.1.0", "maximum-likelihood", ("a.csv", "b.csv"), 7, from_prior=("rate_1",)),
)


def equal(one, other) -> bool:
    same = jax.tree.map(lambda a, b: np.array_equal(a, b, equal_nan=True), one, other)
    return all(jax.tree.leaves(same)) and jax.tree.structure(one) == jax.tree.structure(other)


def content(model=FULL):
    return copy.deepcopy(model_to_dict(model))


@pytest.mark.parametrize("model", [PHYSICAL, FREE, FULL], ids=["physical", "free", "full"])
def test_a_model_reads_back_exactly(tmp_path, model):
    save_model(model, tmp_path / "m.json")
    again = load_model(tmp_path / "m.json", EFFECTS)
    assert equal(again, model)
    assert json.loads((tmp_path / "m.json").read_text()) == model_to_dict(again)


def test_numbers_come_back_as_numpy_arrays_and_floats(tmp_path):
    save_model(FULL, tmp_path / "m.json")
    model = load_model(tmp_path / "m.json", EFFECTS)
    leaves = jax.tree.leaves(model)
    assert {type(leaf) for leaf in leaves} == {np.ndarray, float}
    assert {leaf.dtype for leaf in leaves if isinstance(leaf, np.ndarray)} == {np.dtype(float)}


def test_models_of_jax_arrays_are_saved_too():
    model = jax.tree.map(jnp.asarray, FULL)
    assert model_to_dict(model) == model_to_dict(FULL)


def test_saving_and_loading_do_not_depend_on_the_precision_of_jax():
    expected = model_to_dict(FULL)
    with float64_switch(False):
        assert model_to_dict(FULL) == expected
        assert equal(model_from_dict(expected, EFFECTS), FULL)
        assert jnp.ones(1).dtype == np.float32


def test_the_image_stands_beside_the_physical_parameters():
    found = content(PHYSICAL)
    image = PHYSICAL.difference
    for key, value in image._asdict().items():
        assert np.allclose(found[key], value, rtol=1e-12, atol=0.0)
    assert found["physical"]["coupling"] == [0.0, 0.0]


def test_numbers_that_the_data_do_not_determine_become_null():
    spread = Spread(alpha=np.array([math.inf, 0.1]), noise=Noise(math.nan, 0.1))
    model = dataclasses.replace(FREE, standard_deviation=spread)
    found = model_to_dict(model)["standard_deviation"]
    assert found["alpha"] == [None, 0.1]
    assert found["noise"]["position"] is None
    again = model_from_dict(model_to_dict(model)).standard_deviation
    assert np.array_equal(again.alpha, [np.nan, 0.1], equal_nan=True)
    assert again.noise.position is None


def test_none_has_several_spellings():
    found = content()
    found["physical"]["coupling"] = None
    assert model_from_dict(found, EFFECTS).physical.coupling is None
    found["physical"]["coupling"] = [0, 0]
    assert model_from_dict(found, EFFECTS).physical.coupling is None
    found["noise"]["correlation_time"] = 0
    assert model_from_dict(found, EFFECTS).noise.correlation_time is None
    found = {
        key: content()[key] for key in ("schema", "sample_period", "alpha", "delta", "epsilon", "dead_zone", "physical")
    }
    short = model_from_dict(found)
    assert (short.noise, short.effects, short.standard_deviation, short.covariance) == (None, (), None, None)
    assert short.provenance == Provenance()


def test_the_file_is_laid_out_to_be_read(tmp_path):
    save_model(FREE, tmp_path / "m.json")
    lines = (tmp_path / "m.json").read_text().splitlines()
    assert lines[1:3] == ['  "schema": "jaxident.model/1",', '  "sample_period": 0.05,']
    assert [line[:12] for line in lines[3:5]] == ['  "alpha": [', '  "delta": [']
    assert lines[4].endswith("]],")
    assert lines[-1] == "}"


MISTAKES = [
    ("schema", "jaxident.model/2", "schema: is 'jaxident.model/2'; this program reads 'jaxident.model/1'"),
    ("schema", None, "schema: is None"),
    ("sample_period", 0, "sample_period: is 0; it should be the positive time"),
    ("sample_period", -1, "sample_period: is -1; it should be at least 0"),
    ("sample_period", "0.1", "sample_period: should be a number, is a text"),
    ("sample_period", True, "sample_period: should be a number, is true"),
    ("sample_period", math.nan, "sample_period: is not a finite number"),
    ("sample_period", 10**400, "sample_period: is not a finite number"),
    ("alpha", [1, 2, 3], "alpha: should be a list of shape 2, is 3 entries"),
    ("alpha", 0.9, "alpha: should be a list of shape 2, is a number"),
    ("alpha", [0.9, None], r"alpha\[1\]: should be a number, is null"),
    ("alpha", [0.9, math.inf], r"alpha\[1\]: is not a finite number"),
    ("delta", [[1, 2], [3]], r"delta\[1\]: should be a list of shape 2, is 1 entries"),
    ("delta", [1, 2], r"delta\[0\]: should be a list of shape 2, is a number"),
    ("alpha", [0.5, 0.5], "alpha: does not follow from physical at this sample_period, whose image is .*; correct one"),
    ("delta", [[1, 2], [3, 4]], "delta: does not follow from physical"),
    ("epsilon", [[1, 2], [3, 4]], "epsilon: does not follow from physical"),
    ("dead_zone", [0.1, -0.2], r"dead_zone\[1\]: is -0.2; it should be at least 0"),
    ("dead_zones", [0, 0], "m.json: unknown key 'dead_zones'; known are schema, sample_period, alpha, .*provenance"),
    ("physical", [], "physical: should be an object with the keys rate, gain, coupling"),
    ("physical.rate", None, "physical.rate: should be a list of shape 2, is null"),
    ("physical.mass", 1, "physical: unknown key 'mass'; known are rate, gain, coupling"),
    ("physical.rate", [-1e6, 1], "physical: its alpha at this sample_period overflows"),
    ("noise.position", -1e-3, "noise.position: is -0.001; it should be at least 0"),
    ("noise.position", None, "noise.position: should be a number, is null"),
    ("noise.colour", 1, "noise: unknown key 'colour'; known are position, heading, correlation_time, slip_along, slip"),
    ("effects", {}, "effects: should be a list, is an object"),
    (
        "effects",
        [{"name": "ghost", "parameters": {}}],
        r"effects\[0\].name: unknown effect 'ghost'; known are: drag, lag",
    ),
    ("effects", [{"name": "lag", "parameters": {}}] * 2, r"effects\[1\].name: effect 'lag' stands twice; keep one"),
    ("effects", [{"name": "lag"}], r"effects\[0\]: no key 'parameters'; needed are name, parameters"),
    ("effects", [{"name": 1, "parameters": {}}], r"effects\[0\].name: should be a text, is a number"),
    ("effects", [{"name": "lag", "parameters": []}], r"effects\[0\].parameters: should be an object, is a list"),
    (
        "effects",
        [{"name": "lag", "parameters": {"a": "b"}}],
        r"effects\[0\].parameters.a: should be a number, is a text",
    ),
    (
        "effects",
        [{"name": "lag", "parameters": {"a": 1}, "standard_deviation": {"b": 1}}],
        r"effects\[0\].standard_deviation: unknown key 'b'; known are a",
    ),
    (
        "standard_deviation.gamma",
        1,
        "standard_deviation: unknown key 'gamma'; known are alpha, delta, .*physical, noise",
    ),
    ("standard_deviation.alpha", [1], "standard_deviation.alpha: should be a list of shape 2, is 1 entries"),
    ("standard_deviation.alpha", [1, -1], r"standard_deviation.alpha\[1\]: is -1; it should be at least 0"),
    ("standard_deviation.physical", {"gain": None}, "standard_deviation.physical: no key 'rate'"),
    ("standard_deviation.noise.position", "x", "standard_deviation.noise.position: should be a number, is a text"),
    ("covariance.matrix", [[1]], "covariance.matrix: should be a list of shape 3 x 3, is 1 entries"),
    ("covariance.parameter_order", [1, 2, 3], r"covariance.parameter_order\[0\]: should be a text, is a number"),
    ("covariance", {"matrix": []}, "covariance: no key 'parameter_order'; needed are parameter_order, matrix"),
    ("provenance.seed", 1.5, "provenance.seed: should be an integer or null"),
    ("provenance.logs", "a.csv", "provenance.logs: should be a list, is a text"),
    ("provenance.date", "today", "provenance: unknown key 'date'; known are version, method, logs, seed"),
]


@pytest.mark.parametrize(
    ("path", "value", "reason"), MISTAKES, ids=[f"{path}-{k}" for k, (path, *_) in enumerate(MISTAKES)]
)
def test_a_mistake_is_named_by_its_key(path, value, reason):
    found = content()
    *above, key = path.split(".")
    section = found
    for name in above:
        section = section[name]
    section[key] = value
    with pytest.raises(InputError, match=reason) as caught:
        model_from_dict(found, EFFECTS, "m.json")
    assert str(caught.value).startswith("m.json: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["schema", "sample_period", "alpha", "delta", "epsilon", "dead_zone", "physical"])
def test_a_missing_key_is_named(key):
    found = content()
    del found[key]
    with pytest.raises(InputError, match=f"m.json: no key '{key}'; needed are schema, sample_period"):
        model_from_dict(found, EFFECTS, "m.json")


@pytest.mark.parametrize("found", [None, [], "model", 1.0])
def test_what_is_no_object_is_refused(found):
    with pytest.raises(InputError, match="should be an object with the keys schema, "):
        model_from_dict(found)


def test_the_image_may_be_rounded_but_not_wrong():
    found = content()
    found["delta"][0][0] += 0.9e-6 * np.max(np.abs(found["delta"]))
    model_from_dict(found, EFFECTS)
    found["delta"][0][0] += 0.2e-6 * np.max(np.abs(found["delta"]))
    with pytest.raises(InputError, match="delta: does not follow"):
        model_from_dict(found, EFFECTS)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"schema": 1,\n "alpha": [1, 2,]}', "m.json, line 2, column [0-9]+: not JSON: "),
        ("", "m.json, line 1, column 1: not JSON"),
        ('{"a": {"b": 1, "c": 2, "b": 3}}', "m.json: key 'b' is given twice; keep one"),
        ('{"a": NaN}', "m.json: NaN is not a JSON number"),
        ('{"a": [-Infinity]}', "m.json: -Infinity is not a JSON number"),
        ("[" * 100_000, "m.json: lists or objects are nested too deeply"),
        ('{"a": ' * 100_000, "m.json: lists or objects are nested too deeply"),
        ("1" * 10_000, "m.json: a number cannot be read: "),
        ("[" * 500 + "1" + "]" * 500, "should be an object with the keys"),
        ("\udcff", "is not a text file in UTF-8; it should be JSON"),
    ],
)
def test_what_is_not_json_is_named_by_its_line(tmp_path, text, reason):
    (tmp_path / "m.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=reason) as caught:
        load_model(tmp_path / "m.json")
    assert "\n" not in str(caught.value)


def test_a_path_that_is_no_model_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"x\.json: no such file, nor a robot .* \(published, published-simplified\)"):
        load_model(tmp_path / "x.json")
    with pytest.raises(InputError, match="is a folder, not a JSON file"):
        load_model(tmp_path)
    with pytest.raises(InputError, match="no such file"):
        load_model("n" * 300)


def test_a_model_that_would_not_load_is_not_saved(tmp_path):
    broken = Model(0.1, Physical(np.array([math.nan, 1.0]), np.ones((2, 2))), np.zeros(2))
    with pytest.raises(InputError, match=r"this model: alpha\[0\]: is not a finite number"):
        save_model(broken, tmp_path / "m.json")
    assert not (tmp_path / "m.json").exists()


def test_the_published_robot_is_that_of_the_paper():
    model = load_model("published")
    per_sample = np.array([[-1.80462e-2, -4.56e-6], [-9.36313e-2, -2.605681e-1]])
    gain = np.array([[1.4332e-4, 1.4143e-4], [7.424912e-2, -7.25032e-2]])
    assert model.sample_period == 1 / 30
    assert np.allclose(model.physical.rate, -np.diag(per_sample) * 30, rtol=1e-12)
    assert np.allclose(model.physical.coupling, [per_sample[0, 1] * 30, per_sample[1, 0] * 30], rtol=1e-12)
    assert np.allclose(model.physical.gain, gain * 900, rtol=1e-12)
    assert model.dead_zone.tolist() == [0.25, 0.2]
    assert "arbitrary" in model.provenance.method


def test_the_simplified_robot_is_that_of_the_table_and_close_to_the_other():
    model, whole = load_model("published-simplified"), load_model("published")
    assert model.physical is None
    assert model.alpha.tolist() == [0.9821, 0.7706]
    assert model.delta.tolist() == [[7.1181e-5, 7.0344e-5], [0.0341, -0.0333]]
    assert model.epsilon.tolist() == [[-7.0697e-5, -6.9978e-5], [-0.0313, 0.0305]]
    for key in ("alpha", "delta", "epsilon"):
        assert np.allclose(getattr(model, key), getattr(whole, key), rtol=2e-3)


def test_a_file_comes_before_a_shipped_robot_of_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_model(FREE, SHIPPED[0])
    assert load_model(SHIPPED[0]).sample_period == 0.05


@pytest.mark.parametrize(
    "value",
    [
        {},
        [],
        None,
        True,
        -0.0,
        1e-300,
        0.1,
        'ü\n"',
        [[]],
        {"a": {}, "b": [{"c": [1, 2.5]}, {}]},
        [list(range(200)), []],
    ],
)
def test_json_reads_back_as_it_was_written(value):
    text = format_json(value)
    assert parse_json(text, "value") == value
    assert json.loads(text) == value
    assert text.endswith("\n")


def test_json_cannot_hold_what_is_not_finite():
    with pytest.raises(ValueError, match="not JSON compliant"):
        format_json([1.0, math.nan])


def test_effects_of_the_catalogue_are_checked_against_it():
    found = content() | {"effects": [{"name": "motor_lag", "parameters": {"time_constant": 0.1}}]}
    assert model_from_dict(found).effects[0].parameters == {"time_constant": 0.1}
    for parameters, reason in (
        ({"tau": 0.1}, r"effects\[0\].parameters: effect 'motor_lag': unknown parameter 'tau'; it has time_constant"),
        ({"time_constant": -1}, r"time_constant is -1; at least 0 s"),
    ):
        found["effects"][0]["parameters"] = parameters
        with pytest.raises(InputError, match=reason):
            model_from_dict(found)
