"""What was found, weighed by the engine's score, which has the last word (`likeliest`).

`entrants` are the fitted sets as the engine weighs them; `faint` finds what may be there beside or instead of what was
found, too faint for a search.
"""
