"""The balance of torque along the measured motion, as a regression: a screen and a score of its own.

    τ_drive = J dω/dt + F sign ω + C ω + further laws + rest

Nothing is simulated: slow motion, short records and loops that hide everything in their drive are as good as others.
What the laws explain of the drive's torque is told whatever the free runs say.

=============  ==========================================================================================
`course`       each cycle as it was recorded: time stamps as they are, position, speed, drive's torque
`smooth`       local polynomials, and test functions, on irregular time stamps
`motion`       what laws see: angle, speed, acceleration and torque, sample by sample
`sampled`      the same along courses
`law`, `laws`  what may act: columns of the regression with their names, units and sentences
`along`        laws by position
`links`        the law of a neighbouring axis
`widths`       how wide test functions must be
`rows`         what the regression sees: rows in blocks that can be held out
`integrated`   the balance integrated against test functions: rows of records
`regression`   least squares with held-out blocks and intervals that blocks agree on
`attenuation`  errors in the regressors: what noise takes from each coefficient, undone
`choice`       which laws the records need, and what cannot be told from each
`found`        the answer: laws, how sure each is, what is left
`of_records`   all of it on the records of an axis
`telling`      the balance in words and numbers, and as causes beside those of the free runs
=============  ==========================================================================================
"""
