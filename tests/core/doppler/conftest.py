import pytest

from sd2core.numerics.compiled import warm_up


@pytest.fixture(scope="session", autouse=True)
def kernels() -> None:
    warm_up()
