"""The axis plant for the discrepancy engine: one inertia or mass with its records.

==============  =====================================================================================
`channels`      which channels of the record are drive, outputs, angle; what is missing is said
`noise`         rms of each channel's noise: declared in the plant file, or estimated from the record
`windows`       records cut into parts that are simulated on their own, with their start states
`pack`          windows of one record in contiguous arrays
`whitening`     free-run residuals → independent standard normal numbers, by the noise's own dynamics
`weak_form`     torque residual along the measured motion, integrated against test functions
`measured`      what searches and the balance need of the plant
`sizes`         typical sizes in the records
`screened`      effects that are tried where the balance shows their law
`lateness`      which of position and speed is late, by these two alone
`candidates`    library effects scaled to this axis, with starts
`cogging`       the order scan
`gear`          the scan for a resonance of a gear that gives
`stamps`        time stamps that vary: whether samples do
`external`      a torque from outside the motor beside its own cogging
`zeros`         angle zeros of records given together
`overlap`       where lines of two records lie over each other
`stretch`       the search for a stretch of other friction
`predictable`   how long windows may be
`fading`        the search for the speed over which friction falls
`linear`        metres and newtons in what is said
`interval`      intervals of 95 % of what was drawn
`between`       what the drive does between samples
`named_laws`    laws of the balance as effects of the library
`agreeing`      free runs and the balance together: what both name
`ruling`        the verdict by the balance, where free runs cannot say
`structure`     terms suggested by the torque residual when no effect explains it
`next_records`  what a balance could not tell, and the records that would
`plausible`     nominal values that no machine has, and what would make them
`plant`         all of it as the engine's `Plant`
==============  =====================================================================================
"""
