# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Standard deviations of what was fitted, and numbers that the data can't determine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from engb_core.diagnose.constants import CLEAN_EXCESS, FORMULA_MISSES, STANDS_OUT
from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.diagnose.discrepancy import (
    coordinate_cells,
    discrepancy_covariance,
    PARTS,
    state_cells,
)
from engb_core.diagnose.objective import added_by
from engb_core.diagnose.optimise.descent import delay_held
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.normal_equations import normal_equations
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.effects.base import Effect

__all__ = ['autocorrelation', 'estimates', 'inflation', 'noise_covariance', 'reported_covariance',
           'reported_deviations', 'stands_out', 'vector_covariance', 'vector_deviations']

# From this many times what is believed beforehand on a deviation leaves that, to rounding.
UNTOLD = float(np.finfo(float).eps ** -0.5)
# How often a change by as much as itself is halved until a prediction stays alike.
HALVES = 10


def vector_deviations(fit: Fit, fitter: Fitter, by_noise_alone: bool = False,
                      ) -> NDArray[np.float64]:
    """Return the standard deviation of each entry of the fit's vector.

    From the Fisher information of the filtered values with the residual's own size and colour
    (autocorrelation) rather than the noise's, and, unless `by_noise_alone`, from the discrepancy
    of a model that is only nearly right: as large as what is left above the noise, or as what may
    be there unseen. The prior's part is left out: an entry that only the prior holds gets a large
    deviation. The others are not to suffer from that: where the data leave a parameter of an
    effect freer than its bounds, these count as knowledge of it.
    """
    told = _Information.of(fit, fitter)
    deviations = np.zeros(fit.vector.size)
    deviations[told.free] = _beside_bounds(told.noise, told.width, told.loose) \
        if told.loose.any() else _deviations(told.noise)
    if by_noise_alone:
        return deviations
    return np.hypot(deviations, np.sqrt(np.diag(_by_discrepancy(told, fit, fitter))))


def reported_deviations(fit: Fit, fitter: Fitter, number: Effect | None = None,
                        ) -> NDArray[np.float64]:
    """Return the standard deviation of each entry of a finished fit's vector as it is told: with
    what another formulation of the same physics may put it to. `number` is an effect whose
    parameters are nominal numbers of the fit."""
    told, count = _Information.of(fit, fitter), len(fit.hypothesis.numbers)
    with np.errstate(over='ignore'):    # What no data tell may be infinitely far off.
        variance = vector_deviations(fit, fitter) ** 2
    if number is not None and _has_other_formulas(number):
        variance += np.diag(_by_formula(told, fit, fitter, number, _added_by_number(fit, number)))
    for index, adds, covariance in _by_formulas(told, fit, fitter):
        variance += np.diag(covariance)
        if fit.hypothesis.variants[index].effect.multimodal:
            for entry, (owner, _, _) in enumerate(fit.hypothesis.places, count):
                if owner == index:
                    variance[entry] += _alike_within(fit, fitter, entry, adds) ** 2
    return np.sqrt(variance)


def noise_covariance(fit: Fit, fitter: Fitter) -> NDArray[np.float64]:
    """Return the covariance (size, size) that noise leaves the entries of a finished fit's
    vector."""
    return _Information.of(fit, fitter).by_noise


def vector_covariance(fit: Fit, fitter: Fitter) -> NDArray[np.float64]:
    """Return the covariance (size, size) of the entries of the fit's vector, of the same parts as
    their deviations: noise, and the discrepancy, which moves several entries at once."""
    told = _Information.of(fit, fitter)
    return told.by_noise + _by_discrepancy(told, fit, fitter)


def reported_covariance(fit: Fit, fitter: Fitter) -> NDArray[np.float64]:
    """Return the covariance (size, size) of the entries with what other formulations of the
    effects' physics may put them to as well."""
    told = _Information.of(fit, fitter)
    covariance = told.by_noise + _by_discrepancy(told, fit, fitter)
    for _, _, by_formula in _by_formulas(told, fit, fitter):
        covariance += by_formula
    return covariance


