# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Diagnoses as the tool would give them, of several verdicts, with simulated signals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys

import numpy as np

from engb_core.diagnose.diagnosis import (
    Candidate,
    CauseSet,
    ClosedLoop,
    Diagnosis,
    EffectFinding,
    Evidence,
    Interval,
    NextExperiment,
    NominalChange,
    ParameterEstimate,
    QualityOfFit,
    ResidualOver,
    Trace,
    Unexplained,
    Zone,
)
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model

__all__ = ['ALL', 'consistent', 'empty', 'explained', 'hostile', 'partly', 'prismatic',
           'unexplained']

NOISE = 0.0046
HOSTILE = ('</script><script>alert(1)</script>"\'><img src=x onerror=alert(2)> $\\frac{a}{ '
           '\u202egpj.exe \ud800 &amp; ' + 'very_long_name_' * 14)


def _trace(recording: str, seed: int, seconds: float, held_out: bool, miss, model_left) -> Trace:
    random = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 0.01)
    period = 4.0 + 0.3 * seed
    phase = 2 * np.pi * time / period
    position = 9.0 * (1 - np.cos(phase)) / 2 + 0.5
    velocity = np.gradient(position, time)
    stand = (time % 10.0) > 8.8
    load = 1e-3 * position + 2e-3 * position**2
    friction = (0.012 + 0.11 * load) * np.clip(velocity / 1.5, -1, 1)
    nominal = load + friction + 1.1e-3 * velocity
    missing = miss(position, velocity, load, time)
    noise = np.convolve(random.normal(0, 3 * NOISE, time.size), np.ones(9) / 9, 'same')
    return Trace(recording, held_out, time, position, velocity, nominal + missing + noise,
                 nominal, nominal + missing * (1 - model_left), ~stand, NOISE)


def _stribeck(position, velocity, load, time):
    return ((0.02 + 0.1 * load) * np.exp(-(velocity / 0.8)**2) * np.tanh(velocity / 0.08)
            - 0.006 * np.sign(velocity))


def _over(trace: Trace, coordinate: str, unit: str, values, bins: int, why: str) -> ResidualOver:
    edges = np.linspace(values.min(), values.max(), bins + 1)
    place = np.clip(np.digitize(values, edges) - 1, 0, bins - 1)

    def mean(residual, chosen):
        return np.array([residual[chosen & (place == index)].mean()
                         if np.any(chosen & (place == index)) else np.nan
                         for index in range(bins)])
    before = trace.effort - trace.predicted_before
    after = trace.effort - trace.predicted_after
    up, down = trace.judged & (trace.velocity > 0), trace.judged & (trace.velocity < 0)
    return ResidualOver(coordinate, unit, (edges[1:] + edges[:-1]) / 2, mean(before, up),
                        mean(before, down), mean(after, up), mean(after, down), why)


def _intervals(trace: Trace, limit: float) -> tuple[Interval, ...]:
    energy = np.where(trace.judged, (trace.effort - trace.predicted_before)**2, 0)
    high = np.convolve(energy, np.ones(21) / 21, 'same') > limit**2
    edges = np.flatnonzero(np.diff(np.concatenate([[0], high.astype(int), [0]])))
    return tuple(Interval(trace.recording, float(trace.time[begin]), float(trace.time[end - 1]),
                          float(energy[begin:end].sum() / energy.sum()))
                 for begin, end in zip(edges[::2], edges[1::2], strict=True) if end - begin > 8)


def _loop(trace: Trace, after: float) -> ClosedLoop:
    error = 0.012 * np.sin(3 * trace.time) + 6 * (trace.effort - trace.predicted_before)
    error = np.convolve(error, np.ones(15) / 15, 'same')
    return ClosedLoop(trace.recording, trace.time, trace.position, trace.position + error,
                      trace.position + after * error)


MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-3, 5e-6)),
              friction=Friction(0.0118, 0.112, 1.5),
              controller=Controller(0.05, 0.2, 0.002, 0.6, 1000.0),
              effects=(EffectSetting('stribeck_friction', {'breakaway_ratio': 1.42,
                                                           'stribeck_velocity': 0.81}),))

