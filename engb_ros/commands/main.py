# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The program `engb`: finds the command, runs it, and turns failures into one line.

A command is a module of this folder with `add_arguments(parser)` and `run(arguments)`, which may
return an exit status.
Only the module of the command that is called is imported: `engb --help` loads none.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import errno
import importlib
import importlib.util
import os
import signal
import sys
import textwrap
import threading
from types import FrameType, ModuleType
from typing import Any, NoReturn

from engb_core.blas_threads import one_blas_thread
from engb_core.errors import InputError
from engb_core.text.printable import make_printable, printable

__all__ = ['main', 'run_command']

# Exit status: fine, bad input or usage, a fault of the program's own; 128 and a signal's number.
FINE, BAD_INPUT, FAULT, BROKEN_PIPE = 0, 2, 70, 141

_PACKAGE = 'engb_ros.commands'

# Command → its module and what it does.
COMMANDS = {
    'demo': ('demo', 'the whole chain on a simulated brake: nodes, bag, model, diagnosis'),
    'diagnose': ('diagnose', 'find the physics that a model leaves out of a recording'),
    'model': ('model', 'the first model of any axis, from a table or a recording'),
    'identify': ('identify', 'identify a brake model from recorded strokes'),
    'adopt': ('adopt', 'give a law that a diagnosis found a name, as an effect of the library'),
    'check-effect': ('check_effect', 'whether an effect of your own is fit for use'),
    'predict': ('predict', 'what a model says about a recording, as numbers'),
    'export': ('export', 'take a model along: C, FMU, Modelica, MJCF, URDF, JSON'),
    'import': ('import_table', 'turn a table (.csv, .npz, .mat) into a recording'),
    'survey': ('survey', 'diagnose many recordings and compare the units'),
    'prove': ('prove', 'measure the diagnosis on cases whose truth is sealed'),
    'reproduce': ('reproduce', 'the figures of the paper from own simulations'),
}

_OVERVIEW = '''\
Brake actuators: where the model and the machine disagree, and what physics is missing.

commands:
{commands}

examples:
  engb demo --out out/demo
  engb diagnose bench.csv --out result
  engb diagnose run1 --model nominal.yaml --out result
  engb diagnose train --model nominal.yaml --holdout test --out result
  engb predict run1 --model result/model.yaml --out run1.npz

Each command has its own help: engb diagnose --help'''


class _Parser(argparse.ArgumentParser):
    """Complains in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f'{self.prog}: {message}; see {self.prog} --help\n')


class _Stopped(BaseException):
    """A signal that ends the program, raised so that what is half-written gets cleared away."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


# What ends the program in an orderly way: Ctrl-C, `kill`, the terminal that was closed.
_SIGNALS = {name: getattr(signal, name) for name in ('SIGINT', 'SIGTERM', 'SIGHUP')
            if hasattr(signal, name)}
_TOLD = {'SIGINT': 'interrupted', 'SIGTERM': 'terminated', 'SIGHUP': 'hung up'}
# What can be done where the system refuses, by its error.
_REMEDIES = {errno.EACCES: '; name a place that you may read and write, or change its rights',
             errno.EPERM: '; name a place that you may read and write, or change its rights',
             errno.ENOENT: '; name one that is there',
             errno.ENOSPC: '; make room, or name another place',
             errno.EROFS: '; name a place that can be written to'}
