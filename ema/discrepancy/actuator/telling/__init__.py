"""What is told of an answer.

`telling` puts a model into findings, with `intervals` of faults, what `remains`, whether that is `repeating`, and the
`extension` that a plant file can carry. `pictures` show it; `next_recording` asks which of some `motions` would decide.
"""
