"""Random records of random robots, in NumPy alone: the data that the oracle tests run on."""

import numpy as np

from jaxident.log import make_log

ALPHA = np.array([0.9821, 0.7706])
DELTA = np.array([[7.1181e-5, 7.0344e-5], [0.0341, -0.0333]])
EPS = np.array([[-7.0697e-5, -6.9978e-5], [-0.0313, 0.0305]])


def random_log(seed, rows):
    rng = np.random.default_rng(seed)
    alpha = np.array(
        [1 - np.exp(rng.uniform(np.log(0.003), np.log(0.2))), 1 - np.exp(rng.uniform(np.log(0.05), np.log(0.5)))]
    )
    delta = DELTA * np.exp(0.4 * rng.normal(size=(2, 2)))
    eps = EPS * np.exp(0.4 * rng.normal(size=(2, 2)))
    width = rng.uniform(0.02, 0.45, 2)
    run = np.sort(rng.integers(0, 3, rows)) if rng.random() < 0.25 else np.zeros(rows, int)
    if run[-1] > 0:
        cuts = np.sort(rng.choice(np.arange(30, rows - 30), 2, replace=False))
        run = np.searchsorted(cuts, np.arange(rows), side="right")
    kind = rng.integers(4)
    hold = rng.integers(4, 25)
    amp = rng.uniform(0.6, 1.2)

    def sig():
        if kind == 0:
            x = rng.uniform(-1, 1, rows // hold + 1)
        elif kind == 1:
            x = rng.choice(np.r_[np.arange(-5, 6) * 0.2, [-0.1, 0.1, 0.3, -0.3, 0]], rows // hold + 1)
        elif kind == 2:
            t = np.arange(rows) / rows
            h = np.arange(1, max(rows // (3 * hold), 3))
            x = np.sum(np.cos(2 * np.pi * (h * t[:, None] + rng.random(len(h)))), 1)
            return amp * x / abs(x).max()
        else:
            t = np.arange(rows) / rows
            return amp * np.sin(2 * np.pi * (rng.random() + 2 * t + rng.uniform(3, 12) * t * t))
        return amp * np.repeat(x, hold)[:rows]

    u = np.stack([sig(), sig()])
    s = 0.0 if rng.random() < 0.08 else 10 ** rng.uniform(-5.5, -3)
    m = np.sign(u) * np.maximum(abs(u) - width[:, None], 0)
    out = []
    for r in np.unique(run):
        k = np.flatnonzero(run == r)
        n = len(k)
        mm = m[:, k]
        y = np.zeros((2, n))
        y[:, 0] = np.array([3e-3, 0.05]) * rng.normal(size=2)
        for i in range(1, n):
            y[:, i] = alpha * y[:, i - 1] + delta @ mm[:, i - 1] - (eps @ mm[:, i - 2] if i > 1 else 0)
        th = rng.uniform(-3, 3) + np.cumsum(np.r_[0, y[1, 1:]])
        mid = (th[1:] + th[:-1]) / 2
        pose = np.stack([np.cumsum(np.r_[0, y[0, 1:] * np.cos(mid)]), np.cumsum(np.r_[0, y[0, 1:] * np.sin(mid)]), th])
        out.append(pose)
    p = np.concatenate(out, 1) + s * np.array([1, 1, 10])[:, None] * rng.normal(size=(3, rows))
    if rng.random() < 0.25:
        p[:, rng.random(rows) < rng.choice([0.03, 0.15])] = np.nan
    return make_log(np.arange(rows) / 30.0, *u, *p, run=run), width


def without_poses(log, gone):
    """The log with the poses of some rows, a mask, missing."""
    return log._replace(**{name: np.where(gone, np.nan, getattr(log, name)) for name in ("x", "y", "theta")})
