# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What the pages say of the code is made from the code: python docs/from_code.py [--pictures]

A page has the lines `<!-- made from the code: topics -->` and `<!-- made until here -->` with the
table of the topics between them; `MAKERS` has what else there is. This command renews them all,
and what the notebook of `examples/` shows;
with `--pictures` also the pictures, which are those that a page's own command lines save. It needs
what the site needs: `pip install '.[ros,docs,plot]'`.

As a Sphinx extension it adds to the page of the library what only the site can show.
"""

import ast
import contextlib
import inspect
import io
import json
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from kinematics_service.__main__ import main

HERE = Path(__file__).parent
RUN = 'python -m kinematics_service'
BEGIN, END = '<!-- made from the code: {} -->', '<!-- made until here -->'
PLACE = re.compile(
    rf'^{BEGIN.format(chr(40) + "?P<what>[a-z_]+)")}$.*?^{END}$', re.MULTILINE | re.DOTALL
)
ON_THE_SITE = '<!-- on the site: the docstrings -->'
DRAWN = re.compile(r'^\$ python -m kinematics_service (plot .*--save (\S+\.svg))$', re.MULTILINE)
# The arms of the live example on the first page, and the file of their formulas.
LIVE_ARMS = ('planar_2r', 'craig_3r')
LIVE_FILE = HERE / 'front' / 'arms.js'
LIVE_HEAD = """/*
SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
SPDX-License-Identifier: Apache-2.0
*/
// Made by docs/from_code.py."""
SHOWN = re.compile(r'!\[[^\]]*\]\(([\w-]+\.svg)\)')


class MissingSentenceError(Exception):
    """The pages and the code do not fit together."""


def explained(names: Sequence[str], sentences: dict[str, str], what: str) -> None:
    """Raise where the names of the code and those that have a sentence differ."""
    for name in set(names) ^ set(sentences):
        have = 'no sentence' if name in names else 'a sentence, but does not exist'
        raise MissingSentenceError(f'{what} {name} has {have}: see docs/sentences.py')


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join(
        f'| {" | ".join(cell.replace("|", chr(92) + "|") for cell in line)} |' for line in lines
    )


def code(text: str) -> str:
    """Return a text as code, and nothing for nothing."""
    return f'`{text}`' if text else ''


# Topics, parameters: as a node has them


@contextlib.contextmanager
def some_node() -> Iterator[Any]:
    """Start a node that has every topic this machine allows."""
    import rclpy
    from rclpy.context import Context
    from rclpy.logging import LoggingSeverity, set_logger_level
    from rclpy.parameter import Parameter

    from kinematics_service import bundled_robots
    from kinematics_service.node.node import KinematicsNode

    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    context = Context()
    rclpy.init(args=['docs', '--ros-args', '--log-level', 'fatal'], context=context)
    wanted = [Parameter('publish_robot_description', value=True)]
    with contextlib.suppress(ImportError):
        import tf2_msgs  # noqa: F401

        wanted.append(Parameter('publish_tf', value=True))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, 'uncertain.yaml')
        # Of the position alone: redundant, so that there is a null space.
        text = bundled_robots()['planar_3r'].read_text(encoding='utf-8')
        text = re.sub(r'\n  factors:.*', '\n  task: [x, y]', text)
        file.write_text(f'{text}uncertainty: {{encoder_noise: 1e-4, velocity_noise: 1e-3}}\n')
        node = KinematicsNode(str(file), context=context, parameter_overrides=wanted)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()
        # The level is the process's, and outlives the context.
        set_logger_level('', LoggingSeverity.INFO)


def _kind(message: type) -> str:
    return f'{message.__module__.split(".")[0]}/{message.__name__}'


def _quality(qos: Any) -> str:
    durability = '' if qos.durability.name == 'VOLATILE' else ', transient-local'
    return f'{qos.reliability.name.lower().replace("_", " ")}{durability}, {qos.depth}'


