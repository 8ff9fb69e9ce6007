# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The identification of a recorded run, steps 2 to 6, the paper's way and by joint regression."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from engb_core.errors import InputError
from engb_core.identify.attenuation import below_the_counts
from engb_core.identify.cogging import find_orders
from engb_core.identify.confidence import Estimate
from engb_core.identify.contact import contact_estimate, fit_contacts
from engb_core.identify.giving_up import may_be_given_up
from engb_core.identify.paper_way import load_degree, paper_way, PaperResult
from engb_core.identify.regression import Fit, fit, Form
from engb_core.identify.smoothing import Motion, moving_pieces
from engb_core.model import Cogging, Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import friction_torques, load_torques
from engb_core.recording import Recording

__all__ = ['identify', 'IdentifiedModel']

Array = NDArray[np.float64]
Progress = Callable[[str], None]

# A number whose standard deviation is a larger part of it than this keeps the start's value.
LEAST_PRECISION = 0.3

# ... unless the recording contradicts that value: χ² of two numbers, 1 %.
CONTRADICTION = 9.2

# A contact angle is kept if it makes the fit this much better in BIC ("very strong": Kass and
# Raftery, 1995).
CONTACT_EVIDENCE = 10.0

# A load is seen if a fit with one is better by more than chance makes it: χ², 1 %.
CHANCE = 0.01
NO_LOAD = 'no load seen: left out'

# Lines of cogging looked for.
MOST_LINES = 6

# Orders of cogging that a start model may bring along. The work grows with their cube: 30 take
# 20 s of processor time for a recording of 3 s, and in so little motion they aren't told apart.
MOST_ORDERS = 30


@dataclass(frozen=True)
class IdentifiedModel:
    """What an identification found.

    Attributes:
        model: the identified model; what the recording can't tell is the start model's.
        start: the start model.
        estimates: number, standard deviation and unit by name (see `regression.Form`).
        pieces: the motions that were used.
        paper: the paper's way on the same data.
        regression: the joint regression that `model` comes from.
    """

    model: Model
    start: Model
    estimates: dict[str, Estimate]
    pieces: list[Motion]
    paper: PaperResult
    regression: Fit

    @property
    def load_seen(self) -> bool:
        """Whether a load torque stood out of the strokes; without one the model has none."""
        return all(estimate.remark != NO_LOAD for estimate in self.estimates.values())

    @property
    def pulls_both_ways(self) -> bool:
        """Whether the load pushes one way at some angles and the other way at others, by more
        than the fit misses: a weight or a spring does, a clamp presses back alone."""
        loads = np.concatenate([self.load_torque(piece.position) for piece in self.pieces])
        return bool(min(-loads.min(), loads.max()) > self.regression.rms)

    def load_torque(self, theta: Array) -> Array:
        """Return T_L [N·m] at motor angle `theta` [rad], any shape."""
        return load_torques(nominal_vector(self.model), theta)

    def friction_torque(self, theta: Array, omega: Array) -> Array:
        """Return T_C [N·m] at motor angle `theta` [rad] and velocity `omega` [rad/s]."""
        nominal = nominal_vector(self.model)
        return friction_torques(nominal, load_torques(nominal, theta), omega)

    def summary(self) -> str:
        """Return a table of the identified numbers with 95 % intervals, as text lines."""
        paper = self.paper
        beside = {f'p{power}': value for power, value in enumerate(paper.load.coefficients)}
        beside |= {'coulomb': paper.friction.coulomb, 'load_gain': paper.friction.load_gain,
                   'saturation_velocity': paper.friction.saturation_velocity}
        if self.model.load_torque.contact_angle is not None or 'amplitude' in self.estimates:
            beside = {name: value for name, value in beside.items() if name[0] != 'p'}
        lines = [f'{len(paper.strokes)} clamp and release strokes; residual '
                 f'{1e3 * self.regression.rms:.2f} mN·m below '
                 f'{self.pieces[0].bandwidth:.0f} Hz',
                 *self._no_strokes(),
                 f'{"number":<20} {"identified":>12} {"95 % interval":>27}  {"unit":<10} '
                 f'{"paper way":>11}']
        for name, estimate in self.estimates.items():
            if name.startswith(('sine', 'cosine')):
                continue
            if estimate.remark:
                between = estimate.remark
            elif estimate.determined:
                low, high = estimate.interval()
                between = f'{low:.4g} … {high:.4g}'
            else:
                between = "not determined: start model's"
            other = f'{beside[name]:.4g}' if name in beside else ''
            lines.append(f'{name:<20} {estimate.value:>12.4g} {between:>27}  '
                         f'{estimate.unit:<10} {other:>11}'.rstrip())
        for wave in self.model.cogging:
            lines.append(f'cogging: order {wave.order:g} per revolution, '
                         f'{1e3 * wave.amplitude:.2f} mN·m, phase {wave.phase:.2f} rad')
        return '\n'.join(lines)

    def _no_strokes(self) -> list[str]:
        """Return what is to be said where the recording holds no clamp strokes, in lines."""
        if not self.load_seen:
            return ['no load torque stands out of what moves there and back: these are no clamp '
                    'strokes, or they reach',
                    'no contact; the model has no load, and no friction that grows with it. A '
                    'first model of any motion',
                    'is made by: engb model RECORDING --out model.yaml']
        if self.pulls_both_ways:
            return ['the load pushes one way at some angles and the other way at others: these '
                    'are no clamp strokes, whose',
                    'load presses back alone, or the current sensor has an offset. A first model '
                    'of any motion, which chooses',
                    'the form of the load, is made by: engb model RECORDING --out model.yaml']
        return []


