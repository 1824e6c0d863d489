# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make the pictures of the README anew: python docs/make_pictures.py [demo] [view] [audit].

Each is a picture of the program at work: the demo in a terminal of tmux, drawn as an SVG that
moves; `view` and the page of an audit in Chromium. It needs tmux, Chromium, Pillow and
`pip install '.[ros,test,view]'`.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.style import Style
from rich.text import Text

import kinematics_service as ks

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / 'docs' / 'front'
RUN = [sys.executable, '-m', 'kinematics_service']
ENVIRONMENT = {**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}

# The terminal, in characters, and how often it is looked at (s).
COLUMNS, LINES = 98, 24
FRAMES, INTERVAL = 30, 0.4
# The demo has begun, and its histories have some length, after this time (s).
BEFORE = 12.0

# A character, in the units of the SVG, and the margin around all of them.
WIDE, HIGH, MARGIN = 8.4, 18, 14
# The window, in pixels, and how long software may take to draw in it (s).
WINDOW, DRAWN = (1280, 800), 8.0

PAPER, INK = '#1b1e24', '#d6d8dc'
LETTERS = f'font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="14" fill="{INK}"'
# Of the terminal's numbers of colours: red, green, yellow.
INKS = {1: '#f0655f', 2: '#6cc070', 3: '#e0b548'}


# The demo


def demo() -> None:
    """Write the demo as an SVG whose frames follow each other for ever."""
    socket = f'pictures{os.getpid()}'
    command = ' '.join([*RUN, 'demo', '--robot', 'ur5e'])
    size = ['-x', str(COLUMNS), '-y', str(LINES)]
    tmux = ['tmux', '-L', socket]
    subprocess.run([*tmux, 'new-session', '-d', *size, command], env=ENVIRONMENT, check=True)
    try:
        time.sleep(BEFORE)
        frames = [captured(tmux) for _ in range(FRAMES)]
    finally:
        subprocess.run([*tmux, 'kill-server'], check=False)
    (FOLDER / 'demo.svg').write_text(moving(frames), encoding='utf-8')


def captured(tmux: Sequence[str]) -> list[str]:
    """Return the lines of the terminal as SVG, and wait for the next frame."""
    began = time.monotonic()
    shown = subprocess.run(
        [*tmux, 'capture-pane', '-e', '-p'], capture_output=True, text=True, check=True
    ).stdout
    lines = Text.from_ansi(shown).split('\n', allow_blank=True)
    drawn = [''.join(drawn_line(line, row)) for row, line in enumerate(lines[:LINES])]
    time.sleep(max(0.0, INTERVAL - (time.monotonic() - began)))
    return drawn


def drawn_line(line: Text, row: int) -> Iterator[str]:
    """Yield each run of a style of a line as a text of the SVG."""
    column = 0
    for text, style, _ in line.render(Console(color_system='truecolor')):
        begins, column = column, column + len(text)
        if text.strip():
            yield drawn_run(text.rstrip(), style or Style(), row, begins)


def drawn_run(text: str, style: Style, row: int, column: int) -> str:
    """Return words of one style at their place; lengths are fixed, whatever the font."""
    column, text = column + len(text) - len(text.lstrip()), text.lstrip()
    x, y = MARGIN + column * WIDE, MARGIN + row * HIGH
    ink = INKS.get(style.color.number or 0, INK) if style.color else INK
    box = ''
    if style.reverse:
        size = f'width="{len(text) * WIDE:g}" height="{HIGH}"'
        box = f'<rect x="{x:g}" y="{y:g}" {size} fill="{ink}"/>'
        ink = PAPER
    words = {'fill': '' if ink == INK else ink, 'font-weight': 'bold' if style.bold else ''}
    extra = ''.join(f' {name}="{value}"' for name, value in words.items() if value)
    length = f'textLength="{len(text) * WIDE:g}"'
    return f'{box}<text x="{x:g}" y="{y + 0.75 * HIGH:g}" {length}{extra}>{escape(text)}</text>'


def moving(frames: Sequence[Sequence[str]]) -> str:
    """Return an SVG that shows frames one after the other, and each line once where it stays."""
    rows = [[frame[row] for frame in frames] for row in range(max(map(len, frames)) - 1)]
    # Without animation, or where it is not wanted, one frame is seen: at the singular pose.
    still = next((k for k, frame in enumerate(frames) if 'ERROR' in frame[0]), 0)
    parts = []
    for row in rows:
        for begin, end in stretches(row):
            parts.append(during(row[begin], begin, end, len(row), still))
    width, height = COLUMNS * WIDE + 2 * MARGIN, (LINES - 1) * HIGH + 2 * MARGIN
    total = len(frames) * INTERVAL
    return '\n'.join(
        [
            '<svg xmlns="http://www.w3.org/2000/svg" xml:space="preserve" '
            f'viewBox="0 0 {width:g} {height:g}" {LETTERS}>',
            '<style>',
            'text { white-space: pre }',
            f'.m {{ animation: {total:g}s step-end infinite }}',
            '@media (prefers-reduced-motion) { .m { animation: none } }',
            *keyframes(rows),
            '</style>',
            f'<rect width="{width:g}" height="{height:g}" rx="8" fill="{PAPER}"/>',
            *[part for part in parts if part],
            '</svg>\n',
        ]
    )


