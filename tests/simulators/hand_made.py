# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Compiles hand_made.c, an FMU that nothing of this project wrote, with a machine's numbers."""

from __future__ import annotations

from pathlib import Path
import subprocess
import tempfile
import zipfile

from engb_core.export.fmu import compiler

from .mujoco_pairs import Machine

__all__ = ['hand_made_unit']

SOURCE = Path(__file__).with_name('hand_made.c')
DESCRIPTION = '''<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="HandMade" guid="{by-hand}"
                     variableNamingConvention="structured">
  <CoSimulation modelIdentifier="hand_made" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit>
    <Unit name="rad"><BaseUnit rad="1"/></Unit>
    <Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
  </UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="motor.tau" valueReference="0" causality="input"
                    variability="continuous"><Real unit="N.m" start="0"/></ScalarVariable>
    <ScalarVariable name="motor.angle" valueReference="1" causality="output"
                    variability="continuous"><Real unit="rad"/></ScalarVariable>
    <ScalarVariable name="motor.speed" valueReference="2" causality="output"
                    variability="continuous"><Real unit="rad/s"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2"/><Unknown index="3"/></Outputs>
    <InitialUnknowns><Unknown index="2"/><Unknown index="3"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
'''


def hand_made_unit(machine: Machine, path: Path) -> Path:
    """Compile the unit with the numbers of a machine; returns its path.

    Raises:
        RuntimeError: there is no C compiler.
    """
    with_what = compiler()
    if with_what is None:
        raise RuntimeError('no C compiler (cc, gcc, clang)')
    numbers = {'INERTIA': machine.inertia, 'DAMPING': machine.damping, 'CONTACT': machine.contact,
               'FRICTION': machine.friction,
               **{f'LOAD_{power}': value for power, value in enumerate(machine.load, 1)}}
    with tempfile.TemporaryDirectory() as scratch:
        library = Path(scratch) / 'hand_made.so'
        subprocess.run([with_what, '-std=c99', '-O2', '-Wall', '-Wextra', '-Werror', '-shared',
                        '-fPIC', *(f'-D{name}={value!r}' for name, value in numbers.items()),
                        str(SOURCE), '-o', str(library), '-lm'], check=True, timeout=120)
        with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
            archive.writestr('modelDescription.xml', DESCRIPTION)
            archive.write(library, 'binaries/linux64/hand_made.so')
            archive.write(SOURCE, 'sources/hand_made.c')
    return path