def identify(recordings: Sequence[Recording], model: Model | None = None,
             progress: Progress | None = None,
             prior: Mapping[str, Estimate] | None = None,
             give_up: Callable[[], bool] | None = None) -> IdentifiedModel:
    """Identify the model from recorded clamp and release strokes.

    Args:
        recordings: one or more runs of the same brake.
        model: the start model; J and B of the paper's way come from it, and whatever the
            recordings can't determine. None: the paper's Table 1.
        progress: called with one line of text per step.
        prior: numbers known from elsewhere with their standard deviation, by the names of
            `estimates` (J and B of a step test, say); they join the regression.
        give_up: asked between any two evaluations whether the result is wanted no more.

    Raises:
        InputError: no motion, no clamp stroke with a release after it, or too many orders of
            cogging in the model.
        GivenUp: `give_up` said so.
    """
    with may_be_given_up(give_up):
        return _identified(recordings, model, progress, prior)


def _identified(recordings: Sequence[Recording], model: Model | None, progress: Progress | None,
                prior: Mapping[str, Estimate] | None) -> IdentifiedModel:
    tell = progress or (lambda line: None)
    start = _merged(model or Model())
    pieces = moving_pieces(recordings)
    if not pieces:
        names = ', '.join(recording.name for recording in recordings) or 'no recording'
        raise InputError(f'{names}: no contiguous stretch in motion; record clamp and release '
                         'strokes')
    paper = paper_way(pieces, start)
    tell(f'steps 2 to 6: {len(paper.strokes)} strokes, load to '
         f'{float(np.max(paper.load.torque(paper.parts.position))):.3g} N·m')
    found, contact = _joint(pieces, start, paper, tell, prior)
    bare = _without_load(pieces, found)
    if bare is not None:
        tell('no load torque stands out: fitted without one')
        found, contact = bare, None
    if 'inertia' not in (prior or {}):
        found = _with_inertia_below_the_counts(recordings, pieces, found, tell)
    estimates = dict(found.estimates)
    if contact is not None:
        estimates['contact_angle'] = contact
    return IdentifiedModel(found.model(start), start, estimates, pieces, paper, found)


def _without_load(pieces: list[Motion], found: Fit) -> Fit | None:
    """Return the fit without a load where the strokes meet none that stands out: friction that
    grows with it would be any number."""
    load = _load_names(found)
    bare = fit(pieces, replace(found.form, held=found.form.held | frozenset(load)),
               found.values | dict.fromkeys(load, 0.0))
    evidence = 2.0 * found.effective_samples * np.log(bare.rms / found.rms)
    if evidence >= chi2.isf(CHANCE, len(load)):
        return None
    estimates = {name: replace(value, determined=False, remark=NO_LOAD) if name in load else value
                 for name, value in bare.estimates.items()}
    return replace(bare, estimates=estimates)


