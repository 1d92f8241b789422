"""What is told beside the effects that were named.

`dropped` is what fits better and is not named, `plausible` are values that no machine has and what would make them,
`next_records` are those that would tell what a balance could not. `pictures` show what is left of an axis before and
after, `balance_pictures` what is left of its balance.
"""
