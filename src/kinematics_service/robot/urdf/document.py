# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the XML elements of a URDF and their line numbers with expat, and refuse hostile files.

Entities make XML dangerous: they can grow without bound, or read other files. Only a DOCTYPE can
declare entities, so the parser refuses a file at the beginning of a DOCTYPE.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from ...errors import Fault, UrdfError
from ...typography import listed
from ..file.text.fault_report import quoted
from ..file.translation import MAX_BYTES

MAX_DEPTH = 64
MAX_ELEMENTS = 200_000
MAX_LISTED_NAMES = 30  # largest number of names in a message
MISPLACED = expat.errors.codes[expat.errors.XML_ERROR_MISPLACED_XML_PI]
BLANK_BEGINNING = re.compile(rb'\A(\s+)(<\?xml\b[^>]*\?>)')
DECLARED = re.compile(rb'\A<\?xml\b[^>]*?\bencoding\s*=\s*["\']([\w.-]+)["\']')
# Python codecs for encodings with several bytes for each character. The XML parser expat cannot
# read these encodings. A file often contains characters that are not in the encoding that the file
# declares. So some encodings are read with the codec of a larger character set.
CODECS = dict.fromkeys(('gb2312', 'gbk', 'gb18030'), 'gb18030')
CODECS |= dict.fromkeys(('shift_jis', 'x_sjis', 'windows_31j', 'cp932'), 'cp932')
CODECS |= {name: name for name in ('utf_8', 'big5', 'euc_kr', 'euc_jp')}


