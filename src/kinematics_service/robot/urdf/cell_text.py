"""The file of a cell whose arms are chains of one URDF."""

import os
import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

from ...errors import UrdfError
from .chain import read_chain
from .document import read_urdf
from .ends import chain_ends
from .robot_text import quoted_name
from .tree import read_tree


def urdf_cell_text(urdf: Path, tips: Sequence[str], base: str, name: str, folder: Path) -> str:
    """
    Return the text of a cell with an arm for each tip; joints that move several are common.

    Parameters
    ----------
    tips
        Links.
    base
        The link where all chains begin; empty: that of the first chain.
    name
        Of the cell; empty: that in the URDF.
    folder
        Where the text is to be, from which it names the URDF.

    Raises
    ------
    UrdfError
        There are fewer than two tips, or a chain cannot be read.
    """
    if len(set(tips)) < 2:
        raise UrdfError(f'{urdf}: a cell of one URDF has two tips or more, not {",".join(tips)}')
    tree = read_tree(read_urdf(urdf))
    base = base or chain_ends(tree, tip=tips[0]).base
    joints = {
        tip: [variable.name for variable in read_chain(tree, base, tip).variables] for tip in tips
    }
    common = [
        joint
        for first, second in combinations(tips, 2)
        for joint in joints[first]
        if joint in joints[second]
    ]
    file = os.path.relpath(urdf, folder)
    named = name or re.sub(r'\W', '_', tree.root.attributes.get('name', ''), flags=re.ASCII)
    lines = [f'cell: {named or "cell"}', 'arms:']
    for tip in tips:
        arm = re.sub(r'[^A-Za-z0-9]+', '_', tip).strip('_')
        lines.append(f'  {arm}: {{robot: {quoted_name(f"{file}:{base}:{tip}")}}}')
    if common:
        lines.insert(1, f'common: [{", ".join(map(quoted_name, dict.fromkeys(common)))}]')
    return '\n'.join([*lines, ''])
