"""A small part of `run.py`: a hundred damaged cases, each ends in a result or in one line.

What is damaged within bags and models goes through `predict`, the quickest command, and a few
through `diagnose` and `identify`.
"""

from pathlib import Path

import pytest

from .cases import make_case
from .oracle import judge


@pytest.mark.parametrize('seed', range(0, 80, 20))
def test_predict(tmp_path, seed):
    findings = []
    for number in range(seed, seed + 20):
        folder = tmp_path / str(number)
        folder.mkdir()
        case = make_case(number, folder, ('predict',))
        wrong, _ = judge(case, folder)
        if wrong:
            findings.append((number, case.about, wrong))
    assert not findings


@pytest.mark.parametrize('seed', range(1000, 1010))
def test_identify_and_diagnose(tmp_path, seed):
    case = make_case(seed, tmp_path, ('identify', 'diagnose'))
    wrong, _ = judge(case, tmp_path)
    assert not wrong, case.about


def test_cases_follow_from_their_number(tmp_path):
    contents = []
    for name in 'ab':
        folder = tmp_path / name
        folder.mkdir()
        make_case(17, folder)
        contents.append({str(file.relative_to(folder)): file.read_bytes()
                         for file in sorted(Path(folder).rglob('*')) if file.is_file()})
    assert contents[0] == contents[1]
