"""Records as kernels and tests see them, and kernels that share the code of one loop."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core import compiled
from ftproc.core.compiled import record, zeros
from ftproc.core.editing.gate import GATE
from ftproc.core.filtering.backward import BACKWARD
from ftproc.core.filtering.filters import FILTER
from ftproc.core.filtering.forward import recursion, run_weighted
from ftproc.core.filtering.records import ROW, SAMPLE, Row


def test_a_record_lies_in_one_piece_of_memory_without_gaps():
    layout = record(Row)
    assert layout == ROW
    assert layout["state"].shape == (9,)
    assert layout["nis"].shape == ()
    for each in (FILTER, ROW, SAMPLE, GATE, BACKWARD):
        assert each.itemsize == 8 * sum(int(np.prod(each[name].shape)) for name in each.names)


def test_fields_are_views_of_the_records():
    filters = zeros(FILTER, 3)
    filters["x"][1] = np.arange(9)
    filters["p"][2][0, 0] = 5.0
    assert filters["x"][1, 4] == 4
    assert filters["p"][2, 0, 0] == 5
    assert not filters["x"][0].any()


@pytest.mark.skipif(compiled.WAY == "compiled", reason="a library holds no kernels of tests")
def test_each_recursion_has_its_own_update():
    """The code of the loop is shared; what one filter calls is not what another calls."""

    def nothing(f, sample, extra, row):
        return 1.0, False

    other = getattr(recursion(nothing, float), "py_func", recursion(nothing, float))
    plain = getattr(run_weighted, "py_func", run_weighted)
    assert other.__code__ is plain.__code__
    assert other.__globals__["_update"] is nothing
    assert plain.__globals__["_update"] is not nothing
    assert other.__qualname__ != plain.__qualname__
