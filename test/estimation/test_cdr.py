# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The bytes of CDR as the standard has them: little-endian, aligned from the fourth byte on."""

import struct

from kinematics_service.estimation.cdr import CdrWriter


def test_a_text_is_its_length_its_bytes_and_a_zero():
    writer = CdrWriter()
    writer.text('ab')
    writer.whole(7)
    expected = b'\0\1\0\0' + struct.pack('<I', 3) + b'ab\0' + b'\0' + struct.pack('<I', 7)
    assert bytes(writer.data) == expected
    # The byte between the text and the number may be anything.
    assert [k for k in range(4, len(expected)) if not writer.written[k]] == [11]
