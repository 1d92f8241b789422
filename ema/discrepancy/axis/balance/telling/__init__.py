"""The balance in words and numbers (`telling`), with what records given together agree on (`telling_records`).

`as_effects` turns laws into effects of the library, which the axis model simulates.
"""