@dataclass(frozen=True)
class _Information:
    """What a finished fit's values tell of its entries.

    Attributes:
        free: (size,) whether each entry was free.
        gram: (k, k) of the free ones, JᵀW²J.
        noise: the same as Fisher information, with the residual's size and colour.
        width: (k,) deviation of an even distribution between the bounds.
        loose: (k,) effects' parameters that the data leave freer than that.
        believed: (k,) deviation of what is believed of each beforehand.
    """

    free: NDArray[np.bool_]
    gram: NDArray[np.float64]
    noise: NDArray[np.float64]
    width: NDArray[np.float64]
    loose: NDArray[np.bool_]
    believed: NDArray[np.float64]

    @classmethod
    def of(cls, fit: Fit, fitter: Fitter) -> _Information:
        assert fit.jacobian is not None, 'the fit is finished'
        gram, _ = normal_equations(fit.jacobian, fit.residual, fitter.weight)
        free = np.ones(fit.vector.size, bool)
        held = delay_held(fit.hypothesis)
        if held is not None:
            # What was not free is known, and takes nothing from a lag that acts just like it.
            free[held] = False
        gram = gram[np.ix_(free, free)]
        noise = gram / inflation((fit.residual / fitter.spread)[fitter.fitted])
        width = _between_bounds(fit)[free]
        effects = (np.arange(free.size) >= len(fit.hypothesis.numbers))[free]
        return cls(free, gram, noise, width, effects & (_deviations(noise) > width),
                   fit.hypothesis.prior[1][free])

    @property
    def bounded(self) -> NDArray[np.float64]:
        """Return the information (k, k) that their bounds are of the loose ones, and, so that
        what the data do not tell at all is finite, to rounding what is believed of the others."""
        return np.diag(np.where(self.loose, self.width, UNTOLD * self.believed) ** -2.0)

    @property
    def by_noise(self) -> NDArray[np.float64]:
        """Return the covariance (size, size) that noise leaves all entries."""
        inverse, norm = _inverse(self.noise + self.bounded)
        return self.of_all(inverse / norm / norm[:, None])

    def of_all(self, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance (size, size) of all entries from that of the free ones (k, k):
        what was not free is known."""
        found = np.zeros((self.free.size, self.free.size))
        found[np.ix_(self.free, self.free)] = covariance
        return found


def _between_bounds(fit: Fit) -> NDArray[np.float64]:
    """Return the deviation (size,) of what is spread evenly between each entry's bounds."""
    low, high = fit.hypothesis.bounds
    width: NDArray[np.float64] = (high - low) / np.sqrt(12.0)
    return width


def _moved(told: _Information, fit: Fit, fitter: Fitter, scale: NDArray[np.float64],
           cells: NDArray[np.int64], size: float) -> NDArray[np.float64]:
    """Return the covariance (size, size) that a discrepancy gives to the entries, as
    `discrepancy_covariance` has it."""
    inverse, norm = _inverse(told.gram + told.bounded)
    assert fit.jacobian is not None, 'the fit is finished'
    return told.of_all(discrepancy_covariance(
        fit.jacobian[:, told.free] / norm, inverse, fitter.weight, scale, cells, size)
        / norm / norm[:, None])


def _by_discrepancy(told: _Information, fit: Fit, fitter: Fitter) -> NDArray[np.float64]:
    """Return the covariance (size, size) that the model's discrepancy gives to the entries."""
    unseen = max(reduced_chi_square(fit, fitter) - 1.0, CLEAN_EXCESS)
    return _moved(told, fit, fitter, fitter.sigma, state_cells(fitter), float(np.sqrt(unseen)))


def _has_other_formulas(effect: Effect) -> bool:
    """Whether its physics may be formulated in another way: a wrong number has but one formula,
    and a description without a name is none of physics."""
    return not (effect.number_only or effect.unnamed)


def _by_formula(told: _Information, fit: Fit, fitter: Fitter, effect: Effect,
                adds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance (size, size) that other formulations of an effect's physics give to
    the entries: what it adds (m,) may be off by another part of it, with a standard deviation of
    `FORMULA_MISSES`, in each part of the coordinate that reveals it."""
    return _moved(told, fit, fitter, adds, coordinate_cells(fitter, effect.reveals),
                  FORMULA_MISSES)


def _by_formulas(told: _Information, fit: Fit, fitter: Fitter,
                 ) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """Yield, of each of a fit's effects whose physics has other formulations, its place, what it
    adds (m,) [N·m], and the covariance (size, size) that these give to the entries."""
    for index, variant in enumerate(fit.hypothesis.variants):
        if _has_other_formulas(variant.effect):
            adds = added_by(fitter, fit, index)
            yield index, adds, _by_formula(told, fit, fitter, variant.effect, adds)


def _added_by_number(fit: Fit, effect: Effect) -> NDArray[np.float64]:
    """Return what an effect whose parameters are nominal numbers adds to the file's, (m,)."""
    assert fit.jacobian is not None, 'the fit is finished'
    names = {parameter.name for parameter in effect.parameters}
    moved = np.array([entry.name in names for entry in fit.hypothesis.numbers])
    change = (fit.vector - fit.hypothesis.prior[0])[:moved.size] * moved
    adds: NDArray[np.float64] = fit.jacobian[:, :moved.size] @ change
    return adds


def _alike_within(fit: Fit, fitter: Fitter, place: int, adds: NDArray[np.float64]) -> float:
    """Return by how much an entry of an effect that adds (m,) may be another before the prediction
    is another by more than other formulations of its physics are.

    Where the cost goes by jumps, derivatives tell how sharp the jumps are, not how sure the entry
    is. A discrepancy of `FORMULA_MISSES` in each part of a coordinate moves the entry, on average,
    as far as this part of the effect does that is in its direction.
    """
    weight = fitter.weight
    limit = FORMULA_MISSES / np.sqrt(PARTS) * float(np.linalg.norm(adds * weight))
    low, high = fit.hypothesis.bounds

    def alike(change: float) -> bool:
        moved = fit.vector.copy()
        moved[place] = np.clip(moved[place] + change, low[place], high[place])
        other = fitter.predict(fit.hypothesis, moved) - fit.predicted
        return bool(np.linalg.norm(other * weight) < limit)

    logarithmic = fit.hypothesis.parameter(place - len(fit.hypothesis.numbers)).logarithmic
    largest = np.log(2.0) if logarithmic else abs(float(fit.vector[place]))
    changes = largest * 0.5 ** np.arange(HALVES)
    return max(float(next((change for change in changes if alike(sign * change)), 0.0))
               for sign in (1.0, -1.0))


def _beside_bounds(information: NDArray[np.float64], width: NDArray[np.float64],
                   loose: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the deviations (size,), where effects' parameters that the data leave freer than
    `width` (size,), the `loose` ones, are held by that for all others."""
    def with_bounds(loose: NDArray[np.bool_]) -> NDArray[np.float64]:
        return _deviations(information + np.diag(np.where(loose, width, np.inf) ** -2.0))

    found = with_bounds(loose)
    for entry in np.flatnonzero(loose):
        # Its own bounds say nothing of what the data tell of it.
        found[entry] = with_bounds(loose & (np.arange(loose.size) != entry))[entry]
    return found


def _deviations(information: NDArray[np.float64]) -> NDArray[np.float64]:
    inverse, norm = _inverse(information)
    return np.sqrt(np.maximum(np.diag(inverse), 0.0)) / norm


def _inverse(information: NDArray[np.float64],
             ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the inverse (k, k) for numbers in units of 1/norm, and that norm (k,)."""
    norm = np.sqrt(np.diag(information))
    norm[norm == 0.0] = 1e-300
    inverse = np.linalg.pinv(information / norm / norm[:, None], rcond=1e-10, hermitian=True)
    return inverse.astype(np.float64), norm


def autocorrelation(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the autocorrelation of values (n,) from lag 1 on, as long as it stands out of what
    independent values have by chance (1/√n), up to a quarter of them (Box and Jenkins, Time Series
    Analysis (1970), section 2.1)."""
    centred = values - values.mean()
    whole = max(float(centred @ centred), 1e-300)
    least = STANDS_OUT / np.sqrt(values.size)
    found: list[float] = []
    for lag in range(1, values.size // 4):
        rho = float(centred[lag:] @ centred[:-lag]) / whole
        if rho < least:
            break
        found.append(rho)
    return np.array(found)


def inflation(residual: NDArray[np.float64]) -> float:
    """Return variance times the sum of the autocorrelation: what coloured residuals cost."""
    variance = float(np.mean(residual ** 2))
    if variance <= 0.0:
        return 1.0
    return variance * (1.0 + 2.0 * float(np.sum(autocorrelation(residual))))


def stands_out(fit: Fit, fitter: Fitter, variant: int, name: str = '') -> bool:
    """Return whether the data tell each size of an effect, or the one called `name`, from none.

    By noise alone: how wrong the formula may be is no question of there or not. Derivatives tell
    nothing of that where the cost goes by jumps: a gap that is never crossed to its end has no
    size, and is there. Where size and shape of an effect make up for each other, its size may be
    anything though it is there: one that stands out with the shape as it is does so, too, if by
    as much as the best of all shapes would ask (Scheffé, Biometrika 40 (1953) 87). Of several
    sizes each has to be told from the others as well.
    """
    if fit.hypothesis.variants[variant].effect.multimodal:
        return True
    deviations = vector_deviations(fit, fitter, by_noise_alone=True)
    offset = len(fit.hypothesis.numbers)
    entries = [entry for entry, (owner, _, run) in enumerate(fit.hypothesis.places)
               if owner == variant and run <= 0]
    sizes = [entry for entry in entries if fit.hypothesis.parameter(entry).none is not None]
    for entry in sizes:
        parameter = fit.hypothesis.parameter(entry)
        value, unit, none = fit.vector[offset + entry], 1.0, parameter.none
        if name not in ('', parameter.name):
            continue
        if parameter.logarithmic:
            value = unit = np.exp(value)
        apart = abs(value - none) / unit
        if apart >= STANDS_OUT * deviations[offset + entry]:
            continue
        if len(sizes) > 1 or len(entries) == 1:
            return False
        best_of_shapes = np.sqrt(chi2.isf(chi2.sf(STANDS_OUT ** 2, 1), len(entries)))
        held = [offset + other for other in entries if other != entry]
        if apart < best_of_shapes * _with_held(fit, fitter, held)[offset + entry]:
            return False
    return True


def _with_held(fit: Fit, fitter: Fitter, held: list[int]) -> NDArray[np.float64]:
    """Return the deviation (size,) that noise leaves each entry of a finished fit's vector beside
    some that are held; of those none."""
    told = _Information.of(fit, fitter)
    places = np.flatnonzero(told.free)
    left = ~np.isin(places, held)
    deviations = np.zeros(fit.vector.size)
    deviations[places[left]] = _deviations(told.noise[np.ix_(left, left)])
    return deviations


def estimates(fit: Fit, fitter: Fitter, variant: int) -> dict[str, ParameterEstimate]:
    """Return an effect's parameters with deviation and unit, as the contract names them."""
    assert fit.jacobian is not None, 'the fit is finished'
    deviations = reported_deviations(fit, fitter)
    offset = len(fit.hypothesis.numbers)
    width = _between_bounds(fit)
    found: dict[str, ParameterEstimate] = {}
    for entry, (owner, _, run) in enumerate(fit.hypothesis.places):
        if owner != variant or run > 0:
            continue
        parameter = fit.hypothesis.parameter(entry)
        value, std = float(fit.vector[offset + entry]), float(deviations[offset + entry])
        if parameter.logarithmic:
            value = float(np.exp(value))
            std *= value
        if parameter.kind == 'phase':
            value = float(np.remainder(value + np.pi, 2.0 * np.pi) - np.pi)
        std = float(np.hypot(std, parameter.form_steps * fitter.problem.scene.sampling))
        # What the data can't determine gets no deviation rather than a huge one.
        undetermined = std > 3.0 * max(abs(value), 1e-12) and (
            parameter.none is None or parameter.logarithmic)
        # Nor what acts on nothing in this variant, or in these recordings.
        undetermined |= not fit.jacobian[:, offset + entry].any()
        # Nor is it known less well than that it lies between its bounds.
        if not parameter.logarithmic:
            std = min(std, float(width[offset + entry]))
        found[parameter.name] = ParameterEstimate(value, None if undetermined else std,
                                                  parameter.unit)
    return found
