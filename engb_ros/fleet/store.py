# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Results on disk, one file per recording: what makes a survey resumable."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import hashlib
import json
import math
import os
from pathlib import Path
import tempfile
from typing import Any

from engb_core.errors import InputError
from engb_ros.fleet.find import Found

__all__ = ['Store']

_FORMAT = 'engb-survey-result/1'


class Store:
    """A survey's folder: `results/` holds one JSON file per recording, `reports/` its pages.

    Args:
        folder: made if need be.
        model: the model file's mapping; results of another model don't count.
        settings: whatever else a result depends on.

    Raises:
        InputError: the folder can't be written to.
    """

    def __init__(self, folder: str | os.PathLike[str], model: Mapping[str, Any],
                 settings: str = '') -> None:
        self.folder = Path(folder)
        digest = hashlib.sha256(json.dumps([model, settings], sort_keys=True).encode())
        self._settings = digest.hexdigest()
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f'--out {folder}: is a file; name a folder')
        try:
            for name in ('results', 'reports'):
                (self.folder / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f'--out {folder}: cannot be written to ({error.strerror})') from error

    def load(self, recording: Found) -> list[dict[str, Any]] | None:
        """Return the results of a recording that is done, or None where it is still to do.

        A recording that has changed since, or ended in a fault, is to be done again.
        """
        try:
            data = json.loads(self._path(recording).read_text(encoding='utf-8'))
            same = (data['format'] == _FORMAT and data['key'] == recording.key
                    and data['settings'] == self._settings
                    and data['files'] == recording.fingerprint())
            results: list[dict[str, Any]] = data['results']
            if not same or not results or any(
                    result['status'] not in ('ok', 'refused') for result in results):
                return None
            reports = [result['report'] for result in results if result.get('report')]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        if any(not (self.folder / report).exists() for report in reports):
            return None
        return results

    def save(self, recording: Found, results: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Keep a recording's results, whole or not at all; return them as `load` would.

        A report's text goes into a file of its own; the result names it.
        """
        kept = []
        for number, result in enumerate(results):
            result = dict(result)
            if result.get('report'):
                name = f'reports/{recording.slug}{f"-{number}" if number else ""}.html'
                _write(self.folder / name, result['report'])
                result['report'] = name
            kept.append(_finite(result))
        try:
            files = recording.fingerprint()
        except OSError:
            files = []
        _write(self._path(recording), json.dumps({
            'format': _FORMAT, 'key': recording.key, 'settings': self._settings, 'files': files,
            'results': kept}, allow_nan=False, indent=1))
        return kept

    def _path(self, recording: Found) -> Path:
        return self.folder / 'results' / f'{recording.slug}.json'


def _write(path: Path, text: str) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix='.', suffix='.part')
    try:
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise


def _finite(value: Any) -> Any:
    """Return nested plain data with numbers that JSON doesn't know as None."""
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if hasattr(value, 'item'):      # numpy's numbers
        return _finite(value.item())
    return value
