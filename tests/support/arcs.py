"""Windows along made-up arcs, without a log behind them."""

import numpy as np

from jaxident.diagnosis.motion.windows import Windows

STEP = 0.03


def along_arcs(rows: int, count: int, stride: int | None = None) -> Windows:
    """`count` windows of one run, one every `stride` rows (default: none share any), each on an arc of its own."""
    rng, stride = np.random.default_rng(1), rows if stride is None else stride
    time = np.arange(rows)[:, None] * STEP
    theta = rng.uniform(-3.0, 3.0, count) + rng.uniform(-2.0, 2.0, count) * time
    v = rng.uniform(0.1, 0.4, count)
    x, y = np.cumsum(v * STEP * np.cos(theta), axis=0), np.cumsum(v * STEP * np.sin(theta), axis=0)
    length = stride * (count - 1) + rows
    return Windows(
        t=np.arange(length)[:, None] * STEP, session=np.zeros(1), command=np.zeros((length, 1, 2)),
        step=np.full((rows, count), STEP), pose=np.stack([x, y, theta], axis=-1), seen=np.ones((rows, count), bool),
        run=np.zeros(count, int), first=np.arange(count) * stride, row=np.arange(count) * stride,
        way=np.zeros((2, count)),
    )  # fmt: skip