def _topic_rows(node: Any) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    own = f'/{node.get_name()}/'
    told = {
        p.topic: [_kind(p.msg_type), _quality(p.qos_profile)]
        for p in node.publishers
        if p.topic not in ('/parameter_events', '/rosout')
    }
    # Where tf2_msgs is not installed the node cannot have this one.
    told.setdefault('/tf', ['tf2_msgs/TFMessage', told['~/pose'][1]])
    heard = {
        s.topic_name.replace(own, '~/').removeprefix('/'): [
            _kind(s.msg_type),
            _quality(s.qos_profile),
        ]
        for s in node.subscriptions
        if s.topic_name not in ('/clock',)
    }
    return told, heard


def topics() -> str:
    """Return the topics of a node with types and quality of service."""
    from sentences import HEARD_TOPICS, TOPICS

    from kinematics_service.robot.measures import MEASURES

    spoken = TOPICS | {f'~/singularity/{one.name}': one.meaning for one in MEASURES.values()}
    with some_node() as node:
        told, heard = _topic_rows(node)
    explained(list(told), spoken, 'the topic')
    explained(list(heard), HEARD_TOPICS, 'the topic')
    head = ('topic', 'type and content', 'quality of service')
    parts = []
    for title, rows, sentences in (
        ('What the node publishes', told, spoken),
        ('What the node hears', heard, HEARD_TOPICS),
    ):
        cells = [
            [code(name), f'*{kind}*: {sentences[name]}', quality]
            for name, (kind, quality) in rows.items()
        ]
        parts.append(f'## {title}\n\n{table(head, cells)}')
    return '\n\n'.join(parts)


def parameters() -> str:
    """Return the table of the parameters."""
    from kinematics_service.node.parameters.table import PARAMETERS, POINTS, ROBOT, TRANSPORT

    rows = [
        [code(one.name), code(_yaml(one.default)), _accepted(one), one.description]
        for one in (ROBOT, TRANSPORT, POINTS, *PARAMETERS)
    ]
    return table(('parameter', 'default', 'accepted', 'meaning'), rows)


def _yaml(default: Any) -> str:
    return str(default).lower() if isinstance(default, bool) else str(default) or "''"


def _accepted(one: Any) -> str:
    if one.choices:
        return ', '.join(code(choice) for choice in one.choices)
    words = ['true or false'] if isinstance(one.default, bool) else []
    words += [_listed(one)] if isinstance(one.default, list) else []
    if one.range is not None:
        words.append(f'{one.range[0]:g} to {one.range[1]:g}')
    if one.least:
        words.append(f'0, or at least {one.least:g}')
    return '; '.join(words) or 'a text'


def _listed(one: Any) -> str:
    return f'empty, or {one.numbers} numbers' if one.numbers else 'a list of texts'


# The robot file: as its reader takes it


def conventions() -> str:
    """Return the table of the conventions."""
    from kinematics_service.robot.file.parts.convention_table import CONVENTIONS

    rows = []
    for one in CONVENTIONS.values():
        before = ' and '.join(name for _, name in one.before_joint)
        of_link_before = f', {before} being those of the link before' if before else ''
        name = code(one.name) + (f' ({one.author})' if one.author else '')
        rows.append([name, (one.product or one.written) + of_link_before])
    return table(('Convention', 'A row is'), rows)


def robot_file() -> str:
    """Return the keys of a robot file, part by part."""
    from sentences import ROBOT_FILE

    from kinematics_service.robot.file.parts import schema as schema

    parts = []
    for kind, (title, intro, sentences) in ROBOT_FILE.items():
        entry = getattr(schema, kind)
        explained(tuple(entry.checks), sentences, f'{entry.noun}: the key')
        rows = [
            [code(key), 'yes' if key in entry.required else '', _value(entry, key), text]
            for key, text in sentences.items()
        ]
        head = ('key', 'required', 'value', 'meaning')
        parts.append(f'## {title}\n\n{intro}\n\n{table(head, rows)}')
    return '\n\n'.join(parts)


