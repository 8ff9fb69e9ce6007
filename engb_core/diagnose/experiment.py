"""What to measure next: the reference on which the chosen effects and their rivals part.

A family of segments is run on the chosen fit in closed loop. On that motion each rival says what
effort it would take; what refitted numbers and parameters of the rival can make up for, held by
what the recordings have already fixed, doesn't count:

    E = min over x of |W (y_chosen − y_rival − A x)|² + xᵀ G x,   G = Jᵀ W² J + priors

with A and J the rival's derivatives on the new and on the recorded motion. Segments are added
one by one as long as they add to E as much per second as those that are there.
"""

from __future__ import annotations

from collections.abc import Sequence
import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import EffectFinding, NextExperiment
from engb_core.diagnose.experiment_rehearsal import rehearsed
from engb_core.diagnose.experiment_segments import Course, course_of, Room, room_of, segments_of
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.problem import Problem
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['next_experiment', 'NOT_TOLD_APART']

Array = NDArray[np.float64]

# An alternative from this probability on calls for an experiment.
NOT_TOLD_APART = 0.1
# Rivals that a reference is made for.
MOST_RIVALS = 3
SHORTEST, LONGEST = 15.0, 40.0
# A segment is added if it gives this part of what those before it give per second.
WORTH_ADDING = 0.3
# Below this separation (rms, noise = 1) no reference within the recorded range settles it.
TOO_LITTLE = 0.4
PROPER = ('stribeck', 'coulomb')


@dataclass(frozen=True)
class _Parts:
    """What a rival's normal equations are made of, by segment.

    `distance` (s,) Σ w d²; `pull` (s, k) Aᵀ w d; `gram` (s, k, k) Aᵀ w A; `known` (k, k) what
    the recordings have fixed; `size` (s,) Σ w σ², the number of values, noise = 1.
    """

    distance: Array
    pull: Array
    gram: Array
    known: Array
    size: Array

    def energy(self, counts: Array) -> float:
        """Return E for `counts` (s,) of each segment."""
        pull = counts @ self.pull
        gram = self.known + np.tensordot(counts, self.gram, 1)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        solution = np.linalg.solve(gram / np.outer(scale, scale) + 1e-9 * np.eye(scale.size),
                                   pull / scale)
        return max(float(counts @ self.distance - (pull / scale) @ solution), 0.0)

    def separation(self, counts: Array) -> float:
        """Return the rms difference that is left, in units of the noise."""
        return float(np.sqrt(self.energy(counts) / max(counts @ self.size, 1e-9)))


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
                   if probability > NOT_TOLD_APART), reverse=True)
    if not told:
        return None
    names = tuple(dict.fromkeys(name for _, *pair in told for name in pair))
    pairs = [(effect, name, fit) for _, effect, name in told
             if (fit := _fit_of(chosen, effect, name, rivals)) is not None][:MOST_RIVALS]
    try:
        return _proposal(fitter, chosen, pairs, names)
    except (InputError, np.linalg.LinAlgError):
        return NextExperiment(
            f'{_listed(names)} fit these recordings alike.', names,
            'no reference could be worked out from these recordings: record strokes of several '
            'lengths and speeds, with reversals under load and without')


def _proposal(fitter: Fitter, chosen: Fit, pairs: list[tuple[str, str, Fit]],
              names: tuple[str, ...]) -> NextExperiment:
    if not pairs:
        raise InputError('no fit of a rival is at hand')
    model = chosen.hypothesis.corrected(chosen.vector)
    room = room_of(fitter.problem, model, _slowest(fitter))
    family = segments_of(room)
    known = [_known(fitter, fit) for _, _, fit in pairs]
    disc = _disc_speeds(fitter, names)
    fits = [fit for *_, fit in pairs]
    tried = course_of(room, family)
    trial = _trial(fitter, model, tried, disc)
    parts = _parts(fitter, chosen, fits, known, trial, tried.spans)
    lengths = np.array([end - begin for begin, end in tried.spans])
    counts = _combined(parts, lengths, _harmless(fitter, trial, tried, room))
    order = [index for index in np.argsort(-_alone(parts, lengths)) if counts[index]]
    picked = [family[index] for index in order for _ in range(int(counts[index]))]
    if any(get_effect(name).reveals == 'time' for name in names):
        # What changes with time shows in the same stroke, early and late.
        picked = [*(entry for entry in picked if entry is not picked[0]), picked[0]]
        picked.insert(0, picked[-1])
    course = course_of(room, picked)
    finals = _parts(fitter, chosen, fits, known, _trial(fitter, model, course, disc),
                    ((0.0, course.duration + 1.0),))
    apart = [part.separation(np.ones(1)) for part in finals]
    return NextExperiment(_reason(pairs, apart), names, _words(course, picked, disc),
                          course.time, course.position)


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


def _known(fitter: Fitter, rival: Fit) -> Array:
    """Return what the recordings have fixed of a rival's numbers, (k, k)."""
    jacobian = rival.jacobian if rival.jacobian is not None else fitter.finish(rival).jacobian
    scaled = (jacobian / fitter.spread[:, None])[fitter.fitted]
    known = scaled.T @ scaled
    numbers = rival.hypothesis.numbers
    places = range(len(numbers))
    known[places, places] += [number.spread ** -2.0 for number in numbers]
    for entry, (_, _, run) in enumerate(rival.hypothesis.places):
        if run >= 0:
            # Found anew in each recording: what is known of it is of no use in the next.
            known[len(numbers) + entry, :] = known[:, len(numbers) + entry] = 0.0
    return known


def _trial(fitter: Fitter, model: Model, course: Course, disc: tuple[float, ...]) -> Problem:
    return rehearsed(fitter.problem, model, course.time, course.position,
                     _disc_profile(course, disc))


