# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What to measure next where several laws do as well: the reference on which they part."""

from __future__ import annotations

from engb_core.diagnose.diagnosis import NextExperiment
from engb_core.diagnose.experiment.next_experiment import law_experiment
from engb_core.laws.judgement import depends_on, Found
from engb_core.laws.statement import told_as

__all__ = ['experiment_between']


def experiment_between(found: Found) -> NextExperiment | None:
    """Return the reference that tells a law that is not settled from those that do as well; None
    where it is settled, none does as well, or no reference within what was recorded is possible.
    """
    rivals = found.alternatives
    if found.settled or not rivals:
        return None
    return law_experiment(
        found.fitter, found.candidate.fit, told_as(found.candidate),
        [(told_as(entry), entry.fit) for entry in rivals],
        [name for entry in (found.candidate, *rivals) for name in depends_on(entry)])