def _with_inertia_below_the_counts(recordings: Sequence[Recording], pieces: list[Motion],
                                   found: Fit, tell: Progress) -> Fit:
    """Return the fit with the inertia that the recordings tell below the frequencies at which
    position counts take from it, where they do; all else is told by the whole band."""
    slower = below_the_counts(recordings, pieces, found.form.degree)
    if slower is pieces or 'inertia' in found.form.held:
        return found
    inertia = fit(slower, found.form, found.values).estimates['inertia']
    if not inertia.std < LEAST_PRECISION * abs(inertia.value):
        return found
    tell(f'counts would take from the inertia: taken from what lies below '
         f'{slower[0].bandwidth:.0f} Hz')
    again = fit(pieces, replace(found.form, held=found.form.held | {'inertia'}),
                found.values | {'inertia': inertia.value})
    return replace(again, estimates=again.estimates | {'inertia': inertia})


def _merged(start: Model) -> Model:
    """Return the model with one wave for each order of cogging: two of one order are their sum,
    and no recording tells them apart."""
    waves: dict[float, complex] = {}
    for entry in start.cogging:
        wave = complex(entry.amplitude * np.exp(1j * entry.phase))
        waves[entry.order] = waves.get(entry.order, 0.0) + wave
    if len(waves) > MOST_ORDERS:
        raise InputError(f'the model has cogging of {len(waves)} orders; at most {MOST_ORDERS} '
                         'are identified at once: leave those with the largest amplitudes')
    return replace(start, cogging=tuple(
        Cogging(order, abs(wave), float(np.angle(wave))) for order, wave in waves.items()))


def _load_names(found: Fit) -> list[str]:
    """Return the numbers of load and load friction; the constant p0 alone is an offset."""
    return [name for name in found.values
            if name in ('load_gain', 'amplitude') or name[0] == 'p' and name[1:].isdigit()
            and (name != 'p0' or found.form.contact)]


def _joint(pieces: list[Motion], start: Model, paper: PaperResult, tell: Progress,
           prior: Mapping[str, Estimate] | None) -> tuple[Fit, Estimate | None]:
    """Return the regression, and what is known of the contact (None: no such load)."""
    sinusoid = start.load_torque.form == 'sinusoid'
    form = Form('sinusoid' if sinusoid else 'polynomial', load_degree(start),
                orders=tuple(entry.order for entry in start.cogging))
    guess = _guess(start, paper, sinusoid)
    fastest = max(piece.top_speed for piece in pieces)
    widths = {guess['saturation_velocity'], 0.02 * fastest, 0.1 * fastest}
    best = min((fit(pieces, form, guess | {'saturation_velocity': width})
                for width in sorted(widths)), key=lambda found: found.rms)
    tell(f'joint regression: residual {1e3 * best.rms:.2f} mN·m')
    if sinusoid:
        best = _kept_where_unknown(pieces, _with_cogging(pieces, best, tell), start, tell)
        return _with_prior(pieces, best, prior), None
    # Cogging can hide a contact and a missed contact can look like waves: the waves are looked
    # for in what the best load of all leaves over, then the contact again beside them.
    touched = fit_contacts(pieces, best)
    waved = _with_cogging(pieces, min([best, *touched[:1]], key=lambda found: found.rms), tell)
    if waved.form.orders != form.orders:
        best = fit(pieces, replace(form, orders=waved.form.orders), best.values)
        touched = fit_contacts(pieces, best)
    seen = bool(touched) and _calls_for_contact(best, touched[0], pieces)
    best = _kept_where_unknown(pieces, touched[0] if seen else best, start, tell)
    best = _with_prior(pieces, best, prior)
    if not touched:
        return best, None
    lowest = min(float(piece.position.min()) for piece in pieces)
    if not seen:
        return best, replace(contact_estimate(touched, lowest), determined=False,
                             remark='not determined: without a contact the load fits as well')
    others = [_with_prior(pieces, other, prior) for other in touched[1:]]
    contact = contact_estimate([best, *others], lowest)
    tell(f'contact at {contact.value:.3g} rad: residual {1e3 * best.rms:.2f} mN·m')
    return best, contact


