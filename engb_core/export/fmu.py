# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model as a functional mock-up unit: FMI 2.0 or 3.0 for co-simulation, source and binary.

The unit holds the generated C (c_model.py), so that it runs where there is no Python. Inputs are
the effort [N·m], the disc's speed [rad/s] and the pad's temperature [°C], held over a step;
outputs are motor angle, speed, acceleration and load torque. All numbers of the model are
parameters that may be set before the start. Where the model has a controller, the unit holds its
loop, too: with `closed_loop` = 1 the set-point is the input. Effects on the set-point and on the
recorded effort have variables of their own.

https://fmi-standard.org: FMI 2.0.4 and 3.0.1.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass, replace
import hashlib
from importlib.resources import files
import os
from pathlib import Path
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from xml.etree import ElementTree
import zipfile

from engb_core.errors import InputError
from engb_core.export.c_model import c_model, CModel
from engb_core.export.expressions import number
from engb_core.model import Model
from engb_core.physics.plant import effects_of

__all__ = ['FLAGS', 'compiler', 'write_fmu']

NAME = 'engb_model'
# As the standard says; what FMA gives is not what Python computes.
FLAGS = ('-std=c99', '-O2', '-fPIC', '-shared', '-fvisibility=hidden', '-ffp-contract=off')
_FIRST_PARAMETER = 16


@dataclass(frozen=True)
class _Variable:
    """A variable of the unit; the reference is its place in fmu_instance.h."""

    reference: int
    name: str
    unit: str
    what: str
    causality: str
    start: float | None = None


_ALWAYS = (
    _Variable(0, 'time', 's', 'time', 'independent'),
    _Variable(1, 'effort', 'N.m', 'motor torque that is measured or commanded', 'input', 0.0),
    _Variable(2, 'disc_speed', 'rad/s', 'speed of the brake disc', 'input', 0.0),
    _Variable(3, 'pad_temperature', 'degC', 'temperature of the pad', 'input', 20.0),
    _Variable(4, 'position', 'rad', 'motor angle', 'output'),
    _Variable(5, 'velocity', 'rad/s', 'motor speed', 'output'),
    _Variable(6, 'acceleration', 'rad/s2', 'motor acceleration over the last inner step',
              'output'),
    _Variable(7, 'load_torque', 'N.m', 'load torque, motor side, with its effects', 'output'),
    _Variable(8, 'initial_position', 'rad', 'where the motor stands at the start', 'parameter',
              0.0))
_SET_POINT = (
    _Variable(9, 'reference', 'rad', 'set-point that the drive is given', 'input', 0.0),
    _Variable(10, 'acted_reference', 'rad', 'set-point on which the drive acts', 'output'))
_LOOP = (
    _Variable(11, 'reference_velocity', 'rad/s', 'how fast the set-point moves', 'input', 0.0),
    _Variable(12, 'reference_effort', 'N.m', 'feedforward torque', 'input', 0.0),
    _Variable(13, 'closed_loop', '1', '1: the controller of the model tracks `reference`, and '
              '`effort` is not looked at; 0: `effort` drives', 'parameter', 0.0))
_RECORDED = (
    _Variable(14, 'recorded_effort', 'N.m', 'motor torque as a log of the drive has it', 'output'),
)
# Powers of kg, m, s and rad; other units are names only.
_BASE = {'N.m': (1, 2, -2, 0), 'rad': (0, 0, 0, 1), 'rad/s': (0, 0, -1, 1),
         'rad/s2': (0, 0, -2, 1), 's': (0, 0, 1, 0), 'kg.m2': (1, 2, 0, 0), 'm': (0, 1, 0, 0),
         'N': (1, 1, -2, 0), 'm/s': (0, 1, -1, 0), 'm/s2': (0, 1, -2, 0)}


@dataclass(frozen=True)
class _Platform:
    folder: str
    suffix: str


def compiler() -> str | None:
    """Return the C compiler: the one that CC names, or the first of cc, gcc and clang."""
    given = os.environ.get('CC')
    return next((found for name in ([given] if given else ['cc', 'gcc', 'clang'])
                 if (found := shutil.which(name))), None)


