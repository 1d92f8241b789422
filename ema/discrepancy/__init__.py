"""What a simulation gets wrong: compare, name, extend, measure.

The engine knows nothing of motors. It sees a *plant with its records* through the protocol `plant.Plant`:

- ``blocks``: independent parts of the records (cycles, or windows of long ones), the units of cross-validation;
- ``base``: the parameters that are free in every model (the faults k; for an axis, friction and inertia if the
  plant file says so), so that a change of these is never explained away as an effect;
- ``residuals(points, blocks)``: what is left after simulating with the recorded inputs and start states,
  *whitened*: if the model is right, independent standard normal numbers. This is where the plant puts all it knows
  of noise. Points come in batches, so that a plant may run them in lanes or threads;
- ``candidates(point, blocks)``: the effects that could explain a residual, each with the parameters to fit, their
  bounds and where to begin. Called again in every round, since what the data suggest (the order of a cogging line)
  depends on what was found before;
- ``structure(point, blocks)``: terms suggested by the residual itself when no effect explains it, as candidates too;
- ``errors(point, blocks)``: the error an engineer asks for, with its noise floor.

From this the engine derives, in this order and each in its own module:

=============  ======================================================================================
`fitting`      bounded least squares of free parameters on some blocks, in batches of points
`verdict`      is a whitened residual noise?  A calibrated test at several time scales
`selection`    forward selection with every score taken on blocks the parameters were not fitted on; the
               set of what the data cannot tell apart
`rounds`       what is added to a model, dropped from it, or takes the place of something in it
`trust`        how far effects stand out of what is unknown
`examine`      the whole run: verdict, effects, structure, gain  →  `findings.Findings`
=============  ======================================================================================
"""
