"""Claims of section 3.3 and of the abstract on the notch filter."""

from __future__ import annotations

from hsv.study.claims import notch_loop, notch_open_loop
from hsv.study.claims.claim import Claim

CLAIMS = (
    Claim(
        "coupling in the pitch rate",
        "From CM (1), it can be seen that the coupling between rigid body states and the flexible modes is mainly "
        "reflected in pitch rate q.",
        "3.3",
        notch_open_loop.coupling_in_pitch_rate,
    ),
    Claim(
        "peaks eliminated",
        "In order to weaken the effect of flexibility, a notch filter is introduced to eliminate the frequency "
        "response peak of flexible modes.",
        "Abstract",
        notch_open_loop.peaks,
    ),
    Claim(
        "peak suppressed",
        "From the figure, it can be seen that the peak caused by the flexible mode is suppressed after the notch "
        "filter is connected into the flexible hypersonic vehicle.",
        "3.3, Figure 3",
        notch_open_loop.suppressed,
    ),
    Claim(
        "second mode partially decreased",
        "Meanwhile, the second-order flexible mode is partially decreased at the edge of notch filter.",
        "3.3, Figure 5",
        notch_open_loop.partially,
    ),
    Claim(
        "other frequencies unaffected",
        "First of all, the principle of notch filter is that the non-notch frequency is not affected, so only the "
        "first flexible mode is filtered out.",
        "3.3",
        notch_open_loop.unaffected,
    ),
    Claim(
        "stable without the notch",
        "The Tube-MPC controller designed above can guarantee the stability of the rigid body states and flexible "
        "states of hypersonic vehicle with actuator faults.",
        "3.3",
        notch_loop.without_notch,
    ),
    Claim(
        "stability is not destroyed",
        "In conclusion, the reasonable choice of notch filter will not destroy the stability of the original system.",
        "3.3",
        notch_loop.not_destroyed,
    ),
    Claim(
        "phase margin",
        "As previously analysed, the appropriate parameter selection of notch filter will not destroy the stability "
        "of the original system, and will even increase the phase margin of the system.",
        "3.3",
        notch_loop.phase_margin,
    ),
    Claim(
        "filtering reduces uncertainty",
        "The filtering of first flexible mode can actually be regarded as the reduction of the model parameter "
        "uncertainty.",
        "3.3",
        notch_loop.less_uncertainty,
    ),
    Claim(
        "states stay in the mRPI set",
        "Therefore, the system states still stay in mRPI set after filtering.",
        "3.3",
        notch_loop.still_in_the_set,
    ),
    Claim(
        "closer to the nominal trajectory",
        "At the same time, compared with the system without notch filter, the position of system states with notch "
        "filter in the mRPI set is closer to the nominal trajectory, as shown in Figure 6.",
        "3.3, Figure 6",
        notch_loop.closer,
    ),
    Claim(
        "better than without",
        "Moreover, the performance of system with notch filter is better than without notch filter.",
        "3.3",
        notch_loop.better,
    ),
    Claim(
        "zeros on the unit circle",
        "The notch is deep enough and has a certain width. All zeros of transfer function of notch filter should be "
        "on the unit circle.",
        "3.3 (1)",
        notch_open_loop.unit_circle,
    ),
    Claim(
        "poles and zeros match",
        "Non-notch frequency signals are unaffected. The zero-pole of transfer function of notch filter must match.",
        "3.3 (2)",
        notch_open_loop.poles_match,
    ),
)
