"""Columns of other people's tables: options that are composed and told again."""

import numpy as np

from jaxident.columns import Column, after, columns_text, parse_columns


def test_an_option_that_mends_keeps_what_the_file_needs_already():
    """A file read in its own words, then mended, is the file read by the one option that is told."""
    own = parse_columns("t=time:ms,y=Y:mm,theta=yaw:deg+90,u_r=right")
    change = parse_columns("y=y:-1,theta=theta:-1+1.5708,u_r=u_l:-1,u_l=u_r:-1")
    told = parse_columns(columns_text(after(own, change)))
    cells = {"t": (5.0,), "y": (120.0, -7.5), "theta": (30.0, -170.0), "u_r": (0.4,), "u_l": (0.3,)}
    for name, given in cells.items():
        between = change.get(name, Column(name))
        first = own.get(between.source, Column(between.source))
        assert told[name].source == first.source
        values = np.array(given)
        np.testing.assert_allclose(told[name].convert(values), between.convert(first.convert(values)), rtol=1e-10)
    assert columns_text(own) == "t=time:ms,y=Y:mm,theta=yaw:deg+90,u_r=right"