def write_fmu(model: Model, path: Path, version: int = 2, title: str = 'engb_model',
              binary: bool = True) -> tuple[str, ...]:
    """Write a model as an FMU; return what is to be known about it, a sentence each.

    Args:
        model: nominal numbers and effects.
        path: the file to write.
        version: of FMI, 2 or 3.
        title: name of the model in the unit.
        binary: compile it for this machine; without a compiler the unit holds the source only.

    Raises:
        InputError: another version, an effect that does not become C, or a compiler that fails.
    """
    if version not in (2, 3):
        raise InputError(f'there is no FMI {version} here; give 2 or 3')
    made = c_model(model)
    token = '{' + hashlib.sha256((made.header + made.source + str(version)).encode()
                                 ).hexdigest()[:32] + '}'
    # A GUID by its looks, of the content: the same model gives the same file.
    token = '-'.join((token[:9], token[9:13], token[13:17], token[17:21], token[21:]))
    sources = _sources(made, version, token)
    notes = list(made.beside)
    entries: dict[str, bytes] = {
        'modelDescription.xml': _description(model, made, version, token, title),
        **{f'sources/{name}': text.encode() for name, text in sources.items()}}
    if version == 3:
        entries['sources/buildDescription.xml'] = _build_description()
    found = compiler() if binary else None
    if found is not None:
        place = _platform(version)
        entries[f'binaries/{place.folder}/{NAME}{place.suffix}'] = _binary(found, sources, version)
    elif binary:
        notes.append('no C compiler was found (cc, gcc, clang, or CC=…): the unit holds its '
                     'source only; `fmpy compile` makes the binary where there is one')
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            # Without a date: the same model gives the same bytes.
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return tuple(notes)


def _sources(made: CModel, version: int, token: str) -> dict[str, str]:
    offsets = ',\n'.join(
        f'    offsetof(engb_plant, {entry.array}) + {entry.index} * sizeof(double)'
        for entry in made.quantities)
    header = (f'/* Written by `engb export`. */\n#ifndef ENGB_FMU_H\n#define ENGB_FMU_H\n\n'
              f'#include "engb_model.h"\n\n#include <stddef.h>\n\n#define ENGB_TOKEN "{token}"\n'
              f'#define ENGB_FIRST_PARAMETER {_FIRST_PARAMETER}u\n'
              f'#define ENGB_PARAMETERS {len(made.quantities)}u\n\n'
              f'/* Where the parameters stand in engb_plant, by reference. */\n'
              f'static const size_t engb_offsets[ENGB_PARAMETERS] = {{\n{offsets}\n}};\n\n'
              '#endif\n')
    folder = files('engb_core.export') / 'c'
    kept = {name: (folder / name).read_text(encoding='utf-8')
            for name in ('fmu_instance.h', f'fmi{version}.c')}
    return {'engb_model.h': made.header, 'engb_model.c': made.source, 'engb_fmu.h': header, **kept}


def _platform(version: int) -> _Platform:
    machine = platform.machine().lower()
    suffix = {'win32': '.dll', 'darwin': '.dylib'}.get(sys.platform, '.so')
    if version == 2:
        system = {'win32': 'win', 'darwin': 'darwin'}.get(sys.platform, 'linux')
        wide = '64' if sys.maxsize > 2 ** 32 else '32'
        # FMI 2 knows one kind of processor only.
        return _Platform(f'{system}{wide}' if machine in ('x86_64', 'amd64')
                         else f'{machine}-{system}', suffix)
    system = {'win32': 'windows', 'darwin': 'darwin'}.get(sys.platform, 'linux')
    kind = {'amd64': 'x86_64', 'arm64': 'aarch64'}.get(machine, machine)
    return _Platform(f'{kind}-{system}', suffix)


def _binary(found: str, sources: dict[str, str], version: int) -> bytes:
    with tempfile.TemporaryDirectory(prefix='engb-fmu-') as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding='utf-8')
        # What the compiler puts down between its passes goes with the folder, whatever ends it; a
        # group of its own, since it has others compile and link.
        compiling = subprocess.Popen(
            [found, *FLAGS, '-o', 'unit', 'engb_model.c', f'fmi{version}.c', '-lm'], cwd=folder,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
            env={**os.environ, 'TMPDIR': folder, 'TMP': folder, 'TEMP': folder})
        try:
            _, said = compiling.communicate(timeout=300)
        except BaseException:
            with contextlib.suppress(OSError):
                os.killpg(compiling.pid, signal.SIGKILL)
            compiling.communicate()
            raise
        if compiling.returncode:
            line = (said.strip().splitlines() or ['no message'])[0]
            raise InputError(f'{found} does not compile the model ({line}); name another C99 '
                             'compiler by CC=…, or leave the binary out (--source-only)')
        return (Path(folder) / 'unit').read_bytes()


def _unit(model: Model, unit: str) -> str:
    if model.joint.type == 'prismatic':
        return unit.replace('kg.m2', 'kg').replace('N.m', 'N').replace('rad', 'm')
    return unit


