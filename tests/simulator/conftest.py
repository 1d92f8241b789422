import pytest

from ema.bus.codec import Codec, default


@pytest.fixture(scope="session")
def codec() -> Codec:
    return default()


@pytest.fixture
def write(tmp_path):
    """Writes a scenario file and gives its path."""

    def make(text: str):
        path = tmp_path / "scenario.yaml"
        path.write_text(text)
        return path

    return make
