"""Options of the commands that read recordings."""

from typing import Annotated, Optional

import typer

TopicOption = Annotated[
    Optional[str],
    typer.Option('--topic', metavar='TOPIC', help='Topic of a bag; needed if it has several.'),
]
ColumnsOption = Annotated[
    Optional[str],
    typer.Option(
        '--columns',
        metavar='KEY=START,...',
        help='Beginnings of the column names: stamp=, position=, velocity=, pose=.',
    ),
]
PrefixOption = Annotated[
    str,
    typer.Option(
        '--joint-prefix', metavar='TEXT', help='Put before the joint names of the robot file.'
    ),
]
