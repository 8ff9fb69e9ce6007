# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Diagnoses one recording and says everything about it in plain data: what a worker does."""

from __future__ import annotations

import time
from typing import Any

from engb_core.errors import computing, InputError

__all__ = ['diagnose_task', 'failed']

def diagnose_task(task: dict[str, Any]) -> list[dict[str, Any]]:
    """Diagnose the brakes in one bag, one result for each namespace that holds joint_states.

    Never raises: what goes wrong is told in the result, so that one bad bag stops no other.

    Args:
        task: `path`, `model` (the model file's mapping), `figures` (a backend of the report, or
            None for no report).

    Returns:
        Each with `status` ('ok', 'refused' by InputError, 'fault' of the program), `message`,
        `namespace`, `seconds`; and, where ok, `name`, `joint`, `start` [s], `duration` [s],
        `samples`, `document` (diagnosis.json), `model`, `nominal`, `notes`, `report` (HTML).
    """
    from engb_core.io.bags.read import joint_namespaces
    try:
        spaces = joint_namespaces(task['path'])
    except InputError as error:
        return [failed('refused', str(error))]
    except Exception as error:
        return [failed('fault', f'{type(error).__name__}: {error}')]
    if len(spaces) < 2:
        return [_one(task, None)]
    return [_one(task, space) for space in spaces]


def failed(status: str, message: str, namespace: str | None = None) -> dict[str, Any]:
    """Return the result of a recording that gave none."""
    return {'status': status, 'message': ' '.join(message.split()), 'namespace': namespace,
            'seconds': 0.0}


def _one(task: dict[str, Any], namespace: str | None) -> dict[str, Any]:
    begin = time.perf_counter()
    try:
        result = _diagnosed(task, namespace)
    except InputError as error:
        result = failed('refused', str(error), namespace)
    except MemoryError:
        result = failed('fault', 'not enough memory for this recording', namespace)
    except Exception as error:      # whatever it is, the other recordings go on
        result = failed('fault', f'{type(error).__name__}: {error}', namespace)
    result['seconds'] = round(time.perf_counter() - begin, 3)
    return result


def _diagnosed(task: dict[str, Any], namespace: str | None) -> dict[str, Any]:
    import dataclasses
    import warnings

    from engb_core.diagnose.document import to_document
    from engb_core.diagnose.engine import diagnose
    from engb_core.io.bags.read import read_recording
    from engb_core.model import Model
    model = Model.from_mapping(task['model'])
    recording = read_recording(task['path'], joint=model.joint.name, namespace=namespace)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        with computing(recording.name):
            # The survey's processes share the machine already.
            diagnosis = diagnose([recording], model, threads=1)
        report = None
        if task['figures'] is not None:
            from engb_core.report.page import diagnosis_page
            report = diagnosis_page(diagnosis, backend=task['figures']).html()
    return {
        'status': 'ok', 'message': '', 'namespace': namespace, 'name': recording.name,
        'joint': recording.joint, 'start': recording.start, 'duration': recording.duration,
        'samples': int(recording.time.size), 'document': to_document(diagnosis),
        'model': diagnosis.model.to_mapping(),
        'nominal': [dataclasses.asdict(change) for change in diagnosis.evidence.nominal],
        'notes': list(diagnosis.evidence.notes), 'report': report,
    }