NOMINAL = (NominalChange('motor.inertia', 6.9e-5, 6.813e-5, 4.1e-7, 'kg·m²'),
           NominalChange('motor.viscous_friction', 9.4e-4, 1.125e-3, 1.3e-5, 'N·m·s/rad'),
           NominalChange('friction.coulomb', 0.0171, 0.0118, 0.00021, 'N·m'),
           NominalChange('friction.load_gain', 0.12, 0.112, 0.003, '-'),
           NominalChange('load_torque.p0', 0.0, 0.00013, None, 'N·m'))


def explained() -> Diagnosis:
    """Stribeck friction on two recordings, one held out."""
    fit = _trace('run1', 1, 60.0, False, _stribeck, 0.05)
    held = _trace('run2_routine_braking', 2, 40.0, True, _stribeck, 0.06)
    times = _intervals(fit, 0.0085) + _intervals(held, 0.0085)
    whole = sum(entry.share for entry in times)
    return Diagnosis(
        'explained',
        (EffectFinding(
            'stribeck_friction', 0.97,
            {'breakaway_ratio': ParameterEstimate(1.42, 0.031, '-'),
             'stribeck_velocity': ParameterEstimate(0.81, 0.04, 'rad/s')}, 0.93,
            (('presliding_friction', 0.02),),
            'Friction is 42 % higher at creep speed than at full speed and falls off within '
            '0.8 rad/s, at every load.'),),
        tuple(replace(entry, share=entry.share / whole * 0.9) for entry in times),
        (Zone('velocity', -2.0, 2.0, 'rad/s', 0.81), Zone('since_reversal', 0.0, 0.9, 'rad', 0.64),
         Zone('load', 0.08, 0.18, 'N·m', 0.41)),
        Unexplained(0.03, (), 'none', False, (), 'What is left is not above the noise floor.'),
        (QualityOfFit('run2_routine_braking', 'effort', 0.0213, 0.0049, 0.0046, 'N·m'),
         QualityOfFit('run2_routine_braking', 'position', 0.312, 0.051, None, 'rad')),
        None, MODEL,
        Evidence((fit, held), (_loop(held, 0.16),),
                 (_over(held, 'velocity', 'rad/s', held.velocity, 29,
                        'Friction that falls as speed rises stands up as two horns beside zero '
                        'speed; a wrong Coulomb or viscous number cannot draw them.'),),
                 (Candidate(('stribeck_friction',), 0.97, 0.0049, 0.93),
                  Candidate(('presliding_friction',), 0.02, 0.0071, 0.74,
                            'follows the travel after a reversal, not the speed'),
                  Candidate(('stribeck_friction', 'friction_drift'), 0.006, 0.0049, 0.932,
                            'no better with one number more'),
                  Candidate(('nonlinear_viscous_friction',), 0.003, 0.0124, 0.51),
                  Candidate(('asymmetric_friction',), 0.0, 0.0205, 0.05),
                  Candidate(('backlash',), 0.0, 0.0188, 0.17),
                  Candidate(('coulomb_friction_error',), 0.0, 0.0172, 0.22),
                  Candidate((), 0.0, 0.0209, 0.02)),
                 NOMINAL,
                 ('run1: 14 samples arrived out of order and were sorted.',
                  'run2_routine_braking: the file ends in the middle of a record; it was salvaged '
                  'up to 39.9 s.'), 3.41))