def _description(model: Model, made: CModel, version: int, token: str, title: str) -> bytes:
    root = ElementTree.Element('fmiModelDescription', {
        'fmiVersion': '2.0' if version == 2 else '3.0', 'modelName': title,
        ('guid' if version == 2 else 'instantiationToken'): token,
        'description': 'A brake actuator or another axis, with the physics that a diagnosis found',
        'generationTool': 'engb export', 'variableNamingConvention': 'structured'})
    capable = {'modelIdentifier': NAME, 'canHandleVariableCommunicationStepSize': 'true',
               'canSerializeFMUstate' if version == 2 else 'canSerializeFMUState': 'true',
               'canGetAndSetFMUstate' if version == 2 else 'canGetAndSetFMUState': 'true'}
    kind = ElementTree.SubElement(root, 'CoSimulation', capable)
    if version == 2:
        listed = ElementTree.SubElement(kind, 'SourceFiles')
        for name in ('engb_model.c', 'fmi2.c'):
            ElementTree.SubElement(listed, 'File', {'name': name})
    own = _variables_of(model)
    _units(root, [_unit(model, entry.unit) for entry in own]
           + [_unit(model, entry.unit) for entry in made.quantities])
    ElementTree.SubElement(root, 'DefaultExperiment', {'startTime': '0', 'stopTime': '1',
                                                       'stepSize': '0.001'})
    variables = ElementTree.SubElement(root, 'ModelVariables')
    outputs = []
    for entry in own:
        place = _variable(variables, version, replace(entry, unit=_unit(model, entry.unit)))
        if entry.causality == 'output':
            outputs.append(place if version == 2 else entry.reference)
    for reference, quantity in enumerate(made.quantities, _FIRST_PARAMETER):
        _variable(variables, version, _Variable(
            reference, quantity.name, _unit(model, quantity.unit), '', 'parameter',
            quantity.value))
    _structure(root, version, outputs)
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding='utf-8', xml_declaration=True))


def _variables_of(model: Model) -> tuple[_Variable, ...]:
    stages = {stage for effect, _ in effects_of(model) for stage in effect.stages}
    loop = model.controller is not None
    return (*_ALWAYS, *(_SET_POINT if loop or 'command' in stages else ()),
            *(_LOOP if loop else ()), *(_RECORDED if loop or 'measurement' in stages else ()))


def _variable(parent: ElementTree.Element, version: int, entry: _Variable) -> int:
    """Add a variable; return its place, from 1."""
    said = {'name': entry.name, 'valueReference': str(entry.reference),
            'causality': entry.causality,
            'variability': 'fixed' if entry.causality == 'parameter' else 'continuous'}
    if entry.what:
        said['description'] = entry.what
    if entry.causality == 'output':
        said['initial'] = 'calculated'
    value = {'unit': entry.unit}
    if entry.start is not None:
        value['start'] = number(entry.start).replace('(', '').replace(')', '')
    if version == 2:
        scalar = ElementTree.SubElement(parent, 'ScalarVariable', said)
        ElementTree.SubElement(scalar, 'Real', value)
    else:
        ElementTree.SubElement(parent, 'Float64', {**said, **value})
    return len(parent)


def _units(root: ElementTree.Element, names: Sequence[str]) -> None:
    definitions = ElementTree.SubElement(root, 'UnitDefinitions')
    for name in dict.fromkeys(names):
        unit = ElementTree.SubElement(definitions, 'Unit', {'name': name})
        if name in _BASE:
            ElementTree.SubElement(unit, 'BaseUnit', {
                base: str(power) for base, power in zip(('kg', 'm', 's', 'rad'), _BASE[name],
                                                        strict=True) if power})


def _structure(root: ElementTree.Element, version: int, outputs: Sequence[int]) -> None:
    structure = ElementTree.SubElement(root, 'ModelStructure')
    if version == 3:
        for tag in ('Output', 'InitialUnknown'):
            for place in outputs:
                ElementTree.SubElement(structure, tag, {'valueReference': str(place)})
        return
    for tag in ('Outputs', 'InitialUnknowns'):
        group = ElementTree.SubElement(structure, tag)
        for place in outputs:
            ElementTree.SubElement(group, 'Unknown', {'index': str(place)})


def _build_description() -> bytes:
    root = ElementTree.Element('fmiBuildDescription', {'fmiVersion': '3.0'})
    configuration = ElementTree.SubElement(root, 'BuildConfiguration', {'modelIdentifier': NAME})
    files_of = ElementTree.SubElement(configuration, 'SourceFileSet', {'language': 'C99'})
    for name in ('engb_model.c', 'fmi3.c'):
        ElementTree.SubElement(files_of, 'SourceFile', {'name': name})
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding='utf-8', xml_declaration=True))
