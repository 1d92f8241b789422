"""One answer of free runs and the balance of torque.

`agreeing` takes both together: what both name, and what the balance alone shows `beside` what free runs found, where
they are a `witness` of it. `ruling` is the verdict by the balance, where free runs cannot say; `named_laws` are its
laws as effects of the library. `external` sets a torque from outside the motor beside its own cogging.
"""
