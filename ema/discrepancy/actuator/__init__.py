"""The three-phase actuator: what its simulation gets wrong, from measured cycles.

`examine` is the whole run. Each folder stands on those before it, and a contract of the imports keeps it so:

`reading`     what a record says by itself: is it sound, under what conditions was it made, where is it odd
`simulating`  its cycles simulated at any point of faults and effects, and by how much runs differ
`fitting`     faults, effects and conditions of the bench fitted to the cycles; what may be fitted (`candidates`)
`finding`     which effects: what promises most, what resembles it, whether it is real, whether fewer do as well
`scoring`     what was found, and what may be in its place, weighed by the engine's score, which has the last word
`telling`     the answer in findings: sizes, intervals, what is left, pictures, what to record next
"""
