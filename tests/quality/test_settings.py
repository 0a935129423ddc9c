"""Settings that no instrument has."""

from __future__ import annotations

import pytest

from ftproc.errors import UsageError
from ftproc.quality import sanity
from ftproc.settings import FilterSettings


@pytest.mark.parametrize(
    ("noise", "said"),
    [
        ((1e-12, 1e-4, 1e-4), "noise of the range must be at least 1e-06, not 1e-12: no instrument is so good"),
        ((None, None, 1e-15), "noise of the elevation must be at least 1e-09, not 1e-15: no instrument is so good"),
        ((1e300, None, None), "noise must be a positive number"),
    ],
)
def test_noise(noise: tuple[float | None, ...], said: str) -> None:
    with pytest.raises(UsageError) as caught:
        sanity.check_settings(FilterSettings(noise=noise))  # type: ignore[arg-type]
    assert said in str(caught.value)
    sanity.check_settings(FilterSettings(noise=(1e-6, 1e-9, 1e-9)))
