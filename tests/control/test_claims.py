# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Of several controllers one speaks, whatever anybody claims."""

from engb_core.control.claims import CLAIM_PERIOD, ControllerClaims, STANDBY_CLAIM


def kept_up(claims, value, begin, seconds):
    """Hear a claim again and again; return when the last one came."""
    now = begin
    while now < begin + seconds:
        claims.hear(now, value)
        now += CLAIM_PERIOD
    return now - CLAIM_PERIOD


def test_of_two_the_later_one_yields_and_never_both():
    first, second = ControllerClaims(), ControllerClaims()
    first.start(0.0, 100)
    second.start(5.0, 200)
    now = kept_up(first, 200, 5.0, 1.0)
    kept_up(second, 100, 5.0, 1.0)
    assert first.judge(now, 2, True, False) == (True, True)
    assert second.judge(now, 2, False, False) == (True, False)


def test_restarts_do_not_make_two_yield_to_each_other():
    one, two = ControllerClaims(), ControllerClaims()
    one.start(0.0, 10)
    two.start(0.0, 20)
    kept_up(one, 20, 0.0, 1.0)
    kept_up(two, 10, 0.0, 1.0)
    two.start(5.0, 30)
    one.start(6.0, 40)
    now = kept_up(one, 30, 6.0, 1.0)
    kept_up(two, 40, 6.0, 1.0)
    assert two.judge(now, 2, True, False) == (True, True)
    assert one.judge(now, 2, False, False) == (True, False)


def test_one_message_silences_nobody_who_speaks():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    claims.judge(0.1, 1, True, False)
    claims.hear(5.0, 1)
    assert claims.judge(5.01, 2, True, False) == (True, True)
    assert claims.judge(5.01, 1, True, False)[0] is False


def test_a_claim_that_is_not_kept_up_is_forgotten():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    now = kept_up(claims, 1, 0.0, 1.0)
    assert claims.judge(now, 2, True, False) == (True, False)
    assert not claims.rivals(now + 0.6, True)


def test_who_has_a_fault_yields_to_the_healthy_one():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    now = kept_up(claims, 200, 0.0, 1.0)
    assert claims.judge(now, 2, True, True) == (True, False)


def test_of_a_stranger_without_a_claim_who_was_alone_for_long_was_first():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    assert claims.judge(0.1, 2, True, False) == (True, True)    # it may yet say who it is
    assert claims.judge(1.2, 2, True, False) == (True, False)
    claims.start(0.0, 100)
    claims.judge(0.1, 1, True, False)
    assert claims.judge(1.2, 2, True, False) == (True, True)


def test_who_speaks_gives_a_standby_time_to_say_that_it_is_one():
    """Its publisher is in the graph from when it is configured, its claims from when active."""
    claims = ControllerClaims()
    claims.start(0.0, 100)
    claims.judge(0.1, 1, True, False)
    for step in range(3, 9):
        assert claims.judge(0.1 * step, 2, True, False) == (True, True)
    now = kept_up(claims, STANDBY_CLAIM, 0.9, 1.0)
    assert claims.judge(now, 2, True, False) == (True, True)


def test_nobody_begins_to_speak_before_it_is_clear_who_else_does():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    assert not claims.unclear(0.0)
    claims.judge(0.1, 2, False, False)
    assert claims.unclear(0.5)
    claims.hear(0.6, STANDBY_CLAIM)
    assert not claims.unclear(0.7)
    claims.start(0.0, 100)
    claims.judge(0.1, 2, False, False)
    assert not claims.unclear(1.2)
    claims.judge(1.3, 1, False, False)
    assert not claims.unclear(1.35)


def test_many_claims_do_not_fill_the_memory():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    for value in range(1000):
        claims.hear(1.0 + 1e-3 * value, value)
    assert len(claims._heard) <= 16


def test_who_took_over_yields_to_a_word_of_the_one_before_but_not_to_its_shadow():
    claims = ControllerClaims()
    claims.start(0.0, 200)
    now = kept_up(claims, 100, 0.0, 1.0)
    claims.take_over(300)
    assert claims.judge(now + 0.2, 2, True, False) == (True, True)
    claims.hear(now + 0.3, 100)
    assert claims.judge(now + 0.3, 2, True, False) == (True, False)


def test_a_primary_beside_a_standby_from_the_start_speaks_also_with_a_fault():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    # Two publishers are in the graph before either has said who it is.
    assert claims.judge(0.05, 2, speaking=False, faulty=False) == (True, True)
    for step in range(50):
        now = 0.1 * step
        claims.hear(now, STANDBY_CLAIM)
        assert claims.judge(now, 2, speaking=step > 6, faulty=step > 20) == (True, True)


def test_a_stranger_who_says_nothing_was_there_first():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    for step in range(4):
        claims.judge(0.1 * step, 2, speaking=False, faulty=False)
    assert claims.judge(1.1, 2, speaking=False, faulty=False) == (True, False)


def test_a_standby_that_says_no_more_silences_nobody():
    """It has a fault, or the computer lets it wait; its publisher is still in the graph."""
    for heard in (STANDBY_CLAIM, 200):
        claims = ControllerClaims()
        claims.start(0.0, 100)
        for step in range(20):
            claims.hear(0.1 * step, heard)
            claims.judge(0.1 * step, 2, speaking=step > 6, faulty=False)
        for now in (2.2, 2.6, 3.5, 60.0):
            assert claims.judge(now, 2, speaking=True, faulty=False) == (True, True)


def test_a_standby_is_there_while_it_says_so():
    claims = ControllerClaims()
    claims.start(0.0, 100)
    claims.hear(0.1, 200)
    assert not claims.standby(0.2)
    claims.hear(0.3, STANDBY_CLAIM)
    assert claims.standby(0.4)
    assert not claims.standby(1.0)


def test_a_claim_counts_as_made_since_when_it_was_heard():
    claims = ControllerClaims()
    claims.start(0.0, 5)
    claims.hear(1.0, STANDBY_CLAIM)
    assert not claims.claimed_since(0.0)
    claims.hear(1.0, 3)
    assert claims.claimed_since(0.9)
    assert not claims.claimed_since(1.0)
    claims.hear(1.1, 3)
    assert claims.claimed_since(1.0)