def stretches(row: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Yield the first frame of each stretch in which a line stays, and the first after it."""
    begins = [k for k in range(len(row)) if k == 0 or row[k] != row[k - 1]]
    return zip(begins, [*begins[1:], len(row)])


def during(drawn: str, begin: int, end: int, count: int, still: int) -> str:
    """Return a line that is seen from one frame up to another."""
    if not drawn or (begin, end) == (0, count):
        return drawn
    hidden = '' if begin <= still < end else ' visibility="hidden"'
    return f'<g class="m" style="animation-name: k{begin}-{end}"{hidden}>{drawn}</g>'


def keyframes(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield an animation for each stretch of frames in which a line stays."""
    for begin, end in sorted({stretch for row in rows for stretch in stretches(row)}):
        steps = {0.0: 'hidden', 100.0 * begin / len(rows[0]): 'visible'}
        if end < len(rows[0]):
            steps[100.0 * end / len(rows[0])] = 'hidden'
        told = ' '.join(f'{at:.4g}% {{ visibility: {seen} }}' for at, seen in steps.items())
        yield f'@keyframes k{begin}-{end} {{ {told} }}'


# Pages


def view() -> None:
    """Write the page of `view` at a singular pose."""
    command = [*RUN, 'view', '--robot', 'puma560', '--sliders', '--port', '0']
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            said = process.stdout.readline() if process.stdout else ''
            address = re.match(r'http://[\d.]+:\d+', said)
            if address is None:
                raise RuntimeError(f'view says no address: {said}')
            view_at(address[0])
        finally:
            process.terminate()
    smaller(FOLDER / 'view.png')


def view_at(address: str) -> None:
    """Write the page at an address, in a singular pose."""
    button = "[...document.querySelectorAll('button')].find(b => b.textContent == 'Singular pose')"
    level = "document.querySelector('#kin-gauges [data-level]').dataset.level"
    # The browser's own remark that it draws without a graphics card.
    remark = "document.querySelector('.mantine-Notification-closeButton')"
    with tab() as browser:
        browser.open(address, *WINDOW)
        browser.wait_for(f'{button} != null', 'the page')
        browser.evaluate(f'{button}.click()')
        browser.wait_for(f"{level} == 'ERROR'", 'the singular pose')
        browser.evaluate(f'void ({remark} && {remark}.click())')
        time.sleep(DRAWN)
        browser.screenshot(FOLDER / 'view.png')


def audit() -> None:
    """Write the head of the page of an audit."""
    robot = ks.load_robot('ur5e')
    start = np.array([0.0, -1.2, 1.4, -1.6, -1.2, 0.0])
    way = np.array([0.4, -0.2, 0.3, 0.0, 1.6, 0.2])
    t = np.arange(0.0, 4.0, 0.01)
    q = start + np.outer(0.5 - 0.5 * np.cos(np.pi * t / 2.0), way)
    head = ','.join(['stamp', *(f'position.{name}' for name in robot.joint_names)])
    with tempfile.TemporaryDirectory() as folder:
        np.savetxt(
            Path(folder) / 'run.csv',
            np.column_stack([t + 100.0, q]),
            '%.9f',
            ',',
            header=head,
            comments='',
        )
        subprocess.run(
            [*RUN, 'audit', 'run.csv', '--robot', 'ur5e', '--html', 'run.html'],
            cwd=folder,
            check=True,
        )
        with tab() as browser:
            browser.open(f'file://{folder}/run.html', 1180, 900)
            browser.wait_for("document.readyState == 'complete'", 'the page')
            browser.screenshot(FOLDER / 'audit.png')
    smaller(FOLDER / 'audit.png')


def tab() -> Any:
    """Return the browser of the tests."""
    sys.path.insert(0, str(ROOT / 'test'))
    from chromium import chromium_tab

    return chromium_tab()


def smaller(path: Path) -> None:
    """Keep 128 colours of a picture."""
    from PIL import Image

    image = Image.open(path).convert('RGB').quantize(128, dither=Image.Dither.NONE)
    image.save(path, optimize=True)


if __name__ == '__main__':
    makers = {'demo': demo, 'view': view, 'audit': audit}
    FOLDER.mkdir(exist_ok=True)
    for name in sys.argv[1:] or makers:
        makers[name]()