def _parts(fitter: Fitter, chosen: Fit, rivals: list[Fit], known: list[Array], problem: Problem,
           spans: tuple[tuple[float, float], ...]) -> list[_Parts]:
    run = problem.runs[0]
    there = copy.copy(fitter)
    there.problem = problem
    missed = max(float(np.median(fitter.spread ** 2 - fitter.sigma ** 2)), 0.0)
    variance = fitter.problem.noise_floor ** 2 + run.sigma ** 2 - run.noise ** 2
    weight = 1.0 / (variance + missed)
    expected = there.predict(chosen.hypothesis, chosen.vector)
    time = run.motion.time[run.comparison.grid]
    rows = [slice(*np.searchsorted(time, span)) for span in spans]
    found = []
    for rival, fixed in zip(rivals, known, strict=True):
        predicted = there.predict(rival.hypothesis, rival.vector)
        distance = expected - predicted
        columns = there.finish(Fit(rival.hypothesis, rival.vector, predicted, distance,
                                   0.0)).jacobian
        if not (np.isfinite(columns).all() and np.isfinite(distance).all()):
            raise InputError('a rival has no finite effort on the reference')
        weighted = columns * weight[:, None]
        found.append(_Parts(
            np.array([weight[part] @ distance[part] ** 2 for part in rows]),
            np.array([weighted[part].T @ distance[part] for part in rows]),
            np.array([weighted[part].T @ columns[part] for part in rows]), fixed,
            np.array([weight[part] @ variance[part] for part in rows])))
    return found


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
    return inside if inside.any() else np.ones_like(inside)


def _alone(parts: list[_Parts], lengths: Array) -> Array:
    """Return what each segment gives by itself, per second, for the pair it parts least, (s,)."""
    each = np.eye(lengths.size)
    return np.array([min(part.energy(one) for part in parts) for one in each]) / lengths


def _combined(parts: list[_Parts], lengths: Array, allowed: NDArray[np.bool_]) -> Array:
    """Return how often to use each segment, (s,): added greedily, per second, 40 s in all."""
    counts = np.zeros(lengths.size)

    def worth(trial: Array) -> float:
        # The logarithm lets the pair that is parted least count most.
        return float(sum(np.log1p(part.energy(trial)) for part in parts))

    while True:
        spent = float(counts @ lengths)
        options = [index for index in np.flatnonzero(allowed & (counts < 2))
                   if spent + lengths[index] < LONGEST - 3.0]
        if not options:
            return counts
        one = np.eye(lengths.size)
        # A segment that is there already adds certainty, but nothing new.
        best = max(options, key=lambda index: (
            (worth(counts + one[index]) - worth(counts)) / lengths[index]
            / (1.0 + 2.0 * counts[index])))
        if spent >= SHORTEST:
            gain = min((part.energy(counts + one[best]) - part.energy(counts)) / lengths[best]
                       * spent / max(part.energy(counts), 1e-9) for part in parts)
            if gain < WORTH_ADDING:
                return counts
        counts[best] += 1


def _disc_speeds(fitter: Fitter, names: tuple[str, ...]) -> tuple[float, ...]:
    """Return disc speeds to hold one after another [rad/s]; none where the disc has no say."""
    scene = fitter.problem.scene
    still = replace(scene, disc_speed_range=None)
    effects = [get_effect(name) for name in names]
    if scene.disc_speed_range is None or not any(
            effect.applies is not None and effect.applies(scene) and not effect.applies(still)
            for effect in effects):
        return ()
    turning = np.concatenate([run.motion.disc_speed for run in fitter.problem.runs])
    turning = turning[np.abs(turning) > 0.05 * np.max(np.abs(turning))]
    fast, slow = np.quantile(turning, [0.9, 0.2])
    return (0.0, float(fast)) if abs(slow) > 0.8 * abs(fast) else (0.0, float(slow), float(fast))


def _disc_profile(course: Course, disc: tuple[float, ...]) -> Array | None:
    """Return the disc's speed over the reference, (n,): each in turn for 2 s, again and again.

    So every segment meets every speed; on the bench each speed is held for a whole run.
    """
    if not disc:
        return None
    return np.array(disc)[(course.time / 2.0).astype(int) % len(disc)]


def _reason(pairs: list[tuple[str, str, Fit]], apart: list[float]) -> str:
    effects = tuple(dict.fromkeys(effect for effect, _, _ in pairs))
    told = _enumerated([f'{distance:.1f} times the noise from {_title(other)}' + (
                            f' (for {_title(effect)})' if len(effects) > 1 else '')
                        for (effect, other, _), distance in zip(pairs, apart, strict=True)])
    text = (f'These recordings fit {_listed([other for _, other, _ in pairs])} about as well as '
            f'{_listed(effects)}; on the proposed reference the effort (rms, all numbers '
            f'refitted) parts by {told}')
    if min(apart) < TOO_LITTLE:
        text += ', which is little: a wider range of load or speed would tell more'
    return f'{text}.'


def _words(course: Course, picked: list, disc: tuple[float, ...]) -> str:
    text = (f'next_experiment.csv, {course.duration:.0f} s, for the controller node (reference: '
            f'file, reference_file: next_experiment.csv): '
            + '; '.join(_again(picked)) + '.')
    if disc:
        speeds = ', '.join(f'{speed:.3g} rad/s' for speed in disc[1:])
        text += (f' Run it {len(disc)} times: with the disc standing and with the disc turning at '
                 f'{speeds}; record disc_speed.')
    return text


def _again(picked: list) -> list[str]:
    """Return the segments' texts, one that follows itself only once."""
    texts = []
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
