"""Which effects explain the cycles: proposed, fitted, kept or given up.

`paths` are the ways through the search and `forward` adds effects one at a time. `screening` says what candidates
promise and which look alike, `ridge` goes from faults to an effect that stands for them, `weighing` says whether a gain
is the effect's own, `verdicts` makes sure, `simpler` prefers fewer causes, such as one instead of several faults.
"""
