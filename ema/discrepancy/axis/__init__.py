"""The axis plant for the discrepancy engine: one inertia or mass with its records.

`examine` is the whole run. Each folder stands on those before it, and a contract of the imports keeps it so:

`naming`      what parameters are called, metres and newtons in what is said, intervals of what was drawn
`reading`     what a record says by itself: its channels, their noise, time stamps and delays; cut into windows
`scanning`    the torque that is missing along the measured motion: lines per turn, stretches, terms, angle zeros
`balance`     the balance of torque along the measured motion as a regression: a screen and a score of its own
`simulating`  what a free run is judged by: its noise, whitening, how long windows may be; the loop run as a whole
`finding`     which effects explain the free runs: the axis as the engine's plant, with its candidates
`judging`     one answer of free runs and the balance: what both name, which of them rules, what stands beside it
`telling`     what else is told: pictures, what was dropped, values that no machine has, what to record next
"""
