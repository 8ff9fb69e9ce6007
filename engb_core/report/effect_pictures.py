# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The picture that an engineer draws for an effect: measured points, the model before and after.

Each kind subtracts from effort what is not of interest, with the corrected model's numbers, and
from the model's own effort before and after the same: the distance between points and curves is
what the model misses, whatever was subtracted. An effect names its kind (`Effect.picture`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import Trace
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.report.figures import Axis, Figure, Line, Panel, Points, Series
from engb_core.report.pictures import AFTER, BEFORE, broken, Units
from engb_core.report.wording import scaled

__all__ = ['KINDS', 'effect_pictures']

Array = NDArray[np.float64]

# Bins of a curve, and of one over a turn, on which a wave repeats many times; samples that make a
# point of it.
_BINS, _TURN_BINS, _FEWEST = 28, 96, 4
# Power that is none, beside effort's square: what rounding leaves [1/Hz].
_NOTHING = 1e-20
# How much of a reversal is shown [s].
_BESIDE = 0.6


def effect_pictures(effect: str, traces: Sequence[Trace], model: Model,
                    units: Units) -> list[Figure]:
    """Return the pictures of an effect, those whose coordinates the recordings hold."""
    traces = [trace for trace in traces if trace.channels and trace.time.size > 2 * _FEWEST]
    if not traces:
        return []
    signals = _Signals(effect, traces, model, units)
    found = [KINDS[name](signals) for name in get_effect(effect).picture.split()]
    return [figure for figure in found if figure is not None]


class _Signals:
    """All recordings' signals end to end, and what is left of effort when parts are taken off."""

    def __init__(self, effect: str, traces: Sequence[Trace], model: Model, units: Units) -> None:
        self.effect, self.traces, self.model, self.units = effect, traces, model, units
        self.title = get_effect(effect).title
        self.velocity = np.concatenate([trace.velocity for trace in traces])
        self.position = np.concatenate([trace.position for trace in traces])
        self.time = np.concatenate([trace.time for trace in traces])
        self.curves = [np.concatenate([getattr(trace, name) for trace in traces])
                       for name in ('effort', 'predicted_before', 'predicted_after')]

    def __getitem__(self, name: str) -> Array:
        return np.concatenate([trace.channels[name] for trace in self.traces])

    def has(self, name: str) -> bool:
        return all(name in trace.channels for trace in self.traces)

    @property
    def inertia(self) -> Array:
        return self.model.motor.inertia * self['acceleration']

    @property
    def viscous(self) -> Array:
        return self.model.motor.viscous_friction * self.velocity

    def friction(self) -> list[Array]:
        """Recorded, before, after: effort less inertia, load and what other effects add, against
        the motion positive."""
        known = self.inertia + self['model_load']
        others = self._others()
        # The model as given lacks what the others add.
        return [np.sign(self.velocity) * (curve - known - added) for curve, added in
                zip(self.curves, (others, np.zeros(others.size), others), strict=True)]

    def _others(self) -> Array:
        """Return what all effects beside this one add to the effort (m,) [N·m]; what acts by the
        load is in the model's load already."""
        total = np.zeros(self.time.size)
        for setting in self.model.effects:
            name = f'without:{setting.effect}'
            if (setting.effect != self.effect and self.has(name)
                    and not {'load', 'shift'} & set(get_effect(setting.effect).stages)):
                total = total + self.curves[2] - self[name]
        return total

    def dry(self) -> list[Array]:
        return [curve - np.abs(self.viscous) for curve in self.friction()]

    def load(self) -> list[Array]:
        """Recorded, before, after: effort less inertia and friction of the corrected model."""
        known = self.curves[2] - self['model_load']
        return [curve - known for curve in self.curves]

    def added(self) -> list[Array]:
        """Recorded, before, after: effort less all that the corrected model has but the effect."""
        name = f'without:{self.effect}'
        known = self[name] if self.has(name) else self.curves[2]
        return [curve - known for curve in self.curves]


def _over(signals: _Signals, x: Array, axis: Axis, curves: list[Array], label: str,
          unit: str, why: str, groups: Sequence[tuple[str, NDArray[np.bool_]]] | None = None,
          bins: int = _BINS) -> Figure | None:
    """Means in bins of x: points measured, curves of both models, one set for each group."""
    if groups is None:
        groups = (('applying', signals.velocity > 0), ('releasing', signals.velocity < 0))
    good = np.isfinite(x) & np.all(np.isfinite(curves), axis=0)
    if axis.log:
        good &= x > 0
    if np.count_nonzero(good) < _FEWEST * 4:
        return None
    low, high = np.quantile(x[good], [0.004, 0.996])
    if axis.log:
        low = max(low, 1e-3 * high)
        edges = np.geomspace(low, high, bins + 1) if low < high else np.array([])
    else:
        edges = np.linspace(low, high, bins + 1)
    if edges.size == 0 or not np.all(np.diff(edges) > 0):
        return None
    place = np.digitize(x, edges) - 1
    binned = {}
    for name, rows in groups:
        rows = rows & good & (place >= 0) & (place < bins)
        count = np.bincount(place[rows], minlength=bins)
        keep = count >= _FEWEST
        if not keep.any():
            continue
        means = [np.bincount(place[rows], curve[rows], bins)[keep] / count[keep]
                 for curve in curves]
        centre = np.bincount(place[rows], x[rows], bins)[keep] / count[keep]
        binned[name] = (centre, means)
    if not binned:
        return None
    largest = max(float(np.max(np.abs(mean))) for _, means in binned.values() for mean in means)
    factor, unit = scaled(largest, unit)
    series: list[Series] = []
    several = len(binned) > 1
    for index, (name, (centre, means)) in enumerate(binned.items()):
        told = f', {name}' if several and name else ''
        dash = 'solid' if index == 0 else 'dot'
        measured, before, after = (factor * mean for mean in means)
        series.append(Line(f'{BEFORE}{told}', centre, before, 'before', dash=dash))
        if signals.units.corrected:
            series.append(Line(f'{AFTER}{told}', centre, after, 'after', dash=dash, width=2.2))
        series.append(Points(f'measured{told}', centre, measured, 'recorded',
                             marker=('up', 'down')[index] if several else 'circle'))
    return Figure(f'{signals.title}: {label[:1].lower() + label[1:]} over {axis.label.lower()}',
                  axis, (Panel(Axis(label, unit), tuple(series), 250, zero=True),),
                  alt=f'{label} over {axis.label.lower()}: measured points, the model as given '
                      'and the corrected model.', caption=why)


def _friction_over(name: str, label: str, *, viscous: bool, sides: bool = True, log: bool = False,
                   why: str = '') -> Callable[[_Signals], Figure | None]:
    def draw(signals: _Signals) -> Figure | None:
        units = signals.units
        axis = {'speed': Axis('Speed', units.velocity, log=log),
                'load': Axis('Load', units.effort), 'time': Axis('Time', 's'),
                'since_reversal': Axis('Travel since the reversal', units.position)}[name]
        x = (np.abs(signals.velocity) if name == 'speed' else
             np.abs(signals['model_load']) if name == 'load' else signals[name])
        if name == 'since_reversal':
            # What a reversal does is over after a part of the stroke.
            x = np.where(x < 0.3 * np.nanmax(x), x, np.nan)
        if name in ('load', 'time'):
            # Slower, dry friction is not full, whatever the load.
            slides = np.abs(signals.velocity) > signals.model.friction.saturation_velocity
            x = np.where(slides, x, np.nan)
        groups = None if sides else (('', np.ones(x.size, bool)),)
        return _over(signals, x, axis, signals.friction() if viscous else signals.dry(), label,
                     units.effort, why, groups)
    return draw


def _load_over_position(signals: _Signals) -> Figure | None:
    groups: Sequence[tuple[str, NDArray[np.bool_]]] | None = None
    if signals.effect in ('self_energizing', 'contact_shift', 'load_stiffness_error'):
        groups = (('', np.ones(signals.time.size, bool)),)
        if signals.has('disc_speed'):
            turns = np.abs(signals['disc_speed']) > 0.05 * np.max(np.abs(signals['disc_speed']))
            if turns.any() and not turns.all():
                groups = (('disc turning', turns), ('disc standing', ~turns))
    return _over(signals, signals.position, Axis('Position', signals.units.position),
                 signals.load(), 'Load', signals.units.effort,
                 'Effort less inertia and friction of the corrected model: the load curve, each '
                 'way.', groups)


def _load_over(name: str, axis: Axis) -> Callable[[_Signals], Figure | None]:
    def draw(signals: _Signals) -> Figure | None:
        if not signals.has(name):
            return None
        return _over(signals, signals[name], axis, signals.added(),
                     f'What it adds to the {signals.units.effort_name}', signals.units.effort,
                     'Effort less all that the corrected model has but this effect.',
                     (('', np.ones(signals.time.size, bool)),))
    return draw


def _load_ratio_over(name: str, axis: Axis) -> Callable[[_Signals], Figure | None]:
    def draw(signals: _Signals) -> Figure | None:
        if not signals.has(name):
            return None
        nominal = signals['load']
        loaded = np.abs(nominal) > 0.2 * np.max(np.abs(nominal), initial=0.0)
        if not loaded.any():
            return None
        with np.errstate(all='ignore'):
            curves = [np.where(loaded, curve / nominal, np.nan) for curve in signals.load()]
        return _over(signals, signals[name], axis, curves, 'Load over that of the load curve', '-',
                     'One is the corrected model\'s load curve; samples with more than a fifth of '
                     'the largest load.', (('', np.ones(nominal.size, bool)),))
    return draw


def _load_ratio(signals: _Signals) -> Figure | None:
    # Over whichever changes more of the two, as a part of its largest.
    spread = {name: np.ptp(signals[name]) / max(np.max(np.abs(signals[name])), 1e-9)
              for name in ('disc_speed', 'pad_temperature') if signals.has(name)}
    if not spread:
        return None
    name = max(spread, key=lambda key: spread[key])
    axis = Axis('Disc speed', 'rad/s') if name == 'disc_speed' else Axis('Pad temperature', '°C')
    return _load_ratio_over(name, axis)(signals)


def _torque_over_acceleration(signals: _Signals) -> Figure | None:
    known = signals.curves[2] - signals.inertia
    return _over(signals, signals['acceleration'],
                 Axis('Acceleration', f'{signals.units.velocity[:-2]}/s²'),
                 [curve - known for curve in signals.curves], 'Accelerating torque',
                 signals.units.effort, 'The slope is the inertia.',
                 (('', np.ones(signals.time.size, bool)),))


def _torque_over_effort(signals: _Signals) -> Figure | None:
    name = f'without:{signals.effect}'
    if not signals.has(name):
        return None
    needed, effort = signals[name], signals.curves[0]
    # The corrected model turns torque into the effort that it takes: over that effort.
    after = np.interp(effort, *_means(signals.curves[2], needed))
    return _over(signals, effort, Axis('Recorded effort', signals.units.effort),
                 [needed, effort, after], 'Torque that the motion needs', signals.units.effort,
                 'On the straight line, torque is the recorded effort: current × torque constant.',
                 (('', np.ones(effort.size, bool)),))


def _means(x: Array, y: Array) -> tuple[Array, Array]:
    """Return means of y over equally many samples each in order of x."""
    order = np.argsort(x)
    parts = np.array_split(order, max(min(order.size // _FEWEST, 4 * _BINS), 1))
    return (np.array([x[part].mean() for part in parts]),
            np.array([y[part].mean() for part in parts]))


def _orders(signals: _Signals) -> Figure | None:
    """What it adds, over order: amplitudes by least squares of sine and cosine of each order."""
    added = signals.added()
    orders = np.arange(0.5, 30.25, 0.25)
    axis = Axis('Order', 'cycles per motor revolution')
    if not signals.has('motor_angle'):
        # Along a line a period has no natural length: thirty radians of a wave on the stroke.
        orders = orders * 30.0 / max(float(np.ptp(signals.position)), 1e-12)
        axis = Axis('Wave number', '1/m')
    amplitudes = []
    for curve in added[:1] + added[2:]:
        found = []
        for order in orders:
            base = np.stack([np.sin(order * signals.position), np.cos(order * signals.position),
                             np.ones(signals.position.size)], 1)
            found.append(np.hypot(*np.linalg.lstsq(base, curve, rcond=None)[0][:2]))
        amplitudes.append(np.array(found))
    factor, unit = scaled(float(np.max(amplitudes)), signals.units.effort)
    return Figure(f'{signals.title}: orders', axis, (Panel(
        Axis('Amplitude', unit), (
            Line(AFTER, orders, factor * amplitudes[1], 'after', width=2.2),
            Points('measured', orders, factor * amplitudes[0], 'recorded')), 220, zero=True),),
        alt='Amplitude over order of what the effect adds, measured and of the corrected model.',
        caption='A line that stands still over speed is locked to the position.')


def _one_turn(signals: _Signals) -> Figure | None:
    if not signals.has('motor_angle'):
        return None
    return _over(signals, signals['motor_angle'], Axis('Motor angle', 'rad'), signals.added(),
                 'Torque over one turn', signals.units.effort,
                 'Effort less all that the corrected model has but this effect.',
                 (('', np.ones(signals.time.size, bool)),), _TURN_BINS)


def _spectrum(signals: _Signals) -> Figure | None:
    trace = max(signals.traces, key=lambda entry: entry.time.size)
    step = float(np.median(np.diff(trace.time)))
    even = np.arange(trace.time[0], trace.time[-1], step)
    lines: list[Series] = []
    name = f'without:{signals.effect}'
    known = trace.channels.get(name, trace.predicted_after)
    curves = ((trace.effort - known, 'measured', 'recorded', 1.4),
              (trace.predicted_before - known, BEFORE, 'before', 1.4),
              (trace.predicted_after - known, AFTER, 'after', 2.2))
    from scipy.signal import welch
    caption = ''
    for values, told, colour, width in curves:
        length = min(even.size, max(64, round(2.0 / step)))
        frequency, power = welch(np.interp(even, trace.time, values), 1.0 / step,
                                 nperseg=length)
        if np.max(power[1:]) <= _NOTHING * np.max(np.square(trace.effort)):
            caption = f'The {told} has nothing of it.'
            continue
        lines.append(Line(told, frequency[1:], np.sqrt(power[1:]), colour, width=width))
    axis = Axis('Amplitude density', f'{signals.units.effort}/√Hz', log=True)
    return Figure(f'{signals.title}: spectrum of what it adds',
                  Axis('Frequency', 'Hz', log=True), (Panel(axis, tuple(lines), 240),),
                  alt='Spectrum of what the effect adds, measured, before and after.',
                  caption=caption)


def _around(signals: _Signals, size: Callable[[Trace], Array]) -> tuple[Trace, NDArray[np.bool_]]:
    """Return the recording and the samples beside the place where `size` is largest."""
    trace = max(signals.traces, key=lambda entry: float(np.nanmax(size(entry))))
    middle = trace.time[int(np.nanargmax(size(trace)))]
    return trace, np.abs(trace.time - middle) < _BESIDE


def _one_motion(trace: Trace, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of the chosen samples, keep the longest motion without a standstill."""
    step = np.diff(trace.time, prepend=trace.time[:1])
    motion = np.cumsum(step > 3.0 * np.median(step))
    kept: NDArray[np.bool_] = rows & (motion == np.bincount(motion[rows]).argmax())
    return kept


def _effort_panel(trace: Trace, rows: NDArray[np.bool_], units: Units) -> Panel:
    return Panel(Axis(f'Motor {units.effort_name}', units.effort), (
        Points('measured', trace.time[rows], trace.effort[rows], 'recorded'),
        Line(BEFORE, trace.time[rows], broken(trace.time[rows], trace.predicted_before[rows]),
             'before', dash='dash'),
        Line(AFTER, trace.time[rows], broken(trace.time[rows], trace.predicted_after[rows]),
             'after', width=2.2)), 190, zero=True)


def _backlash(signals: _Signals) -> Figure | None:
    trace, rows = _around(signals, lambda entry: np.abs(np.gradient(
        entry.channels['model_shift'])))
    units = signals.units
    shift = trace.channels['model_shift']
    middle = 0.5 * (shift.min() + shift.max())
    return Figure(
        f'{signals.title}: both sides at a reversal', Axis('Time', 's'),
        (Panel(Axis('Angle', units.position), (
            Points('motor, measured', trace.time[rows], trace.position[rows], 'recorded'),
            Line('load side, corrected model', trace.time[rows],
                 broken(trace.time[rows], (trace.position + shift - middle)[rows]), 'after',
                 width=2.2)), 170),
         _effort_panel(trace, rows, units)),
        alt='Angles of motor and load side at a reversal, and the motor torque there.',
        caption='The load side is not measured: it is what the corrected model makes of it, from '
                'the middle of the gap.')


def _lag(signals: _Signals) -> Figure | None:
    trace, rows = _around(signals, lambda entry: np.abs(np.gradient(entry.effort)))
    rows = _one_motion(trace, rows)
    return Figure(f'{signals.title}: the steepest change of effort', Axis('Time', 's'),
                  (_effort_panel(trace, rows, signals.units),),
                  alt='Recorded and modelled effort where it changes fastest.',
                  caption='Late torque shows as a curve that lies beside the points by the same '
                          'time everywhere.')


_AXIS_DISC = Axis('Disc angle', 'rad')

KINDS: dict[str, Callable[[_Signals], Figure | None]] = {
    'friction_over_speed': _friction_over(
        'speed', 'Friction', viscous=True, log=True,
        why='Effort less inertia and load; friction counts against the motion.'),
    'friction_over_load': _friction_over(
        'load', 'Dry friction', viscous=False,
        why='Effort less inertia, load and drag: the slope is friction per load.'),
    'friction_over_time': _friction_over(
        'time', 'Dry friction', viscous=False, sides=False,
        why='Effort less inertia, load and drag.'),
    'friction_since_reversal': _friction_over(
        'since_reversal', 'Dry friction', viscous=False,
        why='Friction builds up behind each reversal.'),
    'load_over_position': _load_over_position,
    'load_over_disc_angle': _load_over('disc_angle', _AXIS_DISC),
    'load_over_hold': _load_ratio_over('in_contact', Axis('Time in contact', 's')),
    'load_ratio': _load_ratio,
    'orders': _orders, 'one_turn': _one_turn, 'spectrum': _spectrum,
    'backlash': _backlash, 'lag': _lag,
    'torque_over_acceleration': _torque_over_acceleration,
    'torque_over_effort': _torque_over_effort,
}
