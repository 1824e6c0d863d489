"""The words of docs/terms.md: no word that another has replaced."""

import re
from pathlib import Path

import kinematics_service as ks

PACKAGE = Path(ks.__file__).parent
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


def test_retired_words_are_nowhere():
    pages = [page for page in DOCS.rglob('*.md') if page.name != 'terms.md']
    word = re.compile(rf'(?<![A-Za-z])({"|".join(map(re.escape, RETIRED))})')
    found = {
        (file.name, f'{old!r} is now {RETIRED[old]!r}')
        for file in [*PACKAGE.rglob('*.py'), *pages]
        for old in word.findall(file.read_text(encoding='utf-8'))
    }
    assert not found
