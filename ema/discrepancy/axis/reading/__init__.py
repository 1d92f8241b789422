"""What a record of an axis says by itself, without a simulation.

`intake` brings records into the form that the model takes and `channels` says which are drive, outputs and angle;
`undersampled` refuses. `noise` is the rms of each channel, `quiet_drive` takes the drive's away, as far as a record
shows that it is noise (`pushed`: what it does to the speed). `windows` cuts records into parts that are simulated on
their own, with their start states. `measured` is what searches and the balance need of it all, `sizes` what is typical
of it. `lateness`, `stamps` and `ripple` say which sensor is late, whether samples vary or their time stamps alone, and
at which orders the speed does. `local_polynomials` smooths even samples, `smooth` those on time stamps as they are.
"""
