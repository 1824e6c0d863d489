"""The workflow and the scripts it runs: what they name exists."""

import ast
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = ('.ci/run', '.ci/floors')
pytestmark = pytest.mark.skipif(
    not (ROOT / '.ci').is_dir(), reason='the scripts are not beside the tests'
)


def jobs():
    yaml = pytest.importorskip('yaml')
    workflow = yaml.safe_load((ROOT / '.github/workflows/ci.yaml').read_text(encoding='utf-8'))
    return workflow['jobs'].values()


def steps():
    return [step for job in jobs() for step in job['steps']]


def extras():
    for node in ast.walk(ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8'))):
        if isinstance(node, ast.keyword) and node.arg == 'extras_require':
            return {key.value for key in node.value.keys}
    return set()


def test_each_step_is_an_action_of_a_version_or_a_command():
    found = steps()
    assert len(found) > 10
    for step in found:
        if 'uses' in step:
            assert re.fullmatch(r'actions/[a-z-]+@[0-9a-f]{40}', step['uses'])
        else:
            command = step['run'].split()[0]
            assert command == 'python' or (
                command in SCRIPTS and os.access(ROOT / command, os.X_OK)
            )


def test_the_command_of_the_readme_runs_the_tests_everywhere():
    files = [ROOT / 'README.md', *(ROOT / script for script in SCRIPTS)]
    texts = [file.read_text(encoding='utf-8') for file in files]
    texts += [step.get('run', '') for step in steps()]
    found = [word for text in texts for word in re.findall(r'-m pytest\b *([^&|`\n]*)', text)]
    assert len(found) >= 7
    assert {word.strip() for word in found} == {'', '-p no:cacheprovider'}


def test_what_is_installed_are_extras_of_the_package():
    texts = [step.get('run', '') for step in steps()]
    texts += [(ROOT / script).read_text(encoding='utf-8') for script in SCRIPTS]
    texts.append((ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8'))
    lists = [found for text in texts for found in re.findall(r"'\.\[([\w,-]+)\]'", text)]
    assert len(lists) >= 5
    assert {extra for found in lists for extra in found.split(',')} <= extras()


def test_every_python_that_the_package_names_is_tested_and_has_a_wheel():
    (versions,) = re.findall(
        r'Python :: 3\.\{minor\}.* range\((\d+), (\d+)\)',
        (ROOT / 'setup.py').read_text(encoding='utf-8'),
    )
    named = {f'3.{minor}' for minor in range(*map(int, versions))}
    tested = [job.get('strategy', {}).get('matrix', {}).get('python', []) for job in jobs()]
    assert {version for one in tested for version in one} == named
    wheels = re.findall(r'"cp3(\d+)-', (ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
    assert {f'3.{minor}' for minor in wheels} == named


def test_files_that_a_step_names_exist():
    named = [step['with'].get('cache-dependency-path') for step in steps() if 'with' in step]
    assert all((ROOT / file).is_file() for file in named if file)


@pytest.mark.parametrize('script', SCRIPTS)
def test_a_script_is_read_by_its_shell(script):
    done = subprocess.run(['bash', '-n', ROOT / script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, '')
