"""The order of what is claimed."""

from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.findings import in_order


def finding(effect: str, probability: float, share: float) -> EffectFinding:
    return EffectFinding(effect, probability, {}, share, (), '')


def test_what_is_sure_comes_first():
    found = in_order([finding('doubtful', 0.2, 0.6), finding('lesser', 0.9, 0.1),
                      finding('greater', 0.9, 0.3)])
    assert [entry.effect for entry in found] == ['greater', 'lesser', 'doubtful']
    assert found[2].share == 0.05


def test_where_nothing_is_sure_shares_stay():
    found = in_order([finding('lesser', 0.3, 0.2), finding('greater', 0.4, 0.7)])
    assert [(entry.effect, entry.share) for entry in found] == [('greater', 0.7), ('lesser', 0.2)]
