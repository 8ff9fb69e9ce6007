"""The program `engb`: finds the command, runs it, and turns failures into one line.

A command is a module of this folder with `add_arguments(parser)` and `run(arguments)`, which may
return an exit status.
Only the module of the command that is called is imported: `engb --help` loads none.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import importlib
import importlib.util
import os
import signal
import sys
import textwrap
from types import FrameType, ModuleType
from typing import Any, NoReturn

from engb_core.errors import InputError

__all__ = ['main']

# Exit status: fine, bad input or usage, a fault of the program's own, stopped by Ctrl-C.
FINE, BAD_INPUT, FAULT, INTERRUPTED, BROKEN_PIPE = 0, 2, 70, 130, 141

_PACKAGE = 'engb_ros.commands'

# Command → its module and what it does.
COMMANDS = {
    'demo': ('demo', 'the whole chain on a simulated brake: nodes, bag, model, diagnosis'),
    'diagnose': ('diagnose', 'find the physics that a model leaves out of a recording'),
    'identify': ('identify', 'identify a brake model from recorded strokes'),
    'predict': ('predict', 'what a model says about a recording, as numbers'),
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
  engb diagnose run1 --model nominal.yaml --out result
  engb diagnose train --model nominal.yaml --holdout test --out result
  engb predict run1 --model result/model.yaml --out run1.npz

Each command has its own help: engb diagnose --help'''


class _Parser(argparse.ArgumentParser):
    """Complains in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f'{self.prog}: {message}; see {self.prog} --help\n')


class _Terminated(BaseException):
    """SIGTERM, raised so that what is half-written gets cleared away."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `engb` with these arguments (default: the process's own) and return the exit status.

    Status 0: done; 2: an input or an argument is wrong, told in one line on standard error;
    70: a fault of the program's own; 130: interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    name = next((word for word in given if not word.startswith('-')), None)
    try:
        return _guarded(lambda: _dispatch(name, given))
    except SystemExit as end:       # argparse: --help, --version, a wrong argument
        return end.code if isinstance(end.code, int) else (0 if end.code is None else BAD_INPUT)


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
    module = _load(name)
    parser = _parser(f'engb {name}', module.__doc__ or COMMANDS[name][1])
    module.add_arguments(parser)
    parsed = parser.parse_args(given[1:])
    parsed.command_line = ('engb', *given)      # to be repeated in advice
    _quiet_warnings()
    return module.run(parsed) or FINE


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
    lines = '\n'.join(f'  {name:<10} {COMMANDS[name][1]}' for name in _available())
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


def _guarded(action: Callable[[], int]) -> int:
    """Run `action`; whatever goes wrong ends in one line and a status."""
    previous = _catch_terminate()
    try:
        status = action()
        sys.stdout.flush()
        return status
    except InputError as error:
        return _complain(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain('interrupted', INTERRUPTED)
    except _Terminated:
        return _complain('terminated', 128 + signal.SIGTERM)
    except BrokenPipeError:
        # Whoever read our output has gone; Python's own flush at exit must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except MemoryError:
        return _complain('not enough memory for this input; give shorter recordings', BAD_INPUT)
    except OSError as error:
        where = f'{error.filename}: ' if error.filename else ''
        return _complain(f'{where}{error.strerror or error}', BAD_INPUT)
    except Exception as error:
        if os.environ.get('ENGB_TRACEBACK'):
            raise
        return _complain(f'a fault of the program ({type(error).__name__}: {error}); '
                         'ENGB_TRACEBACK=1 shows where', FAULT)
    finally:
        if previous is not None:
            signal.signal(signal.SIGTERM, previous)


def _catch_terminate() -> Any:
    def terminate(number: int, frame: FrameType | None) -> None:
        raise _Terminated

    try:
        return signal.signal(signal.SIGTERM, terminate)
    except ValueError:      # not in the main thread
        return None


def _complain(message: str, status: int) -> int:
    print('engb: ' + ' '.join(message.split()), file=sys.stderr)
    return status


if __name__ == '__main__':
    sys.exit(main())