def partly() -> Diagnosis:
    """Two effects, one with a rival that stays above 10 %, and structure that remains."""
    def miss(position, velocity, load, time):
        return (0.011 * np.sin(7 * position) + 0.3 * load * np.tanh(velocity / 0.2) * 0.2
                + 0.005 * np.sin(2 * np.pi * time / 7.3))
    traces = tuple(_trace(f'stroke_{index}', index, 25.0, index > 3, miss, 0.28)
                   for index in range(1, 6))
    time = np.linspace(0, 12, 600)
    return Diagnosis(
        'partly_explained',
        (EffectFinding(
            'cogging_torque', 0.99, {'order': ParameterEstimate(43.98, 0.004, '1/rev'),
                                     'amplitude': ParameterEstimate(0.0108, 0.0002, 'N·m')},
            0.48, (), 'A torque of 10.8 mN·m repeats 44 times per motor revolution, whatever '
                      'the load.'),
         EffectFinding(
            'load_hysteresis', 0.71, {'hysteresis_ratio': ParameterEstimate(0.043, 0.012, '-')},
            0.24, (('load_dependent_friction', 0.22), ('asymmetric_friction', 0.04)),
            'The caliper gives back less than it took: the loop is 4.3 % of the peak load wide '
            'to each side.',
            causes=CauseSet(0.9, ('load_hysteresis', 'load_dependent_friction'), True))),
        tuple(replace(entry, share=entry.share / 5) for trace in traces
              for entry in _intervals(trace, 0.0105)),
        (Zone('load', 0.1, 0.2, 'N·m', 0.52), Zone('direction', -1.0, 0.0, '-', 0.4)),
        Unexplained(0.28, ('time', 'load'), 'even', False,
                    (Zone('load', 0.12, 0.2, 'N·m', 0.6),),
                    'A slow wave of 5 mN·m with a period near 7.3 s rides on the load torque; '
                    'it is not locked to any angle.'),
        tuple(row for index in (4, 5) for row in (
            QualityOfFit(f'stroke_{index}', 'effort', 0.0112 + index * 1e-4, 0.0068, 0.0046,
                         'N·m'),
            QualityOfFit(f'stroke_{index}', 'position', 0.094, 0.041, None, 'rad'))),
        NextExperiment(
            'Load hysteresis and load-dependent friction differ only in partial loops: friction '
            'turns at once with the direction, hysteresis remembers the turning point.',
            ('load_hysteresis', 'load_dependent_friction'),
            'next_experiment.yaml: nested strokes between 4 and 9 rad, six turning points, 12 s',
            time, 6.5 + 2.5 * np.sin(2.4 * time) * np.exp(-time / 6)),
        MODEL,
        Evidence(traces, tuple(_loop(trace, 0.45) for trace in traces[3:]),
                 (_over(traces[3], 'motor_angle', 'rad', np.mod(traces[3].position, 2 * np.pi), 60,
                        'The same wave in both directions and at every load: only something '
                        'locked to the motor angle draws it.'),
                  _over(traces[3], 'load', 'N·m', 2e-3 * traces[3].position**2, 14,
                        'Applying and releasing part in proportion to the load.')),
                 (Candidate(('cogging_torque', 'load_hysteresis'), 0.71, 0.0068, 0.72),
                  Candidate(('cogging_torque', 'load_dependent_friction'), 0.22, 0.00695, 0.7),
                  Candidate(('cogging_torque', 'asymmetric_friction'), 0.04, 0.0073, 0.66),
                  Candidate(('cogging_torque',), 0.02, 0.0081, 0.48),
                  Candidate(('torque_ripple',), 0.0, 0.0095, 0.3)), NOMINAL, (), 6.2))


def unexplained() -> Diagnosis:
    """Structure that no effect describes."""
    def miss(position, velocity, load, time):
        return 0.02 * np.sin(1.3 * position) * np.tanh(velocity) * (position > 4)
    trace = _trace('recording_07', 3, 30.0, True, miss, 0.3)
    return Diagnosis(
        'unexplained', (), _intervals(trace, 0.011),
        (Zone('position', 4.0, 9.5, 'rad', 0.94), Zone('velocity', 1.0, 7.0, 'rad/s', 0.47)),
        Unexplained(1.0, ('position', 'velocity'), 'odd', True,
                    (Zone('position', 4.0, 7.2, 'rad', 0.61),
                     Zone('position', 7.2, 9.5, 'rad', 0.33)),
                    'Between 4 and 9.5 rad a torque of up to 20 mN·m acts against the motion and '
                    'changes sign twice along the stroke; below 4 rad there is nothing.'),
        (QualityOfFit('recording_07', 'effort', 0.0143, 0.0061, 0.0046, 'N·m'),),
        None, replace(MODEL, effects=()),
        Evidence((trace,), (), (
            _over(trace, 'position', 'rad', trace.position, 36,
                  'Opposite in the two directions, and only beyond 4 rad: friction of a kind '
                  'that changes along the stroke.'),),
            (Candidate(('asymmetric_friction',), 0.06, 0.0121, 0.3),
             Candidate(('load_hysteresis',), 0.03, 0.0124, 0.26), Candidate((), 0.0, 0.0143, 0.0)),
            NOMINAL, (), 4.0))


