"""Tables of a search made up from columns of numbers, in place of answers of poses."""

import numpy as np

from jaxident.diagnosis.causes.columns import Option, Table


def table_of(columns, residual, effects, scale=1.0, positive=False, here=(), price=0.0) -> Table:
    """From columns (windows, numbers, n), each an option of its own of the effect named, and residuals (windows,
    numbers); scale, positive: of every column or of each; `here`: effects that the fit has."""
    count = columns.shape[2]
    options = [Option(name, (k,), None, price) for k, name in enumerate(effects)]
    products, cross = np.einsum("wki,wkj->wij", columns, columns), np.einsum("wki,wk->wi", columns, residual)
    here = {option.effect: k for k, option in enumerate(options) if option.effect in here}
    return Table(
        options, here, products, cross, products.sum(axis=0), cross.sum(axis=0), np.full(count, scale),
        np.full(count, positive),
    )  # fmt: skip
