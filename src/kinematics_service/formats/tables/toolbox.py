"""Links written as calls of Corke's Robotics Toolbox, for MATLAB or for Python."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from .pasted import PastedRow
from .report import TableReport

LINK = re.compile(
    r'(?:([\w()\[\]]+)\s*=\s*)?\b(?:DHLink|Link|(Revolute|Prismatic)(?:M?DH)?)\s*\('
    r'((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)'
)
ROBOT = re.compile(r'\b(?:SerialLink|DHRobot)\s*\(\s*(?:\[([^\]]*)\])?')
NAME = re.compile(r'\w+(?:[\[(]\w+[\])])?')
REPEATED = re.compile(r'\)\s*for\b|[\[(][A-Za-z]\w*[\])]\s*=\s*\w*Link\(|append\(')
OPTION = re.compile(r"'(modified|standard|revolute|prismatic|[rp])'\s*,?")
VALUE = re.compile(r"(?:'(\w+)'\s*,|(\w+)\s*=)\s*((?:[^,\[(]|\[[^\]]*\]|\([^()]*\))+)")
VECTOR = ('theta', 'd', 'a', 'alpha', 'sigma', 'offset')  # Link([...]) of MATLAB
LATER = re.compile(r'\.(theta|d|a|alpha|offset|sigma|mdh|flip|qlim)\s*=')
CONSTANT = re.compile(r"(?:^|;)[ \t]*([A-Za-z]\w*)[ \t]*=\s*([^=;\n\[\]']+?)\s*(?=;|$)", re.M)
PLAIN = (
    (re.compile('[%#].*'), ''),
    (re.compile(r'\b(?:np|numpy|math|sp|sympy|rtb)\.'), ''),
    (re.compile(r'\b(?:deg2rad|radians)\(\s*(-?[\d.]+)\s*\)'), r'\1°'),
    (re.compile('"'), "'"),
)
HEADS = ('a', 'alpha', 'd', 'theta', 'offset', 'type', 'limits')
FALSE = ('', '0', '0.0', 'False', 'false')


class ToolboxLinks(NamedTuple):
    """Rows under their heads, the convention, and the expressions of the script's variables."""

    rows: list[PastedRow]
    convention: str
    constants: Mapping[str, str]


def toolbox_links(text: str, report: TableReport) -> ToolboxLinks | None:
    """
    Return the links of a script, or None where there are none.

    Raises
    ------
    RobotFileError
        There is more than one robot, or its links are not all said in one place each.
    """
    for pattern, plain in PLAIN:
        text = pattern.sub(plain, text)
    links = list(LINK.finditer(text))
    if not links:
        return None
    _refuse_what_is_elsewhere(text, links, report)
    rows, modified = [], set()
    for found in links:
        line = text.count('\n', 0, found.start(3)) + 1
        options = OPTION.findall(found[3])
        values = _values(found[3])
        if not values:
            report.fault('the numbers have no names: write a=..., alpha=...', line)
        mdh = values.get('mdh', '0') not in FALSE
        modified.add('modified' in options or mdh or 'MDH' in found[0].partition('(')[0])
        # Of theta and d it is the constant that a link of MATLAB names.
        slides = values.get('sigma', '0') not in FALSE or 'theta' in values and 'd' not in values
        slides = (
            slides or found[2] == 'Prismatic' or bool({'prismatic', 'p'}.intersection(options))
        )
        moving = 'd' if slides else 'theta'
        if not re.fullmatch(r'0?|[A-Za-z]\w*', values.get(moving, '')):
            report.note(
                f'line {line}: {moving} moves there, and the toolbox takes no number of it'
            )
        own = '' if values.get('flip', '0') in FALSE else '-variable'
        values |= {moving: own, 'type': 'P' if slides else 'R', 'limits': values.get('qlim', '')}
        rest = {'a': '0', 'alpha': '0', 'd': '0', 'theta': '0', 'offset': '0'} | values
        rows.append(PastedRow(line, tuple(rest[head] for head in HEADS)))
    always = re.search(r"SerialLink\([^;\n]*'modified'", text) is not None
    if len(modified) > 1 and not always:
        report.refuse('some links are standard, some modified: a table has one convention')
    convention = 'modified' if always or modified.pop() else 'standard'
    heads = PastedRow(rows[0].line, HEADS)
    return ToolboxLinks([heads, *rows], convention, dict(CONSTANT.findall(text)))


def _refuse_what_is_elsewhere(text: str, links: list[re.Match[str]], report: TableReport) -> None:
    robots, later = list(ROBOT.finditer(text)), LATER.search(text)
    targets = [found[1] for found in links if found[1]]
    if len(robots) > 1 or len(set(targets)) < len(targets):
        report.refuse('there are several robots: leave the links of one in the text')
    listed = (
        [word for word in NAME.findall(robots[0][1] or '') if word in targets] if robots else []
    )
    places = [int(index) for index in re.findall(r'[\[(](\d+)', ' '.join(targets))]
    if (listed or targets) != targets or places != sorted(places):
        report.refuse('the robot takes its links in another order: write them in that order')
    if REPEATED.search(text):
        report.refuse('links are made in a loop, which is not run: write each of them')
    if later:
        line = text.count('\n', 0, later.start()) + 1
        report.refuse(f'{later[1]} is set after the link is made: write it into the link', line)


def _values(text: str) -> dict[str, str]:
    if vector := re.match(r'\s*\[([^\]]*)\]', text):
        packed = re.sub(r'\s*([*/])\s*|(?<=\S)\s+([-+])\s+', r'\1\2', vector[1].strip())
        return dict(zip(VECTOR, re.split(r'\s*,\s*|\s+', packed)))
    found = VALUE.findall(OPTION.sub('', text))
    return {matlab or python: value.strip() for matlab, python, value in found}
