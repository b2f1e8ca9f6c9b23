"""What tests of the body share."""

from __future__ import annotations

import os

import pytest

from sd2core.body.landmark_models import LandmarkModels, landmark_models
from sd2core.errors import Sd2Error


@pytest.fixture(scope="session")
def models() -> LandmarkModels:
    """The landmark models; fetched where the tests must not skip."""
    required = os.environ.get("SD2_REQUIRE_SHARED") == "1"
    try:
        return landmark_models(download=required)
    except Sd2Error as error:
        if required:
            pytest.fail(str(error))
        pytest.skip(f"needs the landmark models, see `sd2 fetch-models` ({error})")
