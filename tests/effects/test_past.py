"""What the commands leave behind, against loops that are written from the equations."""

import itertools

import numpy as np
import pytest

from jaxident.effects.past import CHANGE_TIMES, HEAT_TIMES, LONGEST, REVERSAL_TIMES, past_of, past_of_run


def drive(rows: int):
    """Uneven times, and commands held for a while, some of them zero."""
    rng = np.random.default_rng(rows)
    t = np.cumsum(rng.uniform(0.02, 0.08, rows))
    held = rng.uniform(-1.0, 1.0, (rows // 7 + 1, 2)) * (rng.random((rows // 7 + 1, 1)) < 0.8)
    return t, np.repeat(held, 7, axis=0)[:rows]


def slow_reversal(t, command, tau):
    """Direction and time since it changed, by looking back from each row for the last change of sign of a mean."""
    step = np.diff(t, append=2.0 * t[-1] - t[-2])
    sums, mean = command.sum(axis=1), 0.0
    if tau:
        means = []
        for h, u in zip(step, sums, strict=True):
            mean = u + (mean - u) * np.exp(-h / tau)
            means.append(mean)
        sums = np.array(means)
    found = []
    for k in range(len(t)):
        signs = [(j, np.sign(sums[j])) for j in range(k + 1) if sums[j] != 0.0]
        turns = [j for (_, before), (j, now) in itertools.pairwise(signs) if now != before]
        since = t[k] - t[turns[-1]] if turns else LONGEST
        found.append((signs[-1][1] if signs else 0.0, min(since + 0.5 * step[k], LONGEST)))
    return np.array(found)


def slow_heat(t, command, tau, parts=400):
    """By small steps of Euler's method."""
    step = np.diff(t, append=2.0 * t[-1] - t[-2])
    heat, found = np.zeros(2), []
    for h, u in zip(step, command, strict=True):
        for part in range(parts):
            if part == parts // 2:
                found.append(heat.copy())
            heat = heat + h / parts * (u**2 - heat) / tau
    return np.array(found)


@pytest.mark.parametrize("number", range(len(REVERSAL_TIMES)))
def test_direction_and_time_since_it_changed_are_those_of_a_search_backwards(number):
    t, command = drive(200)
    found, expected = past_of(t, command).reversal[:, number], slow_reversal(t, command, REVERSAL_TIMES[number])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found[:, 1].min() < 0.1
    assert set(np.unique(found[:, 0])) >= {-1.0, 1.0}


@pytest.mark.parametrize("number", range(len(HEAT_TIMES)))
def test_heat_follows_its_equation(number):
    t, command = drive(100)
    found = np.asarray(past_of(t, command).heat)[:, number]
    np.testing.assert_allclose(found, slow_heat(t, command, HEAT_TIMES[number]), atol=1e-4)


def slow_change(t, command, tau, parts=400):
    """By small steps of Euler's method, the mean over each row."""
    step = np.diff(t, append=2.0 * t[-1] - t[-2])
    mean, found = np.zeros(2), []
    for h, u in zip(step, command, strict=True):
        apart = []
        for _ in range(parts):
            after = mean + h / parts * (u - mean) / tau
            apart.append(u - 0.5 * (mean + after))
            mean = after
        found.append(np.mean(apart, axis=0))
    return np.array(found)


@pytest.mark.parametrize("number", range(len(CHANGE_TIMES)))
def test_changes_follow_their_equation(number):
    t, command = drive(100)
    found = np.asarray(past_of(t, command).change)[:, number]
    np.testing.assert_allclose(found, slow_change(t, command, CHANGE_TIMES[number]), atol=2e-3)


def test_the_sense_of_a_command_is_that_of_its_last_change():
    t, command = drive(200)
    found = np.asarray(past_of(t, command).sense)[:, 0]
    for k, wheel in np.ndindex(found.shape):
        changes = np.diff(command[: k + 1, wheel], prepend=0.0)
        changes = changes[changes != 0.0]
        assert found[k, wheel] == (np.sign(changes[-1]) if len(changes) else 0.0)


def test_a_play_lags_by_its_half_width_in_the_sense_of_the_command():
    """Where each step of a command is wider than the play, the sense tells all of it."""
    half, t = 0.1, 0.05 * np.arange(200.0)
    command = np.repeat(np.random.default_rng(2).permutation(np.linspace(-1.0, 1.0, 8)), 25)
    behind, followed = 0.0, []
    for u in command:
        behind = float(np.clip(behind, u - half, u + half))
        followed.append(behind)
    sense = np.asarray(past_of(t, np.stack([command] * 2, axis=1)).sense)[:, 0, 0]
    np.testing.assert_allclose(followed, command - half * sense, atol=1e-12)


@pytest.mark.parametrize("rows", [2, 511, 512, 513, 1400])
def test_runs_that_are_filled_up_have_the_same_past(rows):
    t, command = drive(rows)
    whole, plain = past_of_run(t, command), past_of(t, command)
    assert len(whole.reversal) == rows
    # the last row's step is not known; the plain one guesses it
    np.testing.assert_allclose(whole.reversal[:-1], plain.reversal[:-1], atol=1e-12)
    np.testing.assert_allclose(whole.heat[:-1], plain.heat[:-1], atol=1e-12)
    np.testing.assert_allclose(whole.change[:-1], plain.change[:-1], atol=1e-12)
    np.testing.assert_array_equal(whole.sense, plain.sense)


def test_runs_side_by_side_are_those_alone():
    (t, one), (_, other) = drive(60), drive(61)
    both = past_of(np.stack([t, t], axis=1), np.stack([one, other[:60]], axis=1))
    for k, command in enumerate((one, other[:60])):
        alone = past_of(t, command)
        np.testing.assert_allclose(both.reversal[..., k], alone.reversal)
        np.testing.assert_allclose(both.heat[..., k], alone.heat)
        np.testing.assert_allclose(both.change[..., k], alone.change)
        np.testing.assert_array_equal(both.sense[..., k], alone.sense)
