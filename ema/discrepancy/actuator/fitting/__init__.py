"""Faults, effects and conditions of the bench fitted to the cycles.

`free` is a parameter that a fit may move, `candidates` are the effects of the library as such, `fit` is Gauss–Newton
on simulated means, along `valley`s where a product is known best, and `flat` goes where a record hardly feels it. A
`search` keeps each fitted `model`; `problem` is the same for the engine. `comparators` and `timing` are conditions of
the bench, `growing` says whether faults change from cycle to cycle, `leave_out` fits without each cycle in turn.
"""