def _with_prior(pieces: list[Motion], found: Fit,
                prior: Mapping[str, Estimate] | None) -> Fit:
    return fit(pieces, found.form, found.values, prior) if prior else found


def _with_cogging(pieces: list[Motion], plain: Fit, tell: Progress) -> Fit:
    """Return the fit with the cogging that stands out of the residual of `plain`.

    One line at a time, everything fitted anew beside it: what the load took of a line before
    would else be left over as another one.
    """
    found = plain
    for _ in range(MOST_LINES):
        new = tuple(order for order in find_orders(pieces, found.residual, at_most=1)
                    if all(abs(order - other) > 0.05 for other in found.form.orders))
        if not new:
            break
        found = fit(pieces, replace(found.form, orders=found.form.orders + new), found.values)
        tell(f'cogging found at order {new[0]:g}: residual {1e3 * found.rms:.2f} mN·m')
    return found


def _guess(start: Model, paper: PaperResult, sinusoid: bool) -> dict[str, float]:
    guess = {'inertia': start.motor.inertia, 'viscous_friction': start.motor.viscous_friction,
             'coulomb': max(paper.friction.coulomb, 0.0), 'load_gain': paper.friction.load_gain,
             'saturation_velocity': paper.friction.saturation_velocity}
    if sinusoid:
        angle = paper.parts.position
        design = np.column_stack([np.sin(angle), np.cos(angle)])
        sine, cosine = np.linalg.lstsq(design, -paper.parts.even, rcond=None)[0]
        guess |= {'amplitude': float(np.hypot(sine, cosine)),
                  'phase': float(np.arctan2(cosine, sine))}
    else:
        guess |= {f'p{power}': value for power, value in enumerate(paper.load.coefficients)}
    for number, entry in enumerate(start.cogging):
        guess |= {f'sine{number}': entry.amplitude * np.cos(entry.phase),
                  f'cosine{number}': entry.amplitude * np.sin(entry.phase)}
    return guess


def _calls_for_contact(plain: Fit, touched: Fit, pieces: list[Motion]) -> bool:
    """Whether the data clearly call for a contact angle."""
    samples = min(plain.effective_samples, touched.effective_samples)
    # The same number of numbers in both forms (contact_angle for p0): BIC is the fit alone.
    evidence = 2.0 * samples * np.log(plain.rms / touched.rms)
    first = min(float(piece.position.min()) for piece in pieces)
    last = max(float(piece.position.max()) for piece in pieces)
    inside = first + 0.02 * (last - first) < touched.values['contact_angle'] < last
    return bool(evidence > CONTACT_EVIDENCE and inside)


def _kept_where_unknown(pieces: list[Motion], best: Fit, start: Model, tell: Progress) -> Fit:
    """Refit with J, B, ω_s at the start's value where the recording can't determine them."""
    own = {'inertia': start.motor.inertia, 'viscous_friction': start.motor.viscous_friction,
           'saturation_velocity': start.friction.saturation_velocity}
    unknown = {name: value for name, value in own.items()
               if not best.estimates[name].std < LEAST_PRECISION * abs(best.values[name])}
    if not unknown:
        return best
    held = fit(pieces, replace(best.form, held=frozenset(unknown)), best.values | unknown)
    # An interval that is wide may still shut the start's value out: then ours is the better one.
    if 2.0 * best.effective_samples * np.log(held.rms / best.rms) > CONTRADICTION:
        return best
    tell('kept from the start model: ' + ', '.join(sorted(unknown)))
    estimates = {name: replace(value, std=best.estimates[name].std) if name in unknown else value
                 for name, value in held.estimates.items()}
    return replace(held, estimates=estimates)
