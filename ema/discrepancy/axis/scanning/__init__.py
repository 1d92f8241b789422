"""What the torque along the measured motion shows before anything is fitted.

`weak_form` is the torque that the plant file's numbers leave, integrated against test functions. It is searched for
lines per turn (`cogging`), for the speed over which friction falls (`fading`), for a `stretch` of other friction, for
friction that changes over a turn (`rubbing`), and for terms without a name (`structure`). Angle `zeros` of records
given together are where their lines lie over each other (`overlap`).
"""
