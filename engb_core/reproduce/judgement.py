"""How far each way of identifying is off, in words made from the numbers."""

from __future__ import annotations

from collections.abc import Sequence

from engb_core.report.wording import MINUS
from engb_core.reproduce import chosen
from engb_core.reproduce.identification_chapter import Bias, COARSE_COUNTS, COARSE_INTERVAL

__all__ = ['judgement']


def judgement(biases: Sequence[Bias]) -> list[str]:
    """Return paragraphs on the biases of `identification_chapter.biases`."""
    recordings = list(dict.fromkeys(entry.recording for entry in biases))
    good, poor, coarse = ({entry.way: entry for entry in biases if entry.recording == name}
                          for name in recordings)
    true_gain = chosen.true_brake().friction.load_gain
    by_number, nearest = poor['samples paired by number'], poor['nearest neighbour, 400 points']
    few = poor['nearest neighbour, 40 points']
    wrong = poor['nearest neighbour, J and B of the classical step test']
    joint_name = 'joint regression, J, B and cogging known from the free motor'
    joint = poor[joint_name]
    return [
        'The simulated brake’s truth is known, so the ways can be judged. What the resampling '
        'repairs: under poor tracking, samples paired by number lie '
        f'{by_number.mismatch:.1f} rad apart (rms), the load is off by {_milli(by_number.load)} '
        f'and load leaks into friction: C₁ is {_signed(by_number.load_gain)} off the true '
        f'{true_gain:.4f}. Nearest neighbours lie {1e3 * nearest.mismatch:.0f} mrad apart; the '
        f'load is then off by {_milli(nearest.load)}, C₁ by {_signed(nearest.load_gain)}, and '
        f'with a tenth of the grid points by {_signed(few.load_gain)}: as the paper claims. '
        'Interpolation in the place of the nearest sample changes little: C₁ '
        f'{_signed(poor["interpolated, 400 points"].load_gain)}.',
        'What it does not repair: clamp and release pass the same position at different speeds '
        'when tracking is poor, and at low speed friction is then not odd (the hysteresis term '
        f'of (39)). C₁ is {_signed(good["nearest neighbour, 400 points"].load_gain)} off under '
        f'good tracking, {_signed(nearest.load_gain)} under poor. Nor does it repair a wrong B: '
        'what a classical step test puts too much into B is missing from C₀ '
        f'({_milli(wrong.coulomb, signed=True)}).',
        'Joint regression needs no pairs. Given J, B and the cogging with their intervals from '
        f'the free motor, on the poorly tracked strokes it is off by {_milli(joint.load)} in '
        f'the load and {_signed(joint.load_gain)} in C₁, and tells its own uncertainty.',
        f'At {1.0 / COARSE_INTERVAL:.0f} Hz and {COARSE_COUNTS} counts a revolution, the low '
        'precision that the paper complains of, '
        f'the load is best by {_best(coarse, "load")}, C₀ by {_best(coarse, "coulomb")}, C₁ by '
        f'{_best(coarse, "load_gain")}. That is one recording with one noise: it ranks the ways '
        'here, and says nothing of how near they come elsewhere.',
    ]


def _best(ways: dict[str, Bias], number: str) -> str:
    name = min(ways, key=lambda way: abs(getattr(ways[way], number)))
    return f'“{name}”'


def _milli(value: float, signed: bool = False) -> str:
    text = f'{1e3 * value:+.2f}' if signed else f'{1e3 * value:.2f}'
    return text.replace('-', MINUS) + ' mN·m'


def _signed(value: float) -> str:
    return f'{value:+.4f}'.replace('-', MINUS)
