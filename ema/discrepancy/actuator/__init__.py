"""The three-phase actuator: what its simulation gets wrong, from measured cycles.

`cycles` checks and groups the records (`measured`); `features` reduces a cycle to balances that feel physics; `plant`
simulates the cycles at any point of faults and effects, each run once (`runs`); `noise` says what two runs differ by,
and whether a residual is more; `fit` is Gauss–Newton on simulated means, and a `search` keeps each fitted `model`.
`weak` and `candidates` say what to try, `screening` what it promises and what would do the same; `structure`,
`controller` and `repeating` describe what is left, `examine` is the whole run, `pictures` shows it. Of the run, `paths`
are its ways, `forward` fits the best of them, `weighing` says whether one is real, `verdicts` makes sure, `simpler`
prefers fewer causes, such as one instead of several faults, `telling` puts the model into findings. Before it `checks`
refuses, `conditions`, `comparators`, `timing`, `sampling`, `play` and `zeros` read what is no flaw of the actuator,
`growing` whether its faults change.
"""
