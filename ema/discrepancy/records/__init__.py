"""What a foreign record holds before anything is simulated: its channels, whether they agree, what it allows.

`facts` looks at each channel by itself, `agreements` at pairs of them, `allowed` says which plants and findings the
record is enough for, `begin` makes the first plant file of it.
"""

from .agreements import Agreement, agreements
from .allowed import Allowed, list_allowed
from .facts import ChannelFacts, Sampling, channels, sampling

__all__ = ["Agreement", "Allowed", "ChannelFacts", "Sampling", "agreements", "channels", "list_allowed", "sampling"]
