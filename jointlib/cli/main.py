"""``jointlib VERB …``: finds the verb, runs it, turns misuse into one sentence and an exit status."""

from __future__ import annotations

import importlib
import os
import signal
import sys
from types import FrameType
from typing import Any

import click

VERBS = {
    "run": "The whole road for a machine: identify, trace, mend, couple, check, cut, export.",
    "new": "A commented file to begin with: machine, joint, measurement, study.",
    "inspect": "Say what a file holds, in plain words, with units.",
    "identify": "Fit a joint to measurements.",
    "trace": "Find what a joint model leaves unexplained, name it, mend the joint.",
    "df": "Describing function of a joint.",
    "frf": "Nonlinear forced response of a machine, all branches.",
    "modes": "Natural modes of a machine: what moves, which joint holds the energy, what stiffness gives.",
    "compare": "Two of a kind side by side: machines, joints, measured FRFs, runs, designs of a study.",
    "check": "Compare the coupled machine, joints linearised, with python-control.",
    "lobes": "Stability lobes of a machine.",
    "fmu": "Export a joint as an FMU and verify it, or verify one.",
    "ssp": "Export a machine as a system of FMUs.",
    "study": "Compare many configurations of a machine.",
    "explore": "A web page on this computer: sliders, responses, lobes, designs of a study.",
    "laws": "The joint laws that are installed, with their fields and units.",
    "doctor": "What this computer can do.",
}


class _Verbs(click.Group):
    """Verbs are imported when they are called, so that ``--help`` answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        command: click.Command = importlib.import_module(f"jointlib.cli.{cmd_name}").command
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if args and args[0] not in VERBS:
            from jointlib.errors import nearest

            raise click.UsageError(f"no verb {args[0]!r}, {nearest(args[0], VERBS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl(list(VERBS.items()))


@click.group(cls=_Verbs, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="jointlib", message="jointlib %(version)s")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """From a measured machine joint to its model, to frequency responses, stability lobes and an FMU.

    Exit status: 0 done, 1 a check failed, 2 bad input.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main() -> None:
    """Entry point of the ``jointlib`` command."""
    interrupts: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)
        raise KeyboardInterrupt

    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if listening:
        signal.signal(signal.SIGINT, interrupt)
    try:
        status = _status()
    except (KeyboardInterrupt, click.Abort):
        status = 130
    except Exception:
        # A compiled module whose import is interrupted raises whatever it likes.
        if not interrupts:
            raise
        status = 130
    finally:
        if listening:
            signal.signal(signal.SIGINT, signal.default_int_handler)
    if status == 130 or (interrupts and status):
        status = 130
        click.echo("jointlib: stopped; nothing half-written is left", err=True)
        if interrupts:
            # Such a module, left half imported, may crash the interpreter while it shuts down in order.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    sys.exit(status)


def _status() -> int:
    """Run the verb; the exit status, after one sentence on standard error where it is not 0."""
    try:
        status = cli.main(prog_name="jointlib", standalone_mode=False)
        return status if isinstance(status, int) else 0
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        click.echo(f"jointlib: {error.format_message()}", err=True)
        return 2
    except Exception as error:
        from jointlib.errors import CheckFailed, InputError

        if not isinstance(error, CheckFailed | InputError):
            raise
        click.echo(f"jointlib: {error}", err=True)
        return 2 if isinstance(error, InputError) else 1
