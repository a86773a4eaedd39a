"""Offline design of a Tube-MPC controller, one module for each step, in the order of the paper's equations.

- :mod:`~hsv.design.inputs`: the design inputs
- :mod:`~hsv.design.model`, with :mod:`hsv.model.lpv.polytopic`: the polytopic model (eq. 10 to 12 and 45)
- :mod:`~hsv.design.disturbance` and :mod:`~hsv.design.region`: the disturbance sets (eq. 13 to 19 and 47)
- :mod:`~hsv.design.error_system` and :mod:`~hsv.design.tube_problem`: the error system (eq. 22 and 23)
- :mod:`~hsv.design.feedback`: the gain F (eq. 24)
- :mod:`~hsv.design.sets`: the invariant set (eq. 25 to 28)
- :mod:`~hsv.design.tightening`: the tightened inputs (eq. 30 and 53)
- :mod:`hsv.lmi.nominal_gain`: the gains K (eq. 31 to 35)
- :mod:`~hsv.design.tube`: the certificate of the tube

:mod:`~hsv.design.baseline` takes these steps for the design of section 3, :mod:`~hsv.design.adjustable` for that of
section 4, Algorithm 1. :mod:`~hsv.design.certified` reads a finished design, and :mod:`~hsv.design.hardware` implements
``hsv certify``. The verification in :mod:`hsv.control` and :mod:`hsv.flight` imports nothing of this package.
"""
