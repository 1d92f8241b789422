import importlib.util
from pathlib import Path

TOOL = Path(__file__).resolve().parents[2] / "tools" / "frame_reference.py"


def test_the_page_is_that_of_the_dbc():
    """If not: python tools/frame_reference.py"""
    spec = importlib.util.spec_from_file_location("frame_reference", TOOL)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text(encoding="utf-8") == tool.page()
