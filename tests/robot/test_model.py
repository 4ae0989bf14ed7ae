"""The model is read the same in either form, and is a pytree with numbers as leaves."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.robot.difference import Difference, to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model, Provenance

DRIVE = Physical(jnp.array([2.0, 6.0]), jnp.array([[1.2, 1.1], [35.0, -33.0]]))
FREE = Difference(jnp.array([0.98, 0.77]), jnp.eye(2), -jnp.eye(2))


def test_a_physical_model_shows_its_hold_image():
    model, image = Model(0.1, DRIVE, jnp.zeros(2)), to_difference(DRIVE, 0.1)
    assert model.physical is DRIVE
    for ours, expected in zip((model.alpha, model.delta, model.epsilon), image, strict=True):
        np.testing.assert_array_equal(ours, expected)


def test_free_numerators_have_no_physical_form():
    model = Model(0.1, FREE, jnp.zeros(2))
    assert model.physical is None
    assert (model.alpha, model.delta, model.epsilon) == tuple(FREE)


def test_numbers_are_leaves_and_names_are_structure():
    effects = (Effect("lag", {"delay": 0.1}),)
    model = Model(0.1, FREE, jnp.zeros(2), effects=effects, provenance=Provenance(method="paper"))
    doubled = jax.jit(lambda m: jax.tree.map(lambda leaf: 2 * leaf, m))(model)
    assert doubled.provenance.method == "paper"
    assert doubled.effects[0].name == "lag"
    assert float(doubled.effects[0].parameters["delay"]) == 0.2
    np.testing.assert_array_equal(doubled.delta, 2 * jnp.eye(2))
    assert jax.tree.structure(model) != jax.tree.structure(Model(0.1, FREE, jnp.zeros(2), effects=()))
