"""The application that each command's file adds its command to."""

import difflib
from typing import Any

import typer
import typer.core

HELP = """
Pose, Jacobian, twist and singularity warning of any arm given by its Denavit-Hartenberg table.

Without a command the ROS 2 node starts. It listens to joint_states and publishes ~/pose,
~/jacobian, ~/twist, ~/singularity/warning and others. Arguments from --ros-args on are ROS's own.

\b
Examples:
  kinematics_service --robot puma560
  kinematics_service --robot arm.yaml --ros-args -r __ns:=/left
  kinematics_service --robot left=ur5e --robot right=ur5e
  kinematics_service check arm.yaml
  kinematics_service COMMAND --help
"""

# typer before 0.12 asks nobody whether help and errors shall stand in boxes.
typer.core.rich = None  # type: ignore[attr-defined]


class CommandGroup(typer.core.TyperGroup):
    """
    The commands, the same under every typer: Ctrl-C ends each with the exit code of that signal,
    and a command that does not exist is answered with those that do.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names in the order in which they were added: click sorts them."""
        return list(self.commands)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the first argument names, its name and the other arguments."""
        name, names = args[0], list(self.commands)
        if name not in names and not name.startswith('-'):
            near = difflib.get_close_matches(name, names, n=1)
            suggestion = f', did you mean {near[0]!r}?' if near else ''
            ctx.fail(f'unknown command {name!r}{suggestion} (commands: {", ".join(names)})')
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override]
        """Run the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(130) from None


app = typer.Typer(
    cls=CommandGroup,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    help=HELP,
    context_settings={'help_option_names': ['-h', '--help']},
)
