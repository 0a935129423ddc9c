"""The region that the training inputs cover."""

from __future__ import annotations

import numpy as np

from ftproc.correction.envelope import Envelope, Normaliser


def test_the_envelope_holds_its_training_data_whatever_their_tails() -> None:
    rng = np.random.default_rng(6)
    for columns in (rng.normal(size=(5000, 10)), rng.standard_t(3, size=(5000, 10))):
        z = Normaliser.fit(columns, 1e-9).forward(columns)
        envelope = Envelope.fit(z)
        assert envelope.contains(z).mean() >= 0.998
        assert not envelope.contains(z + 100.0).any()


def test_reach_scales_the_radius() -> None:
    z = np.random.default_rng(8).normal(size=(500, 4))
    near, far = Envelope.fit(z), Envelope.fit(z, 3.0)
    edge = z * np.sqrt(near.limit / near.distance(z))[:, None]
    assert near.contains(0.99 * edge).all()
    assert not near.contains(1.01 * edge).any()
    assert far.contains(2.99 * edge).all()
    assert not far.contains(3.01 * edge).any()


def test_a_column_that_was_constant_in_training_does_not_make_the_envelope_thin() -> None:
    z = np.random.default_rng(7).normal(size=(500, 4))
    z[:, 3] = 0.0
    assert Envelope.fit(z).contains(np.array([[0.0, 0.0, 0.0, 0.5]])).all()
