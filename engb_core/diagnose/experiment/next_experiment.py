# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What to measure next: the reference on which what was chosen and its rivals part: effects, laws.

A family of segments (segments.py), within what was recorded (room.py), is run on the chosen fit in
closed loop (rehearsal.py). Those are combined whose motion the rivals can't explain with refitted
numbers (score.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import EffectFinding, NextExperiment
from engb_core.diagnose.experiment.rehearsal import rehearsed
from engb_core.diagnose.experiment.room import Room, room_of
from engb_core.diagnose.experiment.score import alone, combined, known_of, parts_of
from engb_core.diagnose.experiment.segments import Course, course_of, Segment, segments_of
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import Problem
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['law_experiment', 'next_experiment', 'NOT_TOLD_APART']

Array = NDArray[np.float64]

# An alternative from this probability on calls for an experiment.
NOT_TOLD_APART = 0.1
# Rivals that a reference is made for.
MOST_RIVALS = 3
LONGEST = 40.0
# Below this separation (rms, noise = 1) no reference within the recorded range settles it.
TOO_LITTLE = 0.4
PROPER = ('stribeck', 'coulomb')
# Coordinates of laws that pass but once, and those of the disc.
PASSING, OF_THE_DISC = {'time', 'distance', 'heat'}, {'disc_speed', 'disc_angle'}


@dataclass(frozen=True)
class _Rivalry:
    """What was chosen and what may be in its place, as a person says it, and the other's fit."""

    chosen: str
    other: str
    fit: Fit


def next_experiment(fitter: Fitter, chosen: Fit, findings: Sequence[EffectFinding],
                    rivals: Sequence[Fit]) -> NextExperiment | None:
    """Return the reference that tells the chosen effects from those that may be instead.

    Args:
        fitter: of the recordings.
        chosen: the fit that the findings stand for.
        findings: what is claimed, with alternatives.
        rivals: fits of other sets of effects; an alternative's fit is looked for here.

    Returns:
        None where no alternative has a probability above 0.1.
    """
    told = sorted(((probability, finding.effect, name) for finding in findings
                   for name, probability in finding.alternatives
                   if probability > NOT_TOLD_APART), key=lambda entry: -entry[0])
    if not told:
        return None
    names = tuple(dict.fromkeys(name for _, *pair in told for name in pair))
    pairs = [_Rivalry(_title(effect), _title(name), fit) for _, effect, name in told
             if (fit := _fit_of(chosen, effect, name, rivals)) is not None][:MOST_RIVALS]
    early_and_late = any(get_effect(name).reveals == 'time' for name in names)
    try:
        course, words, apart = _proposal(fitter, chosen, pairs,
                                         _disc_speeds(fitter, _need_a_disc(fitter, names)),
                                         early_and_late)
    except (InputError, np.linalg.LinAlgError):
        return NextExperiment(
            f'{_listed(names)} fit these recordings alike.', names,
            'no reference could be worked out from these recordings: record strokes of several '
            'lengths and speeds, with reversals under load and without')
    return NextExperiment(_reason(pairs, apart), names, words, course.time, course.position)


def law_experiment(fitter: Fitter, chosen: Fit, law: str, rivals: Sequence[tuple[str, Fit]],
                   coordinates: Sequence[str]) -> NextExperiment | None:
    """Return the reference on which a law and others that do as well part.

    Args:
        fitter: of the problem that all were fitted to.
        chosen: the fit with the law.
        law: its formula.
        rivals: formulas and finished fits of those that do as well.
        coordinates: of all of these laws.

    Returns:
        None where there is no rival, or no reference that the recordings allow.
    """
    pairs = [_Rivalry(law, formula, fit) for formula, fit in rivals][:MOST_RIVALS]
    if not pairs:
        return None
    try:
        course, words, apart = _proposal(
            fitter, chosen, pairs, _disc_speeds(fitter, bool(OF_THE_DISC & set(coordinates))),
            bool(PASSING & set(coordinates)))
    except (InputError, np.linalg.LinAlgError):
        return None
    parted = [pair.other for pair, distance in zip(pairs, apart, strict=True)
              if distance >= TOO_LITTLE]
    return NextExperiment(_reason(pairs, apart),
                          (law, *(parted or [pair.other for pair in pairs])), words,
                          course.time, course.position)


def _proposal(fitter: Fitter, chosen: Fit, pairs: list[_Rivalry], disc: tuple[float, ...],
              early_and_late: bool) -> tuple[Course, str, list[float]]:
    """Return the reference, in words as well, and by how much each pair is apart on it (rms,
    noise = 1)."""
    if not pairs:
        raise InputError('no fit of a rival is at hand')
    model = chosen.hypothesis.corrected(chosen.vector)
    room = room_of(fitter.problem, model, _slowest(fitter))
    family = segments_of(room)
    if not family:
        raise InputError('no segment fits what was recorded')
    fits = [pair.fit for pair in pairs]
    known = [known_of(fitter, fit) for fit in fits]
    tried = course_of(room, family)
    trial = _trial(fitter, model, tried, disc)
    parts = parts_of(fitter, chosen, fits, known, trial, tried.spans)
    lengths = np.array([end - begin for begin, end in tried.spans])
    longest = LONGEST - 3.0 - (float(lengths.max()) if early_and_late else 0.0)
    counts = combined(parts, lengths, _harmless(fitter, trial, tried, room), longest)
    order = [index for index in np.argsort(-alone(parts, lengths)) if counts[index]]
    picked = [family[index] for index in order for _ in range(int(counts[index]))]
    if early_and_late:
        # What changes with time shows in the same stroke, early and late.
        picked = [*(entry for entry in picked if entry is not picked[0]), picked[0]]
        picked.insert(0, picked[-1])
    course = course_of(room, picked)
    while course.duration > LONGEST and len(picked) > 2:
        # The ways between segments depend on their order.
        picked.pop(-2 if early_and_late else -1)
        course = course_of(room, picked)
    finals = parts_of(fitter, chosen, fits, known, _trial(fitter, model, course, disc),
                      ((0.0, course.duration + 1.0),))
    return course, _words(course, picked, disc), [part.separation(np.ones(1)) for part in finals]


def _fit_of(chosen: Fit, effect: str, other: str, rivals: Sequence[Fit]) -> Fit | None:
    """Return the fit in which `other` stands in the place of `effect`, all else alike."""
    rest = set(chosen.hypothesis.ids) - {effect}
    found = [fit for fit in rivals if other in fit.hypothesis.ids
             and effect not in fit.hypothesis.ids and rest <= set(fit.hypothesis.ids)]
    return min(found, key=lambda fit: fit.cost, default=None)


def _slowest(fitter: Fitter) -> float:
    """Return the lowest speed that was judged [rad/s]."""
    judged = [np.abs(run.motion.velocity[run.comparison.weight > 0.0])
              for run in fitter.problem.runs]
    return min(float(np.concatenate(judged).min()), 0.03 * fitter.problem.scene.speed)


def _trial(fitter: Fitter, model: Model, course: Course, disc: tuple[float, ...]) -> Problem:
    return rehearsed(fitter.problem, model, course.time, course.position,
                     _disc_profile(course, disc))


def _harmless(fitter: Fitter, trial: Problem, course: Course, room: Room) -> NDArray[np.bool_]:
    """Return which segments need no more torque, and go no farther, than was recorded, (s,)."""
    motion = trial.runs[0].motion
    recorded = [run.motion for run in (*fitter.problem.runs, *fitter.problem.held_out)]
    most = 1.02 * max(float(np.max(np.abs(entry.effort))) for entry in recorded)
    low, high = fitter.problem.scene.position_range
    good = ((np.abs(motion.effort) <= most) & (motion.position >= low - 0.005 * room.width)
            & (motion.position <= high + 0.005 * room.width))
    inside = np.array([good[slice(*np.searchsorted(motion.time, span))].all()
                       for span in course.spans])
    if not inside.any():
        raise InputError('every segment asks for more than was recorded')
    return inside


def _need_a_disc(fitter: Fitter, names: tuple[str, ...]) -> bool:
    """Return whether one of these effects shows where a disc turns alone."""
    scene = fitter.problem.scene
    still = replace(scene, disc_speed_range=None)
    return any(effect.applies is not None and effect.applies(scene) and not effect.applies(still)
               for effect in map(get_effect, names))


def _disc_speeds(fitter: Fitter, needed: bool) -> tuple[float, ...]:
    """Return disc speeds to hold one after another [rad/s]; none where the disc has no say."""
    if not needed or fitter.problem.scene.disc_speed_range is None:
        return ()
    turning = np.concatenate([run.motion.disc_speed for run in fitter.problem.runs])
    turning = turning[np.abs(turning) > 0.05 * np.max(np.abs(turning))]
    way = 1.0 if np.median(turning) >= 0.0 else -1.0
    fast, slow = way * np.quantile(np.abs(turning), [0.9, 0.2])
    return (0.0, float(fast)) if abs(slow) > 0.8 * abs(fast) else (0.0, float(slow), float(fast))


def _disc_profile(course: Course, disc: tuple[float, ...]) -> Array | None:
    """Return the disc's speed over the reference, (n,): each in turn for 2 s, again and again.

    So every segment meets every speed; on the bench each speed is held for a whole run.
    """
    if not disc:
        return None
    profile: Array = np.array(disc)[(course.time / 2.0).astype(int) % len(disc)]
    return profile


def _reason(pairs: list[_Rivalry], apart: list[float]) -> str:
    chosen = list(dict.fromkeys(pair.chosen for pair in pairs))
    told = _enumerated([
        f'{distance:.1f} ({pair.other}{f" for {pair.chosen}" if len(chosen) > 1 else ""})'
        for pair, distance in zip(pairs, apart, strict=True)])
    others = list(dict.fromkeys(pair.other for pair in pairs))
    text = (f'{_enumerated(others)} would fit these recordings about as well as '
            f'{_enumerated(chosen)}; on the proposed reference the efforts that they '
            f'predict differ by {told} times the noise (rms, all numbers refitted)')
    if min(apart) < TOO_LITTLE:
        text += ', which is little: within the recorded range they come to nearly the same' \
            if max(apart) < TOO_LITTLE else '; below ' \
            f'{TOO_LITTLE:g} they come to nearly the same within the recorded range'
    # A formula keeps its own letters.
    return f'{text[0].upper()}{text[1:]}.' if '*' not in others[0] else f'{text}.'


def _words(course: Course, picked: list[Segment], disc: tuple[float, ...]) -> str:
    text = (f'{"; ".join(_again(picked))}; {course.duration:.0f} s in all, in '
            'next_experiment.csv, which the controller node runs (reference: file, '
            'reference_file: next_experiment.csv).')
    text = f'{text[0].upper()}{text[1:]}'
    if disc:
        speeds = ', '.join(f'{speed:.3g} rad/s' for speed in disc[1:])
        text += (f' Run it {len(disc)} times: with the disc standing and with the disc turning at '
                 f'{speeds}; record disc_speed.')
    return text


def _again(picked: list[Segment]) -> list[str]:
    """Return the segments' texts, one that follows itself only once."""
    texts: list[str] = []
    for index, segment in enumerate(picked):
        if index and segment is picked[index - 1]:
            texts[-1] += ', twice'
        elif segment in picked[:index]:
            texts.append(f'once more the {segment.name}')
        else:
            texts.append(segment.text)
    return texts


def _title(effect_id: str) -> str:
    words = effect_id.split('_')
    return ' '.join(word.capitalize() if word in PROPER else word for word in words)


def _listed(names: Sequence[str]) -> str:
    return _enumerated([_title(name) for name in dict.fromkeys(names)])


def _enumerated(words: Sequence[str]) -> str:
    return ' and '.join((', '.join(words[:-1]), words[-1]) if len(words) > 1 else words)
