# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What Python becomes C, and how what does not is told: its function, its line, and a remedy."""

from __future__ import annotations

import importlib.util

import pytest

from engb_core.errors import InputError
from engb_core.export.kinds import Array, REAL
from engb_core.export.translate import Translator

REFUSED = {
    'text': ("return 'a'", "'a' is no number"),
    'nothing there': ('return there', 'there is not known before it is used'),
    'a list': ('return [1.0, 2.0]', 'List is not translated to C'),
    'an attribute': ('return state.mean', 'state.mean is not translated to C'),
    'matrix product': ('return state @ state', 'MatMult is not translated to C'),
    'in': ('return 1.0 if a in state else 0.0', 'In is not translated to C'),
    'by name': ('return max(a, b=1.0)', 'arguments by name are not translated to C'),
    'print': ('print(a)\n    return a', 'print cannot be called in C'),
    'a method': ('return state.sum()', r'state.sum cannot be called in C'),
    'math': ('return math.gamma(a)', 'math.gamma is not translated to C'),
    'max of one': ('return max(a)', 'max of one thing is not translated to C'),
    'numpy': ('other = np.ones(8)\n    return other[0]', 'np.ones is not translated to C'),
    'a size that changes': ('other = np.empty(int(a))\n    return other[0]',
                            'the size of an array has to be a constant'),
    'a place between': ('return state[a]', 'a place in an array has to be a whole number'),
    'with': ('with open("x"):\n        return a', 'With is not translated to C'),
    'for over an array': ('for value in state:\n        a += value\n    return a',
                          'only for … in range'),
    'a pair of one': ('first, second = a\n    return first', 'is no tuple'),
    'bits turned round': ('return ~int(a)', 'Invert is not translated to C'),
    'a size that is not there': ('return state.shape[1]', 'this size is not known in C'),
    'a function without name': ('return (lambda: a)()', 'cannot be called in C'),
    'a number that math has not': ('return math.nothing', 'math.nothing is not translated to C'),
    'a place of a number': ('return a[0]', 'a is no array'),
    'a place of a sum': ('return (a + 1.0)[0]', r'a \+ 1.0 is no array'),
    'every other place': ('state[::2] = a\n    return a', 'this slice has no end in C'),
    'an attribute is set': ('state.place = a\n    return a', 'cannot be assigned to in C'),
}


def function_of(tmp_path, body: str):
    path = tmp_path / 'theirs.py'
    path.write_text(f'import math\nimport numpy as np\n\n\ndef theirs(a, state):\n    {body}\n',
                    encoding='utf-8')
    spec = importlib.util.spec_from_file_location('theirs', path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.theirs


@pytest.mark.parametrize('what', REFUSED)
def test_what_does_not_become_c_is_told_with_its_line(tmp_path, what):
    body, words = REFUSED[what]
    with pytest.raises(InputError, match=words) as refused:
        Translator({}).function(function_of(tmp_path, body), (REAL, Array(8)))
    text = str(refused.value)
    assert 'hold numbers, arrays, math, if, for, while and calls' in text
    assert text.startswith('theirs.theirs, line 6: ') and '\n' not in text


def test_a_function_that_calls_itself_is_refused(tmp_path):
    with pytest.raises(InputError, match='calls itself; C for a controller must not'):
        Translator({}).function(function_of(tmp_path, 'return theirs(a, state)'),
                                (REAL, Array(8)))


@pytest.mark.parametrize(('body', 'same'), [
    ('return +a * state[0]', 'return a * state[0]'),
    ('return state[0] + float(2)', 'return state[0] + 2.0'),
    ('return 1.0 if bool(a) else state[0]', 'return 1.0 if a else state[0]'),
    ('for place in range(0, len_, 1):\n        state[place] = a\n    return a',
     'for place in range(len_):\n        state[place] = a\n    return a'),
])
def test_two_ways_to_write_it_become_the_same_c(tmp_path, body, same):
    texts = []
    for form in (body, same):
        translator = Translator({})
        translator.function(function_of(tmp_path, form.replace('len_', 'state.shape[0]')),
                            (REAL, Array(8)))
        texts.append(translator.functions['engb_theirs_theirs'])
    assert texts[0] == texts[1]


@pytest.mark.parametrize(('body', 'words'), [
    ('return a if a < math.inf else math.nan', ('INFINITY', 'NAN')),
    ('state[1], state[0] = state[0], a\n    return a',
     ('state[1] = engb_v0', 'state[0] = engb_v1')),
    ('while a > 0.0:\n        a -= 1.0\n        if a < 3.0:\n            continue\n'
     '        state[0] = a\n    return a', ('while (', 'continue;')),
])
def test_what_stands_in_c(tmp_path, body, words):
    translator = Translator({})
    translator.function(function_of(tmp_path, body), (REAL, Array(8)))
    text = translator.functions['engb_theirs_theirs']
    for word in words:
        assert word in text


def test_two_functions_of_one_name_stay_two(tmp_path):
    translator = Translator({})
    made = []
    for body in ('return a * state[0]', 'return a - state[0]'):
        made.append(translator.function(function_of(tmp_path, body), (REAL, Array(8))).name)
    assert made == ['engb_theirs_theirs', 'engb_theirs_theirs_2']
    assert 'return a * state[0];' in translator.functions[made[0]]
    assert 'return a - state[0];' in translator.functions[made[1]]


def test_a_variable_with_a_type_becomes_the_same_c(tmp_path):
    texts = []
    for form in ('share = a ** 2.0', 'share: float = a ** 2.0'):
        translator = Translator({})
        translator.function(function_of(tmp_path, f'{form}\n    return share * state[0]'),
                            (REAL, Array(8)))
        texts.append(translator.functions['engb_theirs_theirs'])
    assert 'share' in texts[0] and texts[0] == texts[1]
