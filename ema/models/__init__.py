"""HF, LF1, LF2 and axis: compositions of effects."""
