# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where the paper's text is wrong or silent, with the derivation of what stands here instead."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ['ERRATA', 'Erratum']


@dataclass(frozen=True)
class Erratum:
    """`place` in the paper, what it `prints`, what is `right`, and `why`."""

    place: str
    prints: str
    right: str
    why: str


ERRATA: tuple[Erratum, ...] = (
    Erratum(
        '(9), (12)', 'F_M ∝ μ − d/r', 'F_M ∝ d/r − μ',
        'From (2), F_Px = F_M·cos β + μ·F_N; from (4), F_Py = F_N − F_M·sin β. Put into (8), '
        'F_Px = (d/r)·F_Py, this is F_M·(cos β + (d/r)·sin β) = (d/r − μ)·F_N. As printed, the '
        'motor would have to pull the pad off a standing disc (μ = 0) to press it on.'),
    Erratum(
        '(10)', 'l₁′·F_M,bs·cos θ_lv = l₂′·F_M', 'l₁′·F_M,bs/cos θ_lv = l₂′·F_M, that is '
        'F_M,bs = F_M·l₂′·cos²θ_lv/l₁',
        'By (16) the nut moves as dx_bs = l₁/cos²θ_lv·dθ_lv, so its power is F_M,bs·l₁/cos²θ_lv·'
        'θ̇_lv and must equal l₂′·F_M·θ̇_lv. As printed, cos²θ_lv of the power is lost without '
        'friction: the lever slides on the nut, which can press only at a right angle to it. At '
        'θ_lv = 3° the difference is 0.3 %.'),
    Erratum(
        '(12)', 'l₁′ where T_L is written from F_N', 'l₁′·cos θ_lv, which is l₁',
        '(10) has l₁′·F_M,bs·cos θ_lv = l₂′·F_M, so F_M,bs = F_M·l₂′/(l₁′·cos θ_lv), and with '
        'l₁′ = l₁/cos θ_lv the denominator is l₁. (12) takes (10) over without the cosine: a '
        'torque too small by cos θ_lv.'),
    Erratum(
        '(2), (4), (9)', 'the lever’s force leans by β', 'by γ = β − θ_lv',
        'It presses at a right angle to its arm, which turns with θ_lv. With γ, and with the '
        'wedge’s slope w = d·cos θ_g/(r + d·sin θ_g) from (7) for d/r, T_L·dθ_M = F_N·(dy_p − '
        'μ·dx_p) holds exactly: input work is work on the caliper less the disc’s.'),
    Erratum(
        '(8), (9), (44)', 'd/r for the wedge’s slope', 'w = d·cos θ_g/(r + d·sin θ_g)',
        'The text calls the small-angle error negligible below 5°. For the travel it is (under '
        '2 %), but the slope falls by about d/r·θ_g, 3.4 % at 4.4°; a pad friction worked '
        'out with d/r is too large by as much.'),
    Erratum(
        '(14)', 'θ_bs = N_g·θ_M, N_g = r₂/r₁', 'θ_bs = θ_M/N_g',
        'Wheels that roll on each other have r₁·θ_M = r₂·θ_bs. (11) divides the torque by N_g; '
        'were the speed multiplied by it too, N_g² of the power would be lost.'),
    Erratum(
        '(13)', '|T_sf + C₁(F_cl)|', 'T_sf + C₁(F_N)',
        'F_cl and F_N are one quantity, the clamp force. The bracket is the largest torque that '
        'friction can hold; the difference T_m − T_L is what it has to hold.'),
    Erratum(
        '(13)', 'no word on how large T_sf is', 'T_sf ≥ C₀',
        'Between the middle line, which sticks, and the last, which lets go, friction would else '
        'jump up as the shaft begins to move, and the shaft would stick again at once. The second '
        'brake here has T_sf = 1.5·C₀, and sticks by this equation.'),
    Erratum(
        '(39), (40)', '−ΔJ·ω̇ among the even parts, “negligible”; nothing of it in (40)',
        'even only if clamp and release accelerate alike',
        'Over clamp followed by release the reference’s acceleration mirrors evenly, so what J is '
        'too large by is taken off the load: with the J of Table 1 and that of the simulated '
        'motor 0.7 mN·m at 60 rad/s², too little load in the lower half of a stroke and too much '
        'in the upper. Where tracking is poor the accelerations at one position differ, and half '
        'the difference stands in the odd part, which (40) does not list. See the figure after '
        '12.'),
    Erratum(
        'text below (7), (14), (22)', 'r, r₁, r₂ are diameters', 'radii',
        'In (19) the pad rolls r·θ_g; a circle of diameter r would roll half of that.'),
    Erratum(
        'text below (18)', 'l₁, hinge to the pad’s point of contact', 'l₂',
        'l₁ is the arm to the nut, in (10) and (16); the pad’s arm in (17), (18) is l₂.'),
    Erratum(
        '(32)', '[θ_R(k)], j = 1…M', '[θ_R(j)]',
        'The grid has M points numbered by j; k numbers the N samples of (31).'),
    Erratum(
        'text above (43)', '“substituted in Equation (43) to calculate the coefficient of '
        'friction”', '(44)', '(43) holds P and the cubic only; μ and d/r stand in (44).'),
    Erratum(
        '(29)', 'e = θ − θ_d', 'e = θ_d − θ',
        'With positive gains in (28) and u = u_ff + u_fb, a positive e must push the motor '
        'towards θ_d; as printed the feedback is positive and unstable.'),
    Erratum(
        '(33)', 'equal maxima and minima of both strokes', 'the range that both cover',
        'Tracking differs between clamping and releasing, so the recorded ranges are never equal; '
        'θ_R can only cover their intersection.'),
    Erratum(
        '(37), (38)', 'd̂(M − j + 1) within j = 1…M', 'within clamp and release together, 2M',
        'Mirrored are clamp and release: sample j of the clamp stroke belongs to sample '
        '2M − j + 1 of both, the release at the same position. Within M alone the mirror image '
        'would be another position of the same stroke.'),
    Erratum(
        '(40)', '−ΔB·ω is negligible', 'only if B was found apart from Coulomb friction',
        'A step test read as a linear motor has ω_∞ = (u − C)/B and so B = u/ω_∞ too large by '
        'u/(u − C). What is too much in B·ω is then missing from Ĉ₀: see the table of biases.'),
    Erratum(
        '(41)', 'p₃θ³ + p₂θ³ + p₁θ³ + p₀, unsquared', 'Σ(−d̂_even − (p₃θ³ + p₂θ² + p₁θ + p₀))²',
        'Three terms in θ³ can’t be told apart, and a sum of signed differences has no minimum.'),
    Erratum(
        '(42)', 'unsquared', 'Σ(−d̂_odd − (C₀ + C₁·T̂_L)·sgn ω)²', 'As (41).'),
    Erratum(
        'Figures 15, 16', 'the width over which friction saturates is read off the data',
        'the observer’s low-pass widens it',
        'q in (30) smears the sign of ω over its own width: at 60 rad/s² a 20 Hz low-pass turns a '
        'jump into a ramp of 1 rad/s (10 to 90 %). A model passed through the same filter as the '
        'data gives the width itself: see ω_s in the table of numbers.'),
    Erratum(
        'text above Figure 20', '“Figures 20 and 21 show the observed even disturbance and odd '
        'disturbance, respectively”', 'Figure 20 is the odd, Figure 21 the even part',
        'So say their captions.'),
    Erratum(
        '(44)', 'P = (d/r)/((d/r) − μ)', 'P = ((d/r) − μ)/(d/r)',
        'P compares load torques at equal θ (43), hence at equal clamp force; by (12) corrected '
        'they stand as d/r − μ to d/r. The printed ratio is that of clamp forces at equal torque. '
        'With P = 0.421 and μ = 0.249 the corrected form gives a slope of 0.430, the printed one '
        'a negative d/r.'),
)
