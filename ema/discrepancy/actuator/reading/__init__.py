"""What a record of an actuator says by itself, without a simulation.

`cycles` checks and groups the records (`measured`), `checks` refuses; `features` reduces a cycle to balances that
feel physics. `conditions`, `supply`, `sampling`, `resolution`, `clipping`, `thinning` and `zeros` read what is no
flaw of the actuator, `delays`, `gear`, `play` and `held` where a fit is to begin. `weak` and `structure` say where a
residual is odd, `controller` whether another one than the plant file's was at work.
"""
