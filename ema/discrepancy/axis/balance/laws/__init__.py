"""What may act along a motion: columns of the regression, with their names, units and sentences.

`motion` is what laws see: angle, speed, acceleration and torque, sample by sample; a `law` is what one is, and `laws`
gives all of them: those by position (`along`), friction with `memory`, what is `drifting`, and two `links` of which
one is a neighbouring axis. `units` are those of axes that turn and of axes that slide.
"""
