"""Offline design, one module a step, to be read in the order of the paper.

:mod:`~hsv.design.inputs`; :mod:`~hsv.design.model`, (10)-(12) and (45), with :mod:`hsv.model.lpv.polytopic`;
:mod:`~hsv.design.disturbance` and :mod:`~hsv.design.region`, (13)-(19) and (47); :mod:`~hsv.design.error_system` and
:mod:`~hsv.design.tube_problem`, (22) and (23); :mod:`~hsv.design.feedback`, the gain F (24);
:mod:`~hsv.design.sets`, the invariant set (25)-(28); :mod:`~hsv.design.tightening`, (30) and (53);
:mod:`hsv.control.nominal_gain`, the gains K (31)-(35), which the online law solves in flight, too;
:mod:`~hsv.design.tube`, the certificate of the tube. :mod:`~hsv.design.baseline` takes these steps one after the other,
:mod:`~hsv.design.adjustable` those of section 4, Algorithm 1.

:mod:`~hsv.design.certified` reads a design back, and :mod:`~hsv.design.hardware` is ``hsv certify``. The verification,
:mod:`hsv.control.verification` and :mod:`hsv.flight.verification`, uses nothing of this package.
"""
