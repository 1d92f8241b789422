"""The balance of torque along the measured motion, as a regression: a screen and a score of its own.

    τ_drive = J dω/dt + F sign ω + C ω + further laws + rest

Nothing is simulated: slow motion, short records and loops that hide everything in their drive are as good as others.
What the laws explain of the drive's torque is told whatever the free runs say. Each folder stands on those before it:

`laws`        what may act: columns of the regression along a motion, with their names, units and sentences
`regressing`  which of them the rows need: least squares with held-out blocks, and how sure the answer is
`records`     rows of the records of an axis, and all of it on these
`telling`     the balance in words and numbers, and as causes beside those of the free runs
"""
