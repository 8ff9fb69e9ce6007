# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Words by which titles of tables say what a column is, in the languages that benches speak.

Languages that write no blanks (Chinese, Japanese, Korean) are looked for inside of a title, all
others as whole words.
"""

from __future__ import annotations

from collections.abc import Iterable
import re
import unicodedata

__all__ = ['CURRENT', 'KNOWN', 'OWN', 'REFERENCE', 'count_known', 'hits_of', 'title_words']


def _set(*lines: str) -> frozenset[str]:
    return frozenset(word for line in lines for word in line.split())


# Of the words for effort those that are a current's.
CURRENT = _set('current curr cur i iq strom amps ampere motorstrom motorcurrent courant mot_i',
               'iact imot corriente corrente stroom prąd prad proud ström ток 電流 电流 전류')
KNOWN = {
    'time': _set(
        'time zeit timestamp stamp t elapsed zeitstempel temps tiempo tempo seconds datetime',
        'xvalue tijd tid czas čas cas время 時間 时间 時刻 시간'),
    'position': _set(
        'position pos posn phi theta q angle winkel lage enc encoder x s weg stroke',
        'displacement alpha drehwinkel th rotation travel stellung actpos rotorangle',
        'shaftangle posizione angolo ángulo angulo posición posicion posição posicao hoek positie',
        'kąt kat położenie polozenie úhel uhel poloha vinkel läge угол положение позиция',
        '位置 角度 位移 위치 각도'),
    'velocity': _set(
        'velocity vel speed omega w n drehzahl geschwindigkeit rpm qd dq v dphi vitesse revs',
        'velocidad velocità velocita velocidade snelheid toerental prędkość predkosc rychlost',
        'otáčky otacky hastighet varvtal скорость 速度 转速 回転数 속도'),
    'effort': CURRENT | _set(
        'torque effort tau moment drehmoment trq tq m kraft force f load_torque mmot couple',
        'coppia koppel момент トルク 扭矩 转矩 力矩 토크'),
    'pad_temperature': _set('temp temperature temperatur температура 温度 온도'),
}
REFERENCE = _set(
    'ref reference cmd command commanded set setpoint soll sollwert target des desired goal',
    'demand demanded sp setp consigne consigna referencia referência riferimento gewenst zadana',
    'zadane zadany žádaná задание уставка 指令 目标 目標 设定 設定 给定 給定 목표 지령')
OWN = _set(
    'act actual ist istwert meas measured fb feedback motor mot rotor est estimate estimated',
    'silnika motore 电机 電機 モータ 实际 実際')
_WITHOUT_BLANKS = re.compile(r'[぀-ヿ㐀-鿿가-힯]')


def title_words(name: str) -> frozenset[str]:
    """Return a name's words, small: `MotorActPos`, `i_q` and `/joint_states/motor/position`."""
    name = unicodedata.normalize('NFKC', name)
    for greek, latin in zip('φϕθωτα', ('phi', 'phi', 'theta', 'omega', 'tau', 'alpha'),
                            strict=True):
        name = re.sub(f'(?<![Ͱ-Ͽ]){greek}(?![Ͱ-Ͽ])', f' {latin} ', name)
    apart = re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', name)
    words = [word for word in re.split(r'[\W\d_]+', apart) if word]
    joined = ''.join(words).casefold()
    found = {word.casefold() for word in words}
    if re.search(r'(^|[^a-z])i[_ .]?q([^a-z]|$)', name.casefold()):
        found = (found - {'q', 'i'}) | {'iq'}
    return frozenset(found | {joined})


def hits_of(words: Iterable[str], known: frozenset[str]) -> frozenset[str]:
    """Return the known words that stand in a title, given its words."""
    words = frozenset(words)
    inside = {entry for entry in known if _WITHOUT_BLANKS.search(entry)
              and any(entry in word for word in words)}
    return (words & known) | inside


def count_known(text: str) -> int:
    """Return how many words a text has that are known and not plain English letters: what tells
    the encoding in which it was written."""
    words = frozenset(word for word in title_words(text) if not word.isascii())
    return sum(len({entry for entry in hits_of(words, known) if not entry.isascii()})
               for known in (*KNOWN.values(), REFERENCE))