@dataclass(frozen=True)
class XmlElement:
    """
    An XML element of a URDF file, with the file and line of the element.

    Parameters
    ----------
    tag, attributes, children
        The name, attributes and children of the element. Text between elements is not kept,
        because URDF does not use text.
    file, line
        File and line where the element begins; lines are counted from 1.
    inside
        The name of the parent element, for messages; empty if the parent is the root element.
    """

    tag: str
    attributes: Mapping[str, str]
    children: tuple['XmlElement', ...]
    file: str
    line: int
    inside: str

    def all(self, tag: str) -> Iterator['XmlElement']:
        """Yield the children with the tag `tag`, such as `joint`."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> 'XmlElement | None':
        """Return the first child with the tag `tag`, or None."""
        return next(self.all(tag), None)

    def refuse(self, message: str, code: str) -> NoReturn:
        """
        Raise a UrdfError with a message and the file and line of this element.

        Raises
        ------
        UrdfError
            Always.
        """
        raise UrdfError(self.fault(message, code))

    def fault(self, message: str, code: str) -> Fault:
        """Return a fault with a message and the place of this element."""
        inside = f' of {self.inside}' if self.inside else ''
        where = _title(self.tag, self.attributes) + inside
        return Fault(self.file, self.line, where, message, code)


def refuse(file: str, message: str, code: str, line: int = 0) -> NoReturn:
    """Raise a UrdfError at a line of a file, or for the whole file."""
    raise UrdfError(Fault(file, line, '', message, code))


def _title(tag: str, attributes: Mapping[str, str]) -> str:
    # Return the text that names an element in messages, such as `<joint name='elbow'>`.
    name = attributes.get('name')
    return f'<{tag}>' if name is None else f'<{tag} name={quoted(name)}>'


def listed_names(names: Iterable[str]) -> str:
    """Return the first names, at most MAX_LISTED_NAMES, as one text for a message."""
    return listed([quoted(name)[1:-1] for name in names], MAX_LISTED_NAMES) or 'none'


def read_urdf(path: Path) -> XmlElement:
    """
    Read a URDF file, and return the root element.

    Raises
    ------
    UrdfError
        The file cannot be read, is too large, or is not a URDF.
    """
    try:
        with path.open('rb') as stream:
            content = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        refuse(str(path), 'no such file', 'missing-file')
    except OSError as error:
        refuse(str(path), f'cannot be read: {error.strerror}', 'unreadable')
    return parse_urdf(content, str(path))


def parse_urdf(content: bytes, file: str) -> XmlElement:
    """
    Parse the bytes of a URDF, and return the root element.

    Raises
    ------
    UrdfError
        The bytes are too many or not XML, have a DOCTYPE or xacro that was not expanded, or the
        root is not `<robot>`.
    """
    if len(content) > MAX_BYTES:
        refuse(file, f'larger than {MAX_BYTES // 2**20} MiB: not a URDF', 'too-large')
    root = _XmlReader(file).read(content)
    if root.tag != 'robot':
        other = {'sdf': 'SDF', 'mujoco': 'MuJoCo XML'}.get(root.tag)
        reason = f'this is {other}, not URDF; ' if other else ''
        root.refuse(f'{reason}the root of a URDF is <robot>', 'wrong-type')
    return root


class _XmlReader:
    # Builds a tree of XmlElement objects from XML. `open` has the elements that are not closed
    # yet, innermost last, with the children read so far.
    def __init__(self, file: str) -> None:
        self.file = file
        self.open: list[tuple[str, dict[str, str], int, list[XmlElement]]] = []
        self.root: XmlElement | None = None
        self.elements = 0

    def read(self, content: bytes) -> XmlElement:
        # expat refuses a file with blank lines before the XML declaration, but the parsers of ROS
        # accept such a file. So move the blank lines behind the declaration.
        content, encoding = self._in_utf_8(BLANK_BEGINNING.sub(rb'\2\1', content))
        self.parser = expat.ParserCreate(encoding)
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        try:
            self.parser.Parse(content, True)
        except expat.ExpatError as error:
            reason = expat.errors.messages.get(error.code, 'malformed')
            if error.code == MISPLACED:
                reason += '; delete the text before <?xml, or delete <?xml ...?>'
            refuse(self.file, f'not valid XML: {reason}', 'syntax', error.lineno)
        except UrdfError:
            # A handler of the parser refused the file. UrdfError is a ValueError, so without this
            # clause the next clause would catch the error and change the message.
            raise
        except (ValueError, LookupError) as error:
            # The file declares an encoding that expat does not know.
            refuse(self.file, f'not valid XML: {error}', 'syntax')
        assert self.root is not None  # without a root element, expat has raised an error
        return self.root

    def _in_utf_8(self, data: bytes) -> tuple[bytes, str | None]:
        # Return the bytes of the file and their encoding; the encoding is None if expat detects
        # it. Valid UTF-8 counts as UTF-8 even if the file declares another encoding. A text from a
        # ROS message is UTF-8, but may still declare the encoding of its file.
        match = DECLARED.match(data)
        declared = match[1].decode('ascii') if match else 'UTF-8'
        declared_codec = CODECS.get(declared.lower().replace('-', '_'))
        if b'\0' in data:  # probably UTF-16, which expat can read
            return data, None
        line = 0
        for codec in ('utf-8', declared_codec):
            try:
                return (data.decode(codec).encode('utf-8'), 'utf-8') if codec else (data, None)
            except UnicodeDecodeError as error:
                line = data.count(b'\n', 0, error.start) + 1
        return refuse(
            self.file,
            f'not {declared} text; write its encoding into the first line, such as <?xml '
            'version="1.0" encoding="Shift_JIS"?>, or convert it: '
            f'iconv -f SHIFT_JIS -t UTF-8 {self.file} > utf8.urdf',
            'wrong-encoding',
            line,
        )

    def _doctype(self, *_: object) -> None:
        message = 'a DOCTYPE, which may declare entities, is not accepted; delete it'
        refuse(self.file, message, 'unsupported', self.parser.CurrentLineNumber)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self.parser.CurrentLineNumber
        self.elements += 1
        if tag.startswith('xacro:'):
            message = f'<{tag}> is xacro; expand the file first (xacro FILE > robot.urdf)'
            refuse(self.file, message, 'xacro', line)
        if len(self.open) >= MAX_DEPTH:
            refuse(self.file, f'nested more than {MAX_DEPTH} deep', 'too-deep', line)
        if self.elements > MAX_ELEMENTS:
            refuse(self.file, f'more than {MAX_ELEMENTS} elements', 'too-many', line)
        self.open.append((tag, attributes, line, []))

    def _end(self, _: str) -> None:
        tag, attributes, line, children = self.open.pop()
        inside = _title(*self.open[-1][:2]) if len(self.open) > 1 else ''
        element = XmlElement(tag, attributes, tuple(children), self.file, line, inside)
        if self.open:
            self.open[-1][3].append(element)
        else:
            self.root = element
