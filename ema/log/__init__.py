"""MCAP logs: write, read, recover."""

from .reader import FrameBatch, LogReader, Message
from .settings import LogSettings
from .writer import LogWriter

__all__ = ["FrameBatch", "LogReader", "LogSettings", "LogWriter", "Message"]