# From a signal until it is given again, where the program goes on all the same [s]: what is
# half-written is cleared away long before.
_AGAIN = 5.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `engb` with these arguments (default: the process's own) and return the exit status.

    Status 0: done; 2: an input or an argument is wrong, told in one line on standard error;
    70: a fault of the program's own; 130: interrupted.
    """
    program = arguments is None
    one_blas_thread()
    given = list(sys.argv[1:] if arguments is None else arguments)
    name = next((word for word in given if not word.startswith('-')), None)
    make_printable(sys.stdout, sys.stderr)
    came: list[int] = []
    try:
        status = _guarded(lambda: _dispatch(name, given), came)
    except SystemExit as end:       # argparse: --help, --version, a wrong argument
        return end.code if isinstance(end.code, int) else (0 if end.code is None else BAD_INPUT)
    if program and came:
        # Threads that still compute what nobody will read would hold the process for minutes.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    return status


def _dispatch(name: str | None, given: list[str]) -> int:
    if name is None or given[0].startswith('-'):
        _overview().parse_args(given or ['--help'])
        return BAD_INPUT
    available = _available()
    if name not in available:
        import difflib
        near = difflib.get_close_matches(name, available, 1)
        hint = f'did you mean {near[0]}?' if near else f'there are {", ".join(available)}'
        raise InputError(f'no command {name!r}; {hint}')
    _quiet_warnings()
    return run_command(name, given[1:]) or FINE


def run_command(name: str, given: Sequence[str]) -> int | None:
    """Run a command with its own arguments, within this process; return its status, if any.

    Raises:
        InputError: what the command raises.
    """
    module = _load(name)
    parser = _parser(f'engb {name}', module.__doc__ or COMMANDS[name][1])
    module.add_arguments(parser)
    words = _one_by_one(given, parser)
    parsed, rest = parser.parse_known_args(words)
    if rest:
        # Recordings that stand between options, or what nobody knows.
        parsed = parser.parse_intermixed_args(words)
    parsed.command_line = ('engb', name, *given)      # to be repeated in advice
    # Under this name only: `engb prove --effects` means names.
    if hasattr(parsed, 'effects_folder'):
        from engb_ros.commands.common import read_effects
        read_effects(parsed.effects_folder)
    status: int | None = module.run(parsed)
    return status


def _one_by_one(given: Sequence[str], parser: argparse.ArgumentParser) -> list[str]:
    """Return the words with each NAME=VALUE behind an option of its own: the recording that comes
    behind several of them is none."""
    options = {option for action in parser._actions
               if action.nargs == '+' and '=' in str(action.metavar)
               for option in action.option_strings}
    made: list[str] = []
    option = ''
    for word in given:
        if option and made[-1] == option and not word.startswith('-'):
            made[-1] = f'{option}={word}'
        elif option and '=' in word and not word.startswith('-') and not os.path.exists(word):
            made.append(f'{option}={word}')
        else:
            option = word if word in options else ''
            made.append(word)
    return made


def _available() -> list[str]:
    return [name for name, (module, _) in COMMANDS.items()
            if importlib.util.find_spec(f'{_PACKAGE}.{module}')]


def _load(name: str) -> ModuleType:
    return importlib.import_module(f'{_PACKAGE}.{COMMANDS[name][0]}')


def _parser(program: str, text: str) -> argparse.ArgumentParser:
    """Make a parser whose help is `text`: its first paragraph on top, the rest below."""
    head, _, rest = textwrap.dedent(text).strip().partition('\n\n')
    return _Parser(prog=program, description=head, epilog=rest,
                   formatter_class=argparse.RawDescriptionHelpFormatter)


def _overview() -> argparse.ArgumentParser:
    lines = '\n'.join(f'  {name:<12} {COMMANDS[name][1]}' for name in _available())
    parser = _Parser(prog='engb', usage='engb COMMAND …', description=_OVERVIEW.format(
        commands=lines), formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--version', action='version', version=f'engb {_version()}')
    return parser


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version
    try:
        return version('engb_ros')
    except PackageNotFoundError:
        return 'from source'


def _quiet_warnings() -> None:
    """Keep numpy's warnings off standard error, unless Python was told to show them."""
    if not sys.warnoptions:
        import warnings
        warnings.simplefilter('ignore')


def _guarded(action: Callable[[], int], came: list[int]) -> int:
    """Run `action`; whatever goes wrong ends in one line and a status.

    The numbers of signals that came are put into `came`.
    """
    given_again: list[threading.Timer] = []
    previous = _catch_signals(came, given_again)
    try:
        status = action()
        sys.stdout.flush()
        return status
    except InputError as error:
        return _complain(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        came.append(signal.SIGINT)
        return _stopped(signal.SIGINT)
    except _Stopped as stop:
        return _stopped(stop.number)
    except BrokenPipeError:
        # Whoever read our output has gone; Python's own flush at exit must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except MemoryError:
        return _complain('not enough memory for this input; give shorter recordings', BAD_INPUT)
    except OSError as error:
        if came:
            return _stopped(came[0])
        where = f'{os.fsdecode(error.filename)}: ' if error.filename else ''
        remedy = _REMEDIES.get(error.errno or 0, '')
        return _complain(f'{where}{error.strerror or error}{remedy}', BAD_INPUT)
    except Exception as error:
        # A signal in the midst of an import comes out of some modules as another error.
        if came:
            return _stopped(came[0])
        if os.environ.get('ENGB_TRACEBACK'):
            raise
        return _complain(f'a fault of the program ({type(error).__name__}: {error}); '
                         'ENGB_TRACEBACK=1 shows where', FAULT)
    finally:
        for timer in given_again:
            timer.cancel()
        for number, handler in previous.items():
            signal.signal(number, handler)


def _catch_signals(came: list[int], given_again: list[threading.Timer]) -> dict[int, Any]:
    """Have each signal raise `_Stopped` where the program is; return the handlers before.

    Python drops what is raised within a finalizer: the program would go on as if no signal had
    come. So each is given again after a while, by a timer that is put into `given_again`.
    """
    def stop(number: int, frame: FrameType | None) -> None:
        came.append(number)
        timer = threading.Timer(_AGAIN, os.kill, (os.getpid(), number))
        timer.daemon = True
        given_again.append(timer)
        timer.start()
        raise _Stopped(number)

    previous = {}
    for number in _SIGNALS.values():
        # What is ignored stays so: nohup ignores SIGHUP, a shell's background job SIGINT.
        if signal.getsignal(number) not in (signal.SIG_IGN, None):
            try:
                previous[number] = signal.signal(number, stop)
            except ValueError:      # not in the main thread
                break
    return previous


def _stopped(number: int) -> int:
    name = signal.Signals(number).name
    return _complain(_TOLD.get(name, name), 128 + number)


def _complain(message: str, status: int) -> int:
    print('engb: ' + printable(' '.join(message.split())), file=sys.stderr)
    return status


if __name__ == '__main__':
    sys.exit(main())
