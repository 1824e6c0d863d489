"""The words of docs/terms.md: one name for one thing, and no word that another has replaced."""

import re
from functools import cache
from pathlib import Path

import pytest
from test_architecture import PACKAGE, content, files

DOCS = Path(__file__).parents[1] / 'docs'

# A word, or the beginning of one, and the words that have replaced it.
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


@cache
def texts():
    """Return where something is written and what."""
    code = [(file, (PACKAGE / file).read_text(encoding='utf-8')) for file in files()]
    pages = [page for page in sorted(DOCS.rglob('*.md')) if page.name != 'terms.md']
    return [*code, *((page.name, page.read_text(encoding='utf-8')) for page in pages)]


@pytest.mark.parametrize('word', RETIRED)
def test_a_retired_word_is_nowhere(word):
    found = re.compile(rf'(?<![A-Za-z]){re.escape(word)}')
    where = [file for file, text in texts() if found.search(text)]
    assert not where, f'{word!r} is now {RETIRED[word]!r}'


def test_a_class_name_stands_for_one_thing():
    homes = {}
    for file in files():
        for name in content(file, PACKAGE).classes:
            homes.setdefault(name.lstrip('_'), []).append(file)
    assert not {name: where for name, where in homes.items() if len(where) > 1}
