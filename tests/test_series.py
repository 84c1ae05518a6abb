"""The narrow waist: a ThetaSeries is valid or it does not exist."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolkit import ThetaSeries, UsageError


@pytest.mark.parametrize(
    ("columns", "word"),
    [
        (([0, 1], [0.1]), "theta_rad"),
        (([0, 1], [0.1, np.nan]), "finite"),
        (([0, np.inf], [0.1, 0.2]), "finite"),
        (([1, 0], [0.1, 0.2]), "increase"),
        (([0, 0], [0.1, 0.2]), "increase"),
        (([0, 1], [0.1, 0.2], [0.1, 0.0]), "positive"),
        (([], []), "at least one"),
    ],
)
def test_invalid_series_are_refused(columns, word):
    with pytest.raises(UsageError, match=word):
        ThetaSeries(*columns)


def test_a_series_owns_its_data():
    t_s = np.array([0.0, 1.0])
    series = ThetaSeries(t_s, [0.1, 0.2])
    t_s[0] = 5
    assert series.t_s[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        series.theta_rad[0] = 3
    with pytest.raises(dataclasses.FrozenInstanceError):
        series.t_s = t_s


def test_between_starts_at_zero():
    series = ThetaSeries(np.arange(10.0), np.arange(10.0) / 10, np.full(10, 0.01))
    part = series.between(2.5, 6)
    assert part.t_s.tolist() == [0, 1, 2, 3]
    assert part.theta_rad.tolist() == [0.3, 0.4, 0.5, 0.6]
    with pytest.raises(UsageError, match="record runs from 0 s to 9 s"):
        series.between(20, 30)


def test_the_log_grows_in_a_copy():
    series = ThetaSeries([0.0], [0.0])
    longer = series.logged("one").logged("two")
    assert longer.meta["log"] == ["one", "two"]
    assert "log" not in series.meta


finite = st.floats(-10, 10, allow_subnormal=False)


@given(st.lists(st.tuples(st.floats(1e-6, 10), finite, st.floats(1e-9, 1)), min_size=1, max_size=30))
def test_csv_round_trip_keeps_every_bit(tmp_path_factory, rows):
    steps, theta_rad, sigma_rad = (np.array(column) for column in zip(*rows, strict=True))
    series = ThetaSeries(np.cumsum(steps), theta_rad, sigma_rad)
    path = tmp_path_factory.mktemp("csv") / "theta.csv"
    series.to_csv(path)
    again = ThetaSeries.from_csv(path)
    for name in ("t_s", "theta_rad", "sigma_theta_rad"):
        np.testing.assert_array_equal(getattr(again, name), getattr(series, name))


@pytest.mark.parametrize("column", ["t_s", "theta_rad"])
def test_absurd_numbers_are_refused_before_anything_is_computed(column):
    good = {"t_s": np.arange(3.0), "theta_rad": np.zeros(3)}
    with pytest.raises(UsageError, match=rf"{column} reaches 1e\+300"):
        ThetaSeries(**{**good, column: good[column] + np.array([0, 0, 1e300])})
