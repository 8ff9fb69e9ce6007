# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A real UDP multicast bus that refuses frames the way Linux does: ENOBUFS, from outside.

It takes the place of python-can's udp_multicast. Its channel is 'FILE,GROUP': while the file is
there, sends are refused for the reason in it. As a program it runs a node with such a bus.
"""

import errno
from pathlib import Path
import sys

import can
from can.interfaces.udp_multicast import UdpMulticastBus

__all__ = ['RefusingBus']


class RefusingBus(UdpMulticastBus):
    """Refuses while the file is there: 'once', 'full' (no error number), or an errno's name."""

    def __init__(self, channel, **options):
        path, _, group = channel.rpartition(',')
        self._path = Path(path or '/nowhere')
        super().__init__(channel=group, **options)

    def send(self, msg, timeout=None):
        """Refuse for the reason in the file, or send."""
        try:
            word = self._path.read_text()
        except OSError:
            return super().send(msg, timeout)
        if word == 'once':
            self._path.unlink(missing_ok=True)
        if word == 'full':   # python-can's own word where select finds no room: no number
            raise can.CanOperationError('Transmit buffer full')
        number = getattr(errno, word, errno.ENOBUFS)
        raise can.CanOperationError('Failed to transmit', number)


if __name__ == '__main__':
    from importlib import import_module
    sys.modules['refusing_bus'] = sys.modules['__main__']
    can.interface.BACKENDS['udp_multicast'] = ('refusing_bus', 'RefusingBus')
    name = sys.argv.pop(1)
    sys.exit(import_module(f'engb_ros.nodes.{name}').main())