def consistent() -> Diagnosis:
    """Nothing above the noise floor."""
    trace = _trace('clean', 4, 30.0, True, lambda position, *_: 0 * position, 1.0)
    return Diagnosis(
        'consistent', (), (), (), None,
        (QualityOfFit('clean', 'effort', 0.00468, 0.00466, 0.0046, 'N·m'),
         QualityOfFit('clean', 'position', 0.0213, 0.0211, None, 'rad')), None,
        replace(MODEL, effects=()),
        Evidence((trace,), (_loop(trace, 0.98),),
                 (_over(trace, 'velocity', 'rad/s', trace.velocity, 25,
                        'No curve leaves the noise.'),), (), NOMINAL, (), 2.2))


def empty(verdict: str = 'explained') -> Diagnosis:
    """The least that a diagnosis can hold."""
    effects = (EffectFinding('inertia_error', 0.93, {}, 0.9, (), 'Inertia is 12 % too low.'),)
    return Diagnosis(verdict, effects if 'explained' in verdict and verdict != 'unexplained'
                     else (), (), (), None, (), None, Model())


def hostile() -> Diagnosis:
    """Names, texts and numbers as an attacker or an accident would write them."""
    base = partly()
    trace = replace(base.evidence.traces[0], recording=HOSTILE)
    effort = trace.effort.copy()
    effort[100:140] = np.nan
    effort[200] = np.inf
    trace = replace(trace, effort=effort)
    return replace(
        base, time=tuple(replace(entry, recording=HOSTILE) for entry in base.time),
        where=(Zone(HOSTILE, -np.inf, 3.0, HOSTILE, np.nan),),
        held_out=(QualityOfFit(HOSTILE, 'effort', 0.0, 0.02, None, 'N·m'),
                  QualityOfFit(HOSTILE, HOSTILE, np.nan, np.inf, 0.0, HOSTILE)),
        effects=(EffectFinding(HOSTILE, 1.0, {HOSTILE: ParameterEstimate(1e-12, 3.0, HOSTILE)},
                               1.0, ((HOSTILE, 0.3),), HOSTILE),),
        unexplained=Unexplained(0.3, (HOSTILE,), HOSTILE, True, (), HOSTILE),
        next_experiment=NextExperiment(HOSTILE, (HOSTILE, HOSTILE), HOSTILE),
        evidence=replace(
            base.evidence, traces=(trace, trace),
            closed_loops=tuple(replace(loop, recording=HOSTILE)
                               for loop in base.evidence.closed_loops),
            residual_over=tuple(replace(picture, coordinate=HOSTILE, unit=HOSTILE, why=HOSTILE)
                                for picture in base.evidence.residual_over),
            candidates=(Candidate((HOSTILE,), 1.0, np.nan, np.nan, HOSTILE),),
            nominal=(NominalChange(HOSTILE, 0.0, 1.0, None, HOSTILE),), notes=(HOSTILE,)))


def prismatic() -> Diagnosis:
    """A linear axis: metres and newtons."""
    base = unexplained()
    return replace(
        base, model=Model.from_mapping({
            'format': 'engb-model/1', 'joint': {'name': 'axis', 'type': 'prismatic'},
            'motor': {'inertia': 95.0, 'viscous_friction': 214.0}}),
        held_out=(QualityOfFit('emps', 'effort', 14.3, 6.1, 4.6, 'N'),))


ALL = {'explained': explained, 'partly': partly, 'unexplained': unexplained,
       'consistent': consistent, 'empty': empty, 'hostile': hostile, 'prismatic': prismatic}


def main() -> None:
    """Write every sample into the directory that is given: python -m report.samples DIR."""
    from engb_core.report.page import diagnosis_page
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    backends = sys.argv[2:] or ['plotly', 'matplotlib', 'table']
    for name, make in ALL.items():
        for backend in backends:
            diagnosis_page(make(), backend=backend).write(folder / f'{name}-{backend}.html')


if __name__ == '__main__':
    main()
