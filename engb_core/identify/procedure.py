"""The identification of a recorded run, steps 2 to 6, the paper's way and by joint regression."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.cogging import find_orders
from engb_core.identify.paper_way import load_degree, paper_way, PaperResult
from engb_core.identify.regression import Fit, fit, Form
from engb_core.identify.smoothing import Motion, motions
from engb_core.identify.uncertainty import Estimate
from engb_core.model import Model
from engb_core.recording import Recording

__all__ = ['identify', 'IdentifiedModel']

Array = NDArray[np.float64]
Progress = Callable[[str], None]

# A number whose standard deviation is a larger part of it than this keeps the start's value.
LEAST_PRECISION = 0.3

# ... unless the recording contradicts that value: χ² of two numbers, 1 %.
CONTRADICTION = 9.2

# A contact angle is kept if it makes the fit this much better in BIC, and visibly (2 % in rms).
CONTACT_EVIDENCE = 10.0
CONTACT_GAIN = 0.02


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

    def load_torque(self, theta: Array) -> Array:
        """Return T_L [N·m] at motor angle `theta` [rad], any shape."""
        load = self.model.load_torque
        theta = np.asarray(theta, float)
        if load.form == 'sinusoid':
            return load.amplitude * np.sin(theta + load.phase)
        beyond = theta if load.contact_angle is None else theta - load.contact_angle
        torque = np.polynomial.polynomial.polyval(beyond, load.coefficients)
        return torque if load.contact_angle is None else np.where(beyond > 0.0, torque, 0.0)

    def friction_torque(self, theta: Array, omega: Array) -> Array:
        """Return T_C [N·m] at motor angle `theta` [rad] and velocity `omega` [rad/s]."""
        friction = self.model.friction
        shape = np.clip(np.asarray(omega, float) / friction.saturation_velocity, -1.0, 1.0)
        return (friction.coulomb + friction.load_gain * np.abs(self.load_torque(theta))) * shape

    def summary(self) -> str:
        """Return a table of the identified numbers with 95 % intervals, as text lines."""
        paper = self.paper
        beside = {f'p{power}': value for power, value in enumerate(paper.load.coefficients)}
        beside |= {'coulomb': paper.friction.coulomb, 'load_gain': paper.friction.load_gain,
                   'saturation_velocity': paper.friction.saturation_velocity}
        if 'contact_angle' in self.estimates or 'amplitude' in self.estimates:
            beside = {name: value for name, value in beside.items() if name[0] != 'p'}
        lines = [f'{len(paper.strokes)} clamp and release strokes; residual '
                 f'{1e3 * self.regression.rms:.2f} mN·m below '
                 f'{self.pieces[0].bandwidth:.0f} Hz',
                 f'{"number":<20} {"identified":>12} {"95 % interval":>27}  {"unit":<10} '
                 f'{"paper way":>11}']
        for name, estimate in self.estimates.items():
            if name.startswith(('sine', 'cosine')):
                continue
            if estimate.determined:
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


def identify(recordings: Sequence[Recording], model: Model | None = None,
             progress: Progress | None = None,
             prior: Mapping[str, Estimate] | None = None) -> IdentifiedModel:
    """Identify the model from recorded clamp and release strokes.

    Args:
        recordings: one or more runs of the same brake.
        model: the start model; J and B of the paper's way come from it, and whatever the
            recordings can't determine. None: the paper's Table 1.
        progress: called with one line of text per step.
        prior: numbers known from elsewhere with their standard deviation, by the names of
            `estimates` (J and B of a step test, say); they join the regression.

    Raises:
        InputError: no motion, or no clamp stroke with a release after it.
    """
    tell = progress or (lambda line: None)
    start = model or Model()
    pieces = [piece for recording in recordings for piece in motions(recording)
              if piece.rows.size and piece.top_speed > 0.0]
    if not pieces:
        names = ', '.join(recording.name for recording in recordings) or 'no recording'
        raise InputError(f'{names}: no contiguous stretch in motion; record clamp and release '
                         'strokes')
    paper = paper_way(pieces, start)
    tell(f'steps 2 to 6: {len(paper.strokes)} strokes, load to '
         f'{float(np.max(paper.load.torque(paper.parts.position))):.3g} N·m')
    found = _joint(pieces, start, paper, tell)
    if prior:
        found = fit(pieces, found.form, found.values, prior)
    return IdentifiedModel(found.model(start), start, found.estimates, pieces, paper, found)


def _joint(pieces: list[Motion], start: Model, paper: PaperResult, tell: Progress) -> Fit:
    sinusoid = start.load_torque.form == 'sinusoid'
    form = Form('sinusoid' if sinusoid else 'polynomial', load_degree(start),
                orders=tuple(entry.order for entry in start.cogging))
    guess = _guess(start, paper, sinusoid)
    fastest = max(piece.top_speed for piece in pieces)
    widths = {guess['saturation_velocity'], 0.02 * fastest, 0.1 * fastest}
    best = min((fit(pieces, form, guess | {'saturation_velocity': width})
                for width in sorted(widths)), key=lambda found: found.rms)
    tell(f'joint regression: residual {1e3 * best.rms:.2f} mN·m')
    # Cogging can hide a contact and a missed contact can look like waves: each is looked for
    # with the other taken out.
    best = _with_cogging(pieces, best, tell)
    if not sinusoid:
        other = _with_contact(pieces, best, paper, tell)
        if other is not best:
            # Lines found while the contact was missed may have been part of its misfit: anew.
            best = _with_cogging(pieces, fit(pieces, replace(other.form, orders=form.orders),
                                             other.values), tell)
    return _kept_where_unknown(pieces, best, start, tell)


def _with_cogging(pieces: list[Motion], plain: Fit, tell: Progress) -> Fit:
    """Return the fit with the cogging that stands out of the residual of `plain`."""
    known = plain.form.orders
    new = tuple(order for order in find_orders(pieces, plain.residual)
                if all(abs(order - other) > 0.05 for other in known))
    if not new:
        return plain
    found = fit(pieces, replace(plain.form, orders=known + new), plain.values)
    tell('cogging found at order ' + ', '.join(f'{order:g}' for order in new)
         + f': residual {1e3 * found.rms:.2f} mN·m')
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


def _with_contact(pieces: list[Motion], plain: Fit, paper: PaperResult, tell: Progress) -> Fit:
    """Return the fit with a contact angle if the data clearly call for one, else `plain`."""
    parts, degree = paper.parts, plain.form.degree
    low, high = np.percentile(parts.position, [2.0, 75.0])
    trials = []
    for angle in np.linspace(low, high, 24):
        beyond = np.maximum(parts.position - angle, 0.0)
        design = beyond[:, None] ** np.arange(1, degree + 1)
        found, *_ = np.linalg.lstsq(design, -parts.even, rcond=None)
        trials.append((float(np.sum((parts.even + design @ found)**2)), angle, found))
    _, angle, found = min(trials, key=lambda trial: trial[0])
    guess = plain.values | {'contact_angle': float(angle)}
    guess |= {f'p{power + 1}': float(value) for power, value in enumerate(found)}
    other = fit(pieces, replace(plain.form, contact=True), guess)
    samples = min(plain.effective_samples, other.effective_samples)
    # The same number of numbers in both forms (contact_angle for p0): BIC is the fit alone.
    evidence = 2.0 * samples * np.log(plain.rms / other.rms)
    first, last = min(parts.position), max(parts.position)
    inside = first + 0.02 * (last - first) < other.values['contact_angle'] < last
    if evidence > CONTACT_EVIDENCE and other.rms < (1.0 - CONTACT_GAIN) * plain.rms and inside:
        tell(f'contact at {other.values["contact_angle"]:.3g} rad: residual '
             f'{1e3 * other.rms:.2f} mN·m')
        return other
    return plain


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
