# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check files that no test runs: words of the pages, names in benchmarks and workflows.

    python packaging/checks.py

prints each fault and ends with exit code 1 if there is one. It needs an environment with the
package and PyYAML; `.ci/run` and `.pre-commit-config.yaml` call it.
"""

import ast
import importlib
import os
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator, Sized
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
NAME = 'kinematics_service'
PACKAGE = ROOT / 'src' / NAME
RELEASE = 'packaging/release.py'
SCRIPTS = ('.ci/run', '.ci/floors')

# Words, or beginnings of words, that are not used, each with its replacement.
RETIRED = {
    'admission': 'origin check',
    'aim_': 'target',
    'angle_place': 'angle_index',
    'arm that is not there': 'simulated arm',
    'bench_of': 'sampler_of',
    'frame doctor': 'frame check',
    'Heard': 'LatestMessage or ActiveTopics',
    'Notice': 'StatusText',
    'notice_of': 'status text',
    'of its making': 'by itself',
    'patience': 'time-out',
    'reason_of_silence': 'why_no_messages',
    'so often': 'period or number of times',
    'stirring': 'with an event',
    'to the letter': 'exactly',
    'whoever': 'the client, the user, the node',
    'wire_': 'message or form',
}
# Wordings that slow a reader down, each with the wording to write instead.
WORDING = {
    'begin with the subject': r'(?:^|[.;:] )'
    r'(?:Of(?! course)|By(?! default)|Where|What|In which) [a-z]',
    'write the number': r'\b(?:so many|so much|as near|this share|by so|than this|what is left)\b',
    'write if': r'\bwhere (?:nothing|none|no |it is not|they are|there is|there are|that is)\b',
    'name who says it': r'\b(?:is told|are told|is said|are said|stands? in|is heard|shall)\b',
    'write not or without': r'\b(?:is|are|was|were|be) no(?!w| longer| more| less)(?:ne)? [a-z]',
}
# Largest number of such wordings in 1,000 words, for all pages and for each folder of the package.
# Four packages of others have 0.4 to 0.8.
MAX_WORDINGS = 1.0
# Smallest number of files, words and so on. A check that finds fewer reads the wrong folder.
MIN_IMPORTS = 21
MIN_STEPS = 11
MIN_TEST_COMMANDS = 6
MIN_EXTRAS = 5
MIN_TEST_FILES = 5
MIN_FOLDERS = 12
MIN_SOURCE_FILES = 800
# The lines of https://reuse.software that each source file begins with.
LICENCE_TAGS = ('SPDX-FileCopyrightText', 'SPDX-License-Identifier')


def nodes_of(file: Path) -> list[ast.AST]:
    """Return all nodes of the syntax tree of a file."""
    return list(ast.walk(ast.parse(file.read_text(encoding='utf-8'))))


def prose_of(page: Path) -> Iterator[str]:
    """Yield the lines of a page outside code blocks and tables."""
    is_code = False
    for line in page.read_text(encoding='utf-8').splitlines():
        if line.startswith('```'):
            is_code = not is_code
        elif not is_code and not line.startswith(('|', '    ')):
            yield line


def too_few(what: str, found: Sized, least: int) -> Iterator[str]:
    """Yield a fault if a check found too little, because then it reads the wrong folder."""
    if len(found) < least:
        yield f'only {len(found)} {what}: {Path(__file__).name} looks in the wrong place'


def retired_words() -> Iterator[str]:
    """Yield the places of words that docs/terms.md has replaced."""
    pages = [page for page in (ROOT / 'docs').rglob('*.md') if page.name != 'terms.md']
    word = re.compile(rf'(?<![A-Za-z])({"|".join(map(re.escape, RETIRED))})')
    for file in [*PACKAGE.rglob('*.py'), *pages]:
        for old in word.findall(file.read_text(encoding='utf-8')):
            yield f'{file.relative_to(ROOT)}: {old!r} is now {RETIRED[old]!r}'


def texts_of(file: Path) -> Iterator[str]:
    """Yield the lines of the docstrings and the comments of a Python file."""
    for node in nodes_of(file):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield from (ast.get_docstring(node) or '').splitlines()
    with file.open('rb') as source:
        for token in tokenize.tokenize(source.readline):
            if token.type == tokenize.COMMENT:
                yield token.string.lstrip('# ')


def plain_words() -> Iterator[str]:
    """Yield the wordings that slow a reader down, if a text has more than `MAX_WORDINGS`."""
    patterns = {name: re.compile(pattern) for name, pattern in WORDING.items()}
    pages = [*(ROOT / 'docs').rglob('*.md'), ROOT / 'README.md', ROOT / 'CONTRIBUTING.md']
    folders = [
        file.parent
        for file in [*PACKAGE.glob('*/__init__.py'), *PACKAGE.glob('apps/*/__init__.py')]
        if file.parent.name != 'apps'
    ]
    yield from too_few('folders of the package', folders, MIN_FOLDERS)
    texts = [[(page, line) for page in pages for line in prose_of(page)]]
    for folder in folders:
        texts.append([(file, text) for file in folder.rglob('*.py') for text in texts_of(file)])
    for lines in texts:
        words = sum(len(line.split()) for _, line in lines)
        found = [
            f'{file.relative_to(ROOT)}: {name}: {line}'
            for file, line in lines
            for name, pattern in patterns.items()
            if pattern.search(line)
        ]
        if len(found) > MAX_WORDINGS * words / 1000:
            yield from found


def exists(module: str, name: str) -> bool:
    """Return whether `from module import name` succeeds."""
    try:
        return hasattr(importlib.import_module(module), name) or bool(
            importlib.import_module(f'{module}.{name}')
        )
    except ImportError:
        return False


def names_in_benchmarks() -> Iterator[str]:
    """Yield the names that benchmarks import and the package does not have."""
    kernel = importlib.import_module(f'{NAME}.kernel')
    taken = set[tuple[str, str]]()
    for file in sorted((ROOT / 'bench').glob('*.py')):
        for node in nodes_of(file):
            if isinstance(node, ast.ImportFrom) and (node.module or '').split('.')[0] == NAME:
                module = node.module or ''
                if find_spec('rclpy') is None and module.startswith(f'{NAME}.node'):
                    continue
                taken |= {(module, alias.name) for alias in node.names}
            elif (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == 'kernel'
                and not hasattr(kernel, node.attr)
            ):
                yield f'bench/{file.name}: the kernel has no {node.attr}'
    yield from too_few('imports of benchmarks', taken, MIN_IMPORTS)
    for module, name in sorted(taken):
        if not exists(module, name):
            yield f'bench: {module} has no {name}'


def jobs() -> list[dict[str, Any]]:
    """Return the jobs of both workflows."""
    import yaml

    files = [ROOT / f'.github/workflows/{name}.yaml' for name in ('ci', 'release')]
    texts = [file.read_text(encoding='utf-8') for file in files]
    return [job for text in texts for job in yaml.safe_load(text)['jobs'].values()]


def steps() -> Iterator[str]:
    """Yield steps of workflows, and scripts, that name files that do not exist."""
    found = [step for job in jobs() for step in job['steps']]
    yield from too_few('steps of workflows', found, MIN_STEPS)
    for step in found:
        if 'uses' in step:
            if not re.fullmatch(r'actions/[a-z-]+@[0-9a-f]{40}', step['uses']):
                yield f'workflow: {step["uses"]} is not an action pinned to a commit'
        elif (command := step['run'].split()[0]) != 'python' and not (
            command in SCRIPTS and os.access(ROOT / command, os.X_OK)
        ):
            yield f'workflow: {command} is neither python nor one of {SCRIPTS}'
        file = step.get('with', {}).get('cache-dependency-path')
        if file and not (ROOT / file).is_file():
            yield f'workflow: there is no {file}'
    for script in SCRIPTS:
        done = subprocess.run(['bash', '-n', ROOT / script], capture_output=True, text=True)
        if done.returncode:
            yield f'{script}: {done.stderr}'


def commands() -> Iterator[str]:
    """Yield test commands that are not the README's, and extras and files that do not exist."""
    texts = [(ROOT / file).read_text(encoding='utf-8') for file in ('README.md', *SCRIPTS)]
    texts += [step.get('run', '') for job in jobs() for step in job['steps']]
    found = re.findall(r'-m pytest\b *([^&|`\n]*)', '\n'.join(texts))
    yield from too_few('commands of tests', found, MIN_TEST_COMMANDS)
    # .ci/run collects the tests once before it runs them.
    usual = {'', '-p no:cacheprovider', '--collect-only -qq -p no:cacheprovider'}
    for options in {options.partition(' >')[0].strip() for options in found} - usual:
        yield f'the tests run with {options}, not as in the README'
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    extras = set(re.findall(r"^ +'([\w-]+)': ", setup, re.MULTILINE))
    texts.append((ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8'))
    found = re.findall(r"'\.\[([\w,-]+)\]'", '\n'.join(texts))
    yield from too_few('lists of extras', found, MIN_EXTRAS)
    for extra in {extra for listed in found for extra in listed.split(',')} - extras:
        yield f'there is no extra {extra}'
    found = [
        file
        for name in (RELEASE, 'pyproject.toml')
        for file in re.findall(r'test/[\w/]+\.py', (ROOT / name).read_text(encoding='utf-8'))
    ]
    yield from too_few('files of tests of a wheel', found, MIN_TEST_FILES)
    for file in {file for file in found if not (ROOT / file).is_file()}:
        yield f'there is no {file}, which a wheel is tested with'


def python_versions() -> Iterator[str]:
    """Yield a fault if setup.py, tests and wheels differ in their Python versions."""
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    (versions,) = re.findall(r'Python :: 3\.\{minor\}.* range\((\d+), (\d+)\)', setup)
    named = {f'3.{minor}' for minor in range(*map(int, versions))}
    matrices = [job.get('strategy', {}).get('matrix', {}) for job in jobs()]
    tested = {version for matrix in matrices for version in matrix.get('python', [])}
    runs = [step.get('run', '') for job in jobs() for step in job['steps']]
    released = next(run for run in runs if run.startswith(f'python {RELEASE}')).split()[2:]
    (constant,) = re.findall(
        r'^PYTHONS = (.*)$', (ROOT / RELEASE).read_text(encoding='utf-8'), re.MULTILINE
    )
    if not named == tested == set(released) == set(ast.literal_eval(constant)):
        yield f'Python {named} in setup.py, {tested} tested, {released} and {constant} released'


def licences() -> Iterator[str]:
    """Yield source files without copyright and licence; `reuse lint` checks the others."""
    folders = ('src', 'test', 'packaging', 'docs', 'bench', 'examples', 'config')
    files = [
        ROOT / 'setup.py',
        *(file for name in folders for file in (ROOT / name).rglob('*.py')),
    ]
    yield from too_few('source files', files, MIN_SOURCE_FILES)
    for file in files:
        lines = file.read_text(encoding='utf-8').splitlines()[:3]
        if not all(any(tag in line for line in lines) for tag in LICENCE_TAGS):
            yield f'{file.relative_to(ROOT)}: begin with the lines {" and ".join(LICENCE_TAGS)}'


def main() -> int:
    """Print all faults; return the exit code."""
    checks = (
        *(retired_words, plain_words, names_in_benchmarks, steps, commands, python_versions),
        licences,
    )
    faults = [fault for check in checks for fault in check()]
    print(*faults, sep='\n', end='\n' if faults else '')
    return bool(faults)


if __name__ == '__main__':
    sys.exit(main())
