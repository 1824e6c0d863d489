"""
A Sphinx extension: what the reference says of the code is made from the code.

A page has the line `<!-- made from the code: topics -->` where the table of the topics belongs;
`MAKERS` has what else there is. The pictures of a page are those its own command lines save.
"""

import contextlib
import importlib.util
import io
import os
import re
import shlex
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from kinematics_service.__main__ import main

HERE = Path(__file__).parent
RUN = 'python -m kinematics_service'
PICTURES = HERE / 'pictures'
PLACE = re.compile(r'^<!-- made from the code: (\w+) -->$', re.MULTILINE)
DRAWN = re.compile(r'^\$ python -m kinematics_service (plot .*--save (\S+\.svg))$', re.MULTILINE)
SHOWN = re.compile(r'!\[([^\]]*)\]\(([\w-]+\.svg)\)')

WITHOUT_ROS = """
:::{note}
This part is left out here, because the site was built without ROS 2. Build it where
`pip install '.[ros,docs]'` has been run.
:::
"""


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
    from kinematics_service.ros.node.node import KinematicsNode

    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    context = Context()
    rclpy.init(args=['docs', '--ros-args', '--log-level', 'fatal'], context=context)
    wanted = [Parameter('publish_robot_description', value=True)]
    with contextlib.suppress(ImportError):
        import tf2_msgs  # noqa: F401

        wanted.append(Parameter('publish_tf', value=True))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, 'uncertain.yaml')
        text = bundled_robots()['puma560'].read_text(encoding='utf-8')
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
    told.setdefault('/tf', ['tf2_msgs/TFMessage', ''])
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
    try:
        with some_node() as node:
            told, heard = _topic_rows(node)
    except ImportError:
        return WITHOUT_ROS
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
    try:
        from kinematics_service.ros.parameters.table import PARAMETERS, POINTS, ROBOT, TRANSPORT
    except ImportError:
        return WITHOUT_ROS
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
        explained(entry.keys(), sentences, f'{entry.noun}: the key')
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
        entries.Citation: 'text',
        entries.Number: 'number',
        entries.Whole: 'whole number',
        entries.Truth: '`true` or `false`',
        entries.Numbers: 'list of numbers',
        entries.Pair: 'two numbers',
        entries.Triple: 'three numbers',
        entries.Words: 'list of words',
        Any: '',
    }
    hints = get_type_hints(entry, include_extras=True)
    hint = hints[key if key in hints else f'{key}_']
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


def commands() -> str:
    """Return the help of every command."""
    import typer

    from kinematics_service.cli.commands import app

    group = typer.main.get_command(app)
    context = group.make_context(RUN, [], resilient_parsing=True)
    parts = [f'## The node\n\n{_help(group, context)}']
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        within = command.make_context(name, [], parent=context, resilient_parsing=True)
        parts.append(f'## {name}\n\n{_help(command, within)}')
    return '\n\n'.join(parts)


def _help(command: Any, context: Any) -> str:
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
    """Return a directive of autodoc for each public name."""
    import kinematics_service as ks

    parts = []
    for title, names in _public_names(ks).items():
        directives = '\n'.join(_directive(ks, name) for name in names)
        parts.append(f'## {title}\n\n```{{eval-rst}}\n{directives}\n```')
    return '\n\n'.join(parts)


def _public_names(ks: Any) -> dict[str, list[str]]:
    names = [name for name in ks.__all__ if not name.startswith('_')]
    classes = {name for name in names if isinstance(getattr(ks, name), type)}
    errors = {name for name in classes if issubclass(getattr(ks, name), Exception)}
    return {
        'Functions': [name for name in names if name not in classes],
        'Results and settings': [name for name in names if name in classes - errors],
        'Errors': [name for name in names if name in errors],
    }


def _directive(ks: Any, name: str) -> str:
    if not isinstance(getattr(ks, name), type):
        return f'.. autofunction:: kinematics_service.{name}'
    return f'.. autoclass:: kinematics_service.{name}'


MAKERS: dict[str, Callable[[], str]] = {
    'topics': topics,
    'parameters': parameters,
    'conventions': conventions,
    'robot_file': robot_file,
    'commands': commands,
    'measures': measures,
    'robots': robots,
    'library': library,
}

# Pictures: as the command lines of a page draw them


def _printed(line: str) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        result = main(shlex.split(line))
    if result:
        raise MissingSentenceError(f'{RUN} {line} ended with exit code {result}')
    return printed.getvalue()


def with_pictures(page: str, text: str) -> str:
    """Return a page whose pictures are drawn, or left out where matplotlib is missing."""
    lines = {name: line for line, name in DRAWN.findall(text)}
    drawable = importlib.util.find_spec('matplotlib') is not None

    def shown(found: re.Match[str]) -> str:
        alt, name = found.groups()
        if (HERE / page).with_name(name).exists():
            return found[0]
        if name not in lines:
            raise MissingSentenceError(f'{page}: no command line of this page saves {name}')
        if not drawable:
            return f'*(The picture "{alt}" is left out: the site was built without matplotlib.)*'
        file = PICTURES / page.replace('/', '_') / name
        file.parent.mkdir(parents=True, exist_ok=True)
        _printed(lines[name].replace(name, str(file)))
        up = '../' * page.count('/')
        return f'![{alt}]({up}{file.relative_to(HERE)})'

    return SHOWN.sub(shown, text)


def fill(app: Any, page: str, source: list[str]) -> None:
    """Put into a page what is made from the code."""
    text = PLACE.sub(lambda place: MAKERS[place[1]](), source[0])
    source[0] = with_pictures(page, text)


def setup(app: Any) -> dict[str, bool]:
    """Register the extension."""
    app.connect('source-read', fill)
    return {'parallel_read_safe': False}