def _value(entry: Any, key: str) -> str:
    from kinematics_service.robot.file.text import entries
    from kinematics_service.robot.file.text.yaml_document import ScalarNode

    kinds = {
        entries.Word: 'text',
        entries.Formula: 'text',
        entries.Citation: 'text',
        entries.Number: 'number',
        entries.Whole: 'whole number',
        entries.Truth: '`true` or `false`',
        entries.Numbers: 'list of numbers',
        entries.Pair: 'two numbers',
        entries.Triple: 'three numbers',
        entries.Words: 'list of words',
    }
    hints = get_type_hints(entry, include_extras=True)
    hint = hints[key if key in hints else f'{key}_']
    if not hasattr(hint, '__metadata__'):  # a part of its own
        return ''
    if hint in kinds:
        return kinds[hint]
    try:
        hint.__metadata__[0](ScalarNode('?', 0, quoted=False))
    except entries.WrongValue as refusal:
        accepted = re.search(r'\(accepted: (.*)\)', str(refusal))
        if accepted:
            return ', '.join(code(word) for word in accepted[1].split(', '))
    raise MissingSentenceError(f'{entry.noun}: the key {key} takes what no reader knows')


# Commands, measures, robots, the library


def groups() -> str:
    """Return the commands by groups."""
    from kinematics_service.cli.commands import GROUPS

    rows = [
        [code(name), group, words]
        for group, members in GROUPS.items()
        for name, words in members.items()
    ]
    return table(('command', 'use', 'what it does'), rows)


def commands() -> str:
    """Return the help of every command, as `--help-all` prints it."""
    from kinematics_service.cli.commands import command_group

    group = command_group()
    context = group.make_context(RUN, [], resilient_parsing=True)
    parts = [f'## The node\n\n{_help(group, context)}']
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        within = command.make_context(name, [], parent=context, resilient_parsing=True)
        parts.append(f'## {name}\n\n{_help(command, within)}')
    return '\n\n'.join(parts)


def _help(command: Any, context: Any) -> str:
    from kinematics_service.cli.commands import show_everything

    show_everything(command)
    context.terminal_width = context.max_content_width = 92
    return f'```text\n{command.get_help(context).rstrip()}\n```'


def measures() -> str:
    """Return the measures of singularity with their default thresholds."""
    from kinematics_service.robot.measures import MEASURES

    rows = [
        [
            code(one.name),
            one.meaning,
            'small' if one.small_is_bad else 'large',
            *('none' if t is None else f'{t:g} {one.unit}'.strip() for t in (one.warn, one.stop)),
        ]
        for one in MEASURES.values()
    ]
    return table(('measure', 'what it says', 'bad when', 'WARN', 'ERROR'), rows)


def robots() -> str:
    """Return what the command `robots` prints."""
    return f'```text\n{_printed("robots").rstrip()}\n```'


def library() -> str:
    """Return a table of the public names for each subject, with what each says first."""
    from sentences import LIBRARY

    import kinematics_service as ks

    parts = []
    for title, names in _public_names(ks, LIBRARY).items():
        rows = [
            [code(f'ks.{name}{_arguments(ks, name)}'), _first_sentence(ks, name)] for name in names
        ]
        parts.append(f'## {title}\n\n{table(("name", "what it is"), rows)}')
    return '\n\n'.join(parts)


