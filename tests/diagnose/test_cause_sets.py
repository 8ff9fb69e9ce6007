# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of causes: they hold the true cause as often as they say, in every group of cases."""

from collections.abc import Iterator
import json
import math
from pathlib import Path

import numpy as np
import pytest

from engb_core.diagnose import cause_sets
from engb_core.diagnose.cause_sets import (
    ANOTHER,
    Calibration,
    cause_set,
    conformal_quantile,
    FILE,
    FURTHER,
    LEADING,
    nonconformity,
    PLACES,
    ranked,
    shipped_calibration,
    with_cause_sets,
)
from engb_core.diagnose.constants import SET_LEVEL
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.errors import InputError

LIKELY = EffectFinding('backlash', 0.9, {}, 1.0, (), '')
EVEN = EffectFinding('backlash', 0.45, {}, 1.0,
                     (('unexplained_spot', 0.1), ('pad_creep', 0.35)), '')


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A file in the place of the one that belongs to this version."""
    path = tmp_path / 'cause_sets.json'
    monkeypatch.setattr(cause_sets, 'FILE', path)
    shipped_calibration.cache_clear()
    yield path
    shipped_calibration.cache_clear()


def write(path: Path, leading: list[float], further: list[float]) -> None:
    path.write_text(json.dumps({'format': cause_sets.FORMAT, 'scores': {
        LEADING: {'one': leading}, FURTHER: {'one': further}}}), 'utf8')


def test_the_claim_leads_and_what_is_likelier_comes_first():
    ranking = ranked(EVEN.effect, EVEN.probability, EVEN.alternatives)
    assert [name for name, _ in ranking] == ['backlash', 'pad_creep', ANOTHER]
    assert [value for _, value in ranking] == pytest.approx([0.0, 0.45, 0.8])
    assert nonconformity(ranking, {'pad_creep'}) == pytest.approx(0.45)
    assert nonconformity(ranking, {'stribeck_friction'}) == pytest.approx(0.8)


def test_another_cause_comes_before_a_less_likely_one():
    ranking = ranked('backlash', 0.5, (('pad_creep', 0.1),))
    assert [name for name, _ in ranking] == ['backlash', ANOTHER, 'pad_creep']


def test_probabilities_of_more_than_one_leave_nothing():
    ranking = ranked('backlash', 0.8, (('pad_creep', 0.4),))
    assert ranking[-1] == (ANOTHER, 1.0)


def test_the_threshold_is_the_conformal_quantile_of_the_worst_group():
    easy, hard = tuple(np.linspace(0.0, 0.1, 19)), tuple(np.linspace(0.0, 0.9, 19))
    assert conformal_quantile(easy, 0.9) == easy[17]
    assert Calibration({LEADING: {'easy': easy, 'hard': hard}, FURTHER: {'easy': easy}}
                       ).thresholds(0.9) == {LEADING: hard[17], FURTHER: easy[17]}
    # 9 cases tell 0.9, by their largest; 8 do not.
    assert conformal_quantile((0.0,) * 8 + (0.3,), 0.9) == 0.3
    assert math.isinf(conformal_quantile((0.0,) * 8, 0.9))


def test_exchangeable_cases_are_covered_in_every_group_and_in_any_mixture():
    """The tool may be as wrong as it likes about how sure it is."""
    random = np.random.default_rng(20261127)
    level, counts = 0.9, {'overconfident': 25, 'right': 40, 'rarely claiming': 60}

    def draw(group: str) -> tuple[list[tuple[str, float]], str]:
        said = float(random.uniform(0.3, 0.95))
        rest = float(random.uniform(0.0, 1.0 - said))
        right = {'overconfident': said - 0.3, 'right': said, 'rarely claiming': 0.5}[group]
        true = 'claim' if random.random() < right else random.choice(['rival', ANOTHER])
        return ranked('claim', said, [('rival', rest)]), str(true)

    def score(group: str) -> tuple[float, list[tuple[str, float]], str]:
        ranking, true = draw(group)
        if group == 'rarely claiming' and random.random() < 0.7:
            return 0.0, [], ''
        return nonconformity(ranking, {true}), ranking, true

    held = dict.fromkeys(counts, 0)
    rounds = 1500
    for _ in range(rounds):
        made = Calibration({LEADING: {group: tuple(score(group)[0] for _ in range(count))
                                      for group, count in counts.items()}})
        threshold = made.thresholds(level)[LEADING]
        for group in counts:
            _, ranking, true = score(group)
            causes = cause_set(ranking, threshold, level)
            held[group] += not ranking or (
                causes.another if true == ANOTHER else true in causes.effects)
    spread = 3.0 * math.sqrt(level * (1.0 - level) / rounds)
    for group, count in held.items():
        assert count / rounds >= level - spread, group
    shares = np.array(list(held.values())) / rounds
    mixtures = random.dirichlet(np.ones(3), 100) @ shares
    assert mixtures.min() >= level - spread


def test_sets_are_no_larger_than_they_have_to_be():
    """With one group and scores that differ, coverage is within 1/(n + 1) of the level."""
    random = np.random.default_rng(5)
    level, count, rounds = 0.9, 30, 4000
    scores = random.random((rounds, count + 1))
    thresholds = np.array([conformal_quantile(row[:-1], level) for row in scores])
    covered = float(np.mean(scores[:, -1] <= thresholds))
    spread = 3.0 * math.sqrt(0.09 / rounds)
    assert level - spread <= covered <= level + 1.0 / (count + 1) + spread


def test_a_higher_level_gives_a_set_that_holds_the_lower_one(shipped: Path):
    write(shipped, list(np.linspace(0.0, 0.95, 99)), [0.0] * 99)
    sets = []
    for level in (0.3, 0.6, 0.8, 0.95, 0.999):
        finding, = with_cause_sets([EVEN], level)
        assert finding.causes is not None and finding.causes.level == level
        sets.append({*finding.causes.effects, *([ANOTHER] if finding.causes.another else [])})
    assert sets[0] == {'backlash'} and sets[-1] == {'backlash', 'pad_creep', ANOTHER}
    assert all(small <= large for small, large in zip(sets, sets[1:], strict=False))


def test_the_claim_that_leads_in_share_and_the_others_have_a_threshold_each(shipped: Path):
    write(shipped, [0.0] * 99, [1.0] * 99)
    first = EffectFinding('stribeck_friction', 0.9, {}, 0.6, (), '')
    second = EffectFinding('backlash', 0.9, {}, 0.3, (), '')
    curve = EffectFinding('load_curve_shape', 0.9, {}, 0.9, (), '')
    for given in ([curve, first, second], [second, first, curve]):
        another = {finding.effect: finding.causes.another
                   for finding in with_cause_sets(given) if finding.causes is not None}
        assert another == {'stribeck_friction': False, 'backlash': True}


def test_what_only_describes_gets_no_set():
    found = with_cause_sets([EffectFinding('load_curve_shape', 0.9, {}, 1.0, (), ''), LIKELY])
    assert found[0].causes is None
    assert found[1].causes is not None


@pytest.mark.parametrize('level', [0.0, 1.0, -1.0, math.nan])
def test_a_level_that_is_none_is_refused(level: float):
    with pytest.raises(InputError, match='must lie within 0 and 1'):
        with_cause_sets([LIKELY], level)


@pytest.mark.parametrize('text', [
    None, '', '[]', '{"format": "other/1", "scores": {}}', '{"format": "engb-cause-sets/1"}',
    *('{"format": "engb-cause-sets/1", "scores": ' + scores + '}' for scores in (
        '{}', '[]', '{"leading": {"a": [0.1]}}', '{"leading": {"a": [0.1]}, "further": {}}',
        '{"leading": {"a": [0.1]}, "further": {"a": []}}',
        '{"leading": {"a": [0.1]}, "further": {"a": 0.5}}',
        '{"leading": {"a": [0.1]}, "further": {"a": ["x"]}}',
        '{"leading": {"a": [0.1]}, "further": {"a": [NaN]}}',
        '{"leading": {"a": [1.5]}, "further": {"a": [0.1]}}'))])
def test_a_damaged_file_is_told_in_one_line(text: str | None, shipped: Path):
    if text is not None:
        shipped.write_text(text, 'utf8')
    with pytest.raises(InputError, match='is no calibration of sets of causes') as told:
        with_cause_sets([LIKELY])
    assert str(shipped) in str(told.value) and '\n' not in str(told.value)


def test_the_file_tells_where_it_comes_from():
    held = json.loads(FILE.read_text('utf8'))
    assert held['command'] == 'engb prove --calibrate'
    for proof in held['of']:
        assert proof['drawn'].startswith('engb prove --cases ') and ' --seed ' in proof['drawn']
        assert len(proof['digest']) == 64 and proof['commits'] and proof['date']
    assert list(held['scores']) == list(PLACES)
    for groups in held['scores'].values():
        assert {name: len(values) for name, values in groups.items()} == held['cases']
    assert sum(held['cases'].values()) == sum(proof['cases'] for proof in held['of'])
    assert set(held['cases']) == {'clean', 'strong', 'subtle', 'several', 'outside'}
    assert all(math.isfinite(conformal_quantile(values, SET_LEVEL))
               for groups in held['scores'].values() for values in groups.values())
