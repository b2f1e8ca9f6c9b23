import pytest


@pytest.fixture(scope="session", autouse=True)
def kernels(compiled_kernels: None) -> None:
    """Compiled before the first test."""