def _public_names(ks: Any, rooms: dict[str, str]) -> dict[str, list[str]]:
    names = [name for name in ks.__all__ if not name.startswith('_')]
    classes = {name for name in names if isinstance(getattr(ks, name), type)}
    errors = {name for name in classes if issubclass(getattr(ks, name), Exception)}
    functions = [name for name in names if name not in classes]
    homes = {name: getattr(ks, name).__module__.partition('.')[2] for name in functions}
    room = {
        name: max(
            (one for one in rooms if f'{home}.'.startswith(f'{one}.')), key=len, default=home
        )
        for name, home in homes.items()
    }
    explained(list(dict.fromkeys(room.values())), rooms, 'the room')
    return {
        **{
            title: [name for name in functions if rooms[room[name]] == title]
            for title in rooms.values()
        },
        'Results and settings': [name for name in names if name in classes - errors],
        'Errors': [name for name in names if name in errors],
    }


def _arguments(ks: Any, name: str) -> str:
    value = getattr(ks, name)
    if isinstance(value, type):
        return ''
    listed = inspect.signature(value).parameters.values()
    return f'({", ".join(one.name for one in listed)})'


def _first_sentence(ks: Any, name: str) -> str:
    return ' '.join(inspect.cleandoc(getattr(ks, name).__doc__).split('\n\n')[0].split())


CODE = re.compile(r'[a-z][a-z0-9]*(-[a-z0-9]+)*')
# Functions that take the code of a fault after its message.
TAKES_CODE = {'fault', 'warn', 'refuse', 'note', 'Reason', 'YamlError', '_refuse'}
# Functions that return an error whose code is their name.
NAMED_AS_CODE = {'unknown_name', 'wrong_shape'}


def _codes(tree: ast.AST) -> Iterator[str]:
    # Yield the codes of errors and faults in a module.
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword):
            values = [node.value] if node.arg == 'code' else []
        elif isinstance(node, ast.Assign):
            pairs = [(node.targets[0], node.value)]
            if isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(node.targets[0].elts, node.value.elts))
            values = [v for t, v in pairs if isinstance(t, ast.Name) and t.id == 'code']
        elif isinstance(node, ast.Call):
            name = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
            # The fault of a row of a table has its report and column first.
            of_row = name == 'fault' and getattr(node.args[0], 'id', '') == 'report'
            values = node.args[3 if of_row else 1 :] if name in TAKES_CODE else []
            if name in NAMED_AS_CODE:
                yield name.replace('_', '-')
        else:
            continue
        for value in values:
            for part in (value.body, value.orelse) if isinstance(value, ast.IfExp) else (value,):
                text = getattr(part, 'value', None)
                if isinstance(text, str) and CODE.fullmatch(text):
                    yield text


def error_codes() -> str:
    """Return a table of the codes of errors, with the parts of the package that raise them."""
    import kinematics_service as ks
    from kinematics_service import errors

    package = Path(ks.__file__).parent
    kinds = (kind for name, kind in vars(errors).items() if name.endswith('Error'))
    rooms = {kind.code: {'errors'} for kind in kinds}
    for file in set(package.rglob('*.py')) - {Path(errors.__file__)}:
        folders = file.relative_to(package).parts[:-1]
        room = next((name for name in folders if name != 'apps'), 'errors')
        for code in _codes(ast.parse(file.read_text(encoding='utf-8'))):
            rooms.setdefault(code, set()).add(room)
    rows = [(f'`{code}`', ', '.join(sorted(rooms[code]))) for code in sorted(rooms)]
    return table(('Code', 'Raised in'), rows)


def docstrings() -> str:
    """Return a directive of autodoc for each public name."""
    from sentences import LIBRARY

    import kinematics_service as ks

    parts = []
    for title, names in _public_names(ks, LIBRARY).items():
        kinds = ['class' if isinstance(getattr(ks, name), type) else 'function' for name in names]
        directives = '\n'.join(
            f'.. auto{kind}:: kinematics_service.{name}' for kind, name in zip(kinds, names)
        )
        parts.append(f'### {title}, in full\n\n```{{eval-rst}}\n{directives}\n```')
    return '\n\n'.join(parts)


