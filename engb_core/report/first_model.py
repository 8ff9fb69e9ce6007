# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A first model on one page: its numbers, the load and friction behind them, what is not told."""

from __future__ import annotations

import os

import numpy as np

from engb_core.identify.first_model import FirstModel
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.report.figures import Axis, Figure, Line, Panel, Points
from engb_core.report.layout import Column, Page
from engb_core.report.wording import number

__all__ = ['write_first_model_page']


def write_first_model_page(path: str | os.PathLike[str], first: FirstModel) -> None:
    """Write the page, whole or not at all."""
    linear = first.model.joint.type == 'prismatic'
    angle, torque = ('m', 'N') if linear else ('rad', 'N·m')
    page = Page('First model – engb model')
    page.header('First model', f'Load: {first.scores[0].form}', [
        f'What is left is {number(first.rms, 3)} {torque} rms; the noise is '
        f'{number(first.noise, 3)} {torque}. What the model leaves out is for a diagnosis.'])
    page.section('Its numbers')
    page.table([Column('Number'), Column('Value', number=True), Column('±', number=True),
                Column('Unit'), Column('')], [
        (name, number(entry.value, 4), number(entry.std, 2), entry.unit,
         '' if entry.determined else 'not determined') for name, entry in first.numbers.items()])
    if first.not_told:
        page.section('What could not be told')
        page.notes(first.not_told)
    page.section('What was compared')
    model = first.model
    order = np.argsort(first.position)
    load = load_torques(nominal_vector(model), first.position)
    dynamic = (model.motor.inertia * first.acceleration
               + model.motor.viscous_friction * first.velocity)
    dry = model.friction.coulomb * np.sign(first.velocity)
    page.figure(Figure('Load over position', Axis('Position', angle), (Panel(
        Axis('Torque', torque),
        (Points('measured, less inertia and friction', first.position,
                first.effort - dynamic - dry),
         Line('model', first.position[order], load[order], 'after')), 240, zero=True),),
        alt='Measured load and the model\'s load over position.'))
    order = np.argsort(first.velocity)
    page.figure(Figure('Friction over speed', Axis('Velocity', f'{angle}/s'), (Panel(
        Axis('Torque', torque),
        (Points('measured, less inertia and load', first.velocity,
                first.effort - model.motor.inertia * first.acceleration - load),
         Line('model', first.velocity[order],
              (dry + model.motor.viscous_friction * first.velocity)[order], 'after')), 240,
        zero=True),), alt='Measured friction and the model\'s over velocity.'))
    page.section('Forms of the load that were weighed')
    page.table([Column('Form'), Column('Numbers', number=True),
                Column('Mean square larger by', number=True),
                Column('± standard error', number=True),
                Column('Error where left out of the fit', number=True)], [
        (score.form, str(score.numbers), number(score.behind, 3), number(score.error, 2),
         f'{number(score.rms, 3)} {torque}') for score in first.scores], chosen=[0],
        caption='Each block of time is predicted by a fit to all others; of the forms that are '
                'as good as the best, but for chance, the one with the fewest numbers is taken. '
                'Larger by: as a part of the best form\'s mean square.')
    page.write(path)
