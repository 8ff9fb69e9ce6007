# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Build of the ament_python package engb_ros (metadata stays here: colcon reads it)."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

PACKAGE = 'engb_ros'


class WithoutTests(build_py):
    """Leaves the tests that lie beside what `engb prove` needs out of the installation."""

    def find_package_modules(self, package, package_dir):
        """Return (package, module, file) of each module that is installed."""
        return [found for found in super().find_package_modules(package, package_dir)
                if not found[1].startswith('test_')]


setup(
    name=PACKAGE,
    version='0.1.0',
    description='Finds the physics that a brake actuator model leaves out; ROS 2 Jazzy nodes.',
    # colcon --symlink-install runs a link to this file in its build folder, without the README.
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    author='engb_ros maintainers',
    author_email='maintainers@engb-ros.invalid',
    maintainer='engb_ros maintainers',
    maintainer_email='maintainers@engb-ros.invalid',
    # `engb prove` draws and scores its cases with tests/proof, whose plant shares no code with the
    # packages: installed under a name of its own.
    packages=[*find_packages(exclude=['tests', 'tests.*', 'benchmarks', 'benchmarks.*']),
              'engb_proof'],
    package_dir={'engb_proof': 'tests/proof'},
    cmdclass={'build_py': WithoutTests},
    package_data={
        'engb_core': ['py.typed', '**/*.yaml', '**/*.json', 'export/c/*'],
        'engb_ros': ['py.typed', 'resource/*', 'launch/*', 'config/*'],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', ['engb_ros/resource/engb_ros']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', sorted(glob('engb_ros/launch/*.xml'))),
        (f'share/{PACKAGE}/config', sorted(glob('engb_ros/config/*'))),
    ],
    install_requires=[
        'setuptools',
        'numpy>=1.26',
        'scipy>=1.11',
        'pyyaml>=6.0',
        'rosbags>=0.11,<0.12',
    ],
    extras_require={
        # What makes it fast and the report zoomable; everything works without, and says so.
        'full': ['numba>=0.59', 'plotly>=5.15', 'matplotlib>=3.6', 'mcap>=1.1'],
        # pyarrow 26 needs numpy 2 and does not tell pip so: with numpy 1.26 it cannot be imported.
        # Tables of other people's benches beside .csv, .npz, .mat (v5) and ROS 1 bags.
        'tables': ['asammdf>=7.3', 'npTDMS>=1.7', 'pyarrow>=14,<26', 'h5py>=3.9'],
        'can': ['python-can>=4.3', 'cantools>=39', 'msgpack>=1.0'],
        'fleet': ['dask[distributed]>=2024.1', 'pandas>=2.1', 'pyarrow>=14,<26'],
        'test': ['pytest>=7.4', 'pytest-timeout', 'pytest-xdist', 'hypothesis', 'jsonschema',
                 'sympy'],
        'docs': ['sphinx>=7', 'myst-parser>=3'],
        # The tests that run what `engb export` makes, and FMUs and MJCF files as nominals.
        'simulators': ['fmpy>=0.3.20', 'mujoco>=3.4', 'cppcheck>=1.5'],
        'coverage': ['coverage>=7.10'],
        'mutants': ['cosmic-ray>=8.3,<9'],
        # Rivals in `engb prove --baselines`.
        'proof': ['pysindy>=2.0', 'pyoperon>=0.6'],
    },
    entry_points={
        'console_scripts': [
            'engb = engb_ros.commands.main:main',
            'plant = engb_ros.start:plant',
            'controller = engb_ros.start:controller',
            'disturbance_observer = engb_ros.start:disturbance_observer',
            'identifier = engb_ros.start:identifier',
            'recorder = engb_ros.start:recorder',
            'can_bridge = engb_ros.start:can_bridge',
            'drive_emulator = engb_ros.start:drive_emulator',
            'monitor = engb_ros.start:monitor',
            'excitation = engb_ros.start:excitation',
        ],
    },
    options={
        'develop': {'script_dir': f'$base/lib/{PACKAGE}'},
        'install': {'install_scripts': f'$base/lib/{PACKAGE}'},
    },
    zip_safe=False,
)