MAKERS: dict[str, Callable[[], str]] = {
    'topics': topics,
    'parameters': parameters,
    'conventions': conventions,
    'robot_file': robot_file,
    'groups': groups,
    'commands': commands,
    'measures': measures,
    'robots': robots,
    'library': library,
    'error_codes': error_codes,
}

# Pages and pictures


def _printed(line: str) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        result = main(shlex.split(line))
    if result:
        raise MissingSentenceError(f'{RUN} {line} ended with exit code {result}')
    return printed.getvalue()


def renewed(text: str) -> str:
    """Return a page with what is made from the code made anew."""
    return PLACE.sub(
        lambda place: f'{BEGIN.format(place["what"])}\n\n{MAKERS[place["what"]]()}\n\n{END}', text
    )


def draw(page: Path, text: str) -> None:
    """Draw the pictures of a page, beside it."""
    lines = {name: line for line, name in DRAWN.findall(text)}
    for name in SHOWN.findall(text):
        if name not in lines:
            raise MissingSentenceError(f'{page}: no command line of this page saves {name}')
        _printed(lines[name].replace(name, str(page.with_name(name))))


def run_notebook(notebook: dict[str, Any]) -> None:
    """Run the cells of a notebook in order, and put what the last line of each shows into it."""
    names: dict[str, Any] = {'__name__': '__main__'}
    count = 0
    for cell in notebook['cells']:
        if cell['cell_type'] != 'code':
            continue
        count += 1
        body = ast.parse(''.join(cell['source'])).body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        exec(compile(ast.Module(body, []), 'cell', 'exec'), names)
        cell.update(execution_count=count, outputs=[])
        if last is not None:
            shown = eval(compile(ast.Expression(last.value), 'cell', 'eval'), names)
            data = {'text/plain': repr(shown)}
            for kind, name in (('text/html', '_repr_html_'), ('text/latex', '_repr_latex_')):
                if hasattr(shown, name):
                    data[kind] = getattr(shown, name)()
            lines = {kind: text.splitlines(keepends=True) for kind, text in data.items()}
            cell['outputs'] = [
                {
                    'output_type': 'execute_result',
                    'execution_count': count,
                    'metadata': {},
                    'data': lines,
                }
            ]


def live_arms() -> str:
    """Return the formulas of the live example, each arm an object of functions."""
    parts = []
    for name in LIVE_ARMS:
        code = _printed(f'derive {name} --code js').replace('export function', 'function')
        names = ', '.join(re.findall(r'^function (\w+)', code, re.MULTILINE))
        parts.append(f'const {name} = (() => {{\n{code}\nreturn {{ {names} }};\n}})();\n')
    return f'{LIVE_HEAD}\n' + '\n'.join(parts)


def renew(pictures: bool) -> None:
    """Renew every page and notebook, and pictures where that is asked for."""
    LIVE_FILE.write_text(live_arms(), encoding='utf-8')
    for file in sorted((HERE.parent / 'examples').glob('*.ipynb')):
        notebook = json.loads(file.read_text(encoding='utf-8'))
        run_notebook(notebook)
        text = json.dumps(notebook, indent=1, ensure_ascii=False)
        file.write_text(text + '\n', encoding='utf-8')
    for page in sorted(HERE.rglob('*.md')):
        text = page.read_text(encoding='utf-8')
        new = renewed(text)
        if new != text:
            page.write_text(new, encoding='utf-8')
            print(f'wrote {page.relative_to(HERE.parent)}')
        if pictures:
            draw(page, new)


def fill(app: Any, page: str, source: list[str]) -> None:
    """Put into a page of the site what only the site can show."""
    if ON_THE_SITE in source[0]:
        source[0] = source[0].replace(ON_THE_SITE, docstrings())
        app.env.note_reread()  # in every build: the page does not change where the code does


def setup(app: Any) -> dict[str, bool]:
    """Register the extension."""
    app.connect('source-read', fill)
    return {'parallel_read_safe': False}


if __name__ == '__main__':
    renew('--pictures' in sys.argv[1:])
