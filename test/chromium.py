# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A headless Chromium driven by its DevTools protocol: Debian's browser, and a socket of websockets.
"""

import atexit
import base64
import functools
import json
import os
import re
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
FLAGS = (
    '--headless=new',
    '--no-sandbox',
    '--disable-dev-shm-usage',
    '--disable-extensions',
    '--disable-background-networking',
    '--disable-component-update',
    '--no-first-run',
    '--mute-audio',
    '--hide-scrollbars',
    # Software rendering: WebGL without a graphics card.
    '--use-gl=angle',
    '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader',
    '--remote-debugging-port=0',
)
# Software draws a picture in seconds where other programs use the computer, too (s).
DEADLINE = 120.0
# Without a graphics card a scene in three dimensions takes all cores, as often as it is drawn:
# twice a second is enough to be seen.
FEW_FRAMES = """{
    const soon = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = draw => setTimeout(() => soon(draw), 500);
    window.cancelAnimationFrame = number => clearTimeout(number);
}"""
# The first pictures of a scene take such a computer a quarter of a minute.
NO_SCENE = """for (const name of ['drawArrays', 'drawElements'])
    for (const many of ['', 'Instanced'])
        WebGL2RenderingContext.prototype[name + many] = () => {};"""


def find_chromium() -> str:
    """Return Chromium's path, that of the variable CHROMIUM first; skip the test without one."""
    for name in (os.environ.get('CHROMIUM', ''), *NAMES):
        found = shutil.which(name) if name else None
        if found:
            return found
    pytest.skip('needs Chromium: apt install chromium, or its path in the variable CHROMIUM')


class Tab:
    """
    One page in the browser: what it logs, what it asks for, what it is told to do.

    It has cookies and a store of its own.
    """

    def __init__(self, address: str) -> None:
        connect = pytest.importorskip('websockets.sync.client', reason='needs websockets').connect
        self._socket = connect(address, max_size=None)
        self._number = 0
        self._answers: dict[int, dict[str, Any]] = {}
        self._session: str | None = None
        self._context = self.call('Target.createBrowserContext')['browserContextId']
        self.errors: list[str] = []
        self.requests: list[str] = []

    def open(self, url: str, width: int = 1400, height: int = 900, scene: bool = True) -> None:
        """Open a page in a window of a size; without its scene where no test looks at that."""
        created = self.call(
            'Target.createTarget', url='about:blank', browserContextId=self._context
        )
        target = created['targetId']
        self._session = self.call('Target.attachToTarget', targetId=target, flatten=True)[
            'sessionId'
        ]
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')
        self.call(
            'Page.addScriptToEvaluateOnNewDocument',
            source=FEW_FRAMES if scene else FEW_FRAMES + NO_SCENE,
        )
        self.resize(width, height)
        self.call('Page.navigate', url=url)

    def close(self) -> None:
        """Close the page, and forget its cookies and what it stored."""
        self._session = None
        self.call('Target.disposeBrowserContext', browserContextId=self._context)
        self._socket.close()

    def resize(self, width: int, height: int) -> None:
        """Give the window a size."""
        self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        self._number += 1
        number = self._number
        message = {'id': number, 'method': method, 'params': parameters}
        if self._session is not None:
            message['sessionId'] = self._session
        self._socket.send(json.dumps(message))
        deadline = time.monotonic() + DEADLINE
        while number not in self._answers:
            self._take(deadline - time.monotonic())
        answer = self._answers.pop(number)
        if 'error' in answer:
            raise RuntimeError(f'{method}: {answer["error"]}')
        return answer['result']

    def _take(self, seconds: float) -> None:
        message = json.loads(self._socket.recv(timeout=max(0.01, seconds)))
        if 'id' in message:
            self._answers[message['id']] = message
            return
        parameters = message['params']
        match message['method']:
            case 'Runtime.exceptionThrown':
                self.errors.append(str(parameters['exceptionDetails']))
            case 'Runtime.consoleAPICalled' if parameters['type'] in ('error', 'assert'):
                self.errors.append(str([a.get('value', a) for a in parameters['args']]))
            case 'Log.entryAdded' if parameters['entry']['level'] == 'error':
                self.errors.append(str(parameters['entry']))
            case 'Network.requestWillBeSent':
                self.requests.append(parameters['request']['url'])

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        result = self.call(
            'Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True
        )
        if 'exceptionDetails' in result:
            raise RuntimeError(f'{expression}: {result["exceptionDetails"]}')
        return result['result'].get('value')

    def wait_for(self, expression: str, what: str, seconds: float = DEADLINE) -> Any:
        """Return the value of an expression once it is true; fail after some seconds."""
        deadline = time.monotonic() + seconds
        while True:
            value = self.evaluate(expression)
            if value:
                return value
            if time.monotonic() > deadline:
                pytest.fail(f'after {seconds} s still not: {what}; errors: {self.errors}')
            time.sleep(0.05)

    def click(self, x: float, y: float) -> None:
        """Click somewhere in the page."""
        for kind in ('mousePressed', 'mouseReleased'):
            self.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left', clickCount=1)

    def press(self, key: str) -> None:
        """Press and release a key such as `End` or `ArrowRight`."""
        codes = {'End': 35, 'Home': 36, 'ArrowLeft': 37, 'ArrowRight': 39}
        for kind in ('rawKeyDown', 'keyUp'):
            self.call(
                'Input.dispatchKeyEvent',
                type=kind,
                key=key,
                code=key,
                windowsVirtualKeyCode=codes[key],
            )

    def screenshot(self, path: Path) -> bytes:
        """Write a picture of the page as PNG, and return it."""
        data = base64.b64decode(self.call('Page.captureScreenshot', format='png')['data'])
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return data


@contextmanager
def chromium_tab() -> Iterator[Tab]:
    """Yield a tab of the browser within the block."""
    tab = Tab(_browser())
    try:
        yield tab
    finally:
        tab.close()


@functools.cache
def _browser() -> str:
    # The address of a Chromium that runs until this process ends: its start takes a second of the
    # processor.
    binary = find_chromium()
    profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    process = subprocess.Popen(
        [binary, *FLAGS, f'--user-data-dir={profile.name}', 'about:blank'],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors='replace',
    )

    def end() -> None:
        process.terminate()
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        profile.cleanup()

    atexit.register(end)
    return _address(process)


def _address(process: 'subprocess.Popen[str]') -> str:
    found: list[str] = []
    ready = threading.Event()

    def read() -> None:
        for line in process.stderr or ():
            match = re.search(r'DevTools listening on (ws://\S+)', line)
            if match:
                found.append(match.group(1))
                ready.set()
        ready.set()

    threading.Thread(target=read, daemon=True).start()
    if not ready.wait(DEADLINE) or not found:
        process.kill()
        pytest.skip('Chromium is there but does not start')
    return found[0]
