"""``jointlib VERB …``: finds the verb, runs it, turns misuse into one sentence and an exit status."""

from __future__ import annotations

import atexit
import importlib.util
import os
import signal
import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import FrameType
from typing import Any

import click

FIRST = [
    "run",
    "new",
    "import",
    "inspect",
    "estimate",
    "identify",
    "plan",
    "trace",
    "df",
    "frf",
    "modes",
    "uncouple",
    "stickout",
    "compare",
    "check",
    "lobes",
    "fmu",
    "ssp",
    "study",
    "explore",
    "laws",
    "doctor",
]
"""Verbs in the order in which they are shown; those that other packages bring follow."""


@cache
def verbs() -> dict[str, EntryPoint]:
    """Every verb that is installed, by its word: what entry points of the group ``jointlib.verbs`` name."""
    found = {point.name: point for point in entry_points(group="jointlib.verbs")}
    known = [name for name in FIRST if name in found]
    return {name: found[name] for name in [*known, *sorted(found.keys() - set(known))]}


def summary(point: EntryPoint) -> str:
    """What a verb does: the first line of its module, which is read and not imported, so that it is there at once."""
    package, *inside = point.module.split(".")
    spec = importlib.util.find_spec(package)
    if spec is None:
        return ""
    files = [Path(folder, *inside).with_suffix(".py") for folder in spec.submodule_search_locations or ()]
    files += [Path(spec.origin)] if spec.origin and not inside else []
    for file in files:
        if file.is_file():
            with file.open(encoding="utf-8") as text:
                return text.readline().strip().strip('"')
    return ""


def _limit() -> click.Option:
    """What every verb takes: how much memory it may need."""

    def ask(_context: click.Context, _option: click.Parameter, size: str | None) -> None:
        if size is not None:
            from jointlib.system import memory

            memory.ask(memory.bytes_in(size, "--limit"))

    said = "Memory it may take, such as 4GB; default: 80 % of what is free."
    return click.Option(["--limit"], expose_value=False, callback=ask, is_eager=True, metavar="SIZE", help=said)


class _Verbs(click.Group):
    """Verbs are imported when they are called, so that ``--help`` answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(verbs())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in verbs():
            return None
        command: click.Command = verbs()[cmd_name].load()
        for each in (command, *(command.commands.values() if isinstance(command, click.Group) else ())):
            if not any("--limit" in option.opts for option in each.params):
                each.params.append(_limit())
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if args and args[0] not in verbs():
            from jointlib.errors import nearest

            raise click.UsageError(f"no verb {args[0]!r}, {nearest(args[0], verbs())}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl([(name, summary(point)) for name, point in verbs().items()])


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
    """Entry point of the ``jointlib`` command.

    Linear algebra gets one thread, unless the environment says otherwise: matrices here are small, and the digits must
    not depend on the number of cores.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when a verb imports numpy
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
            # What is done stays done: Ctrl-C while the interpreter shuts down would say otherwise.
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
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
    from jointlib.system.memory import limited

    with limited():
        return _called()


def _called() -> int:
    try:
        status = cli.main(prog_name="jointlib", standalone_mode=False)
        return status if isinstance(status, int) else 0
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        from jointlib.errors import told

        click.echo(f"jointlib: {told(error.format_message())}", err=True)
        return 2
    except MemoryError:
        from jointlib.system.memory import in_words, limit

        most = in_words(limit())
        click.echo(
            f"jointlib: it takes more than the {most} of memory it may, expected less to compute (--limit)", err=True
        )
        return 2
    except OSError as error:
        from jointlib.errors import told

        named = error.filename or "standard output, or a file that is open"
        click.echo(f"jointlib: {told(f'{named}: cannot be used ({error.strerror or error})')}", err=True)
        return 2
    except Exception as error:
        from jointlib.errors import CheckFailed, InputError

        if type(error).__name__ == "LinAlgError":
            # Sizes, each in its range, whose products are no numbers any more, or that hold nothing in place.
            error = InputError(f"the equations cannot be solved ({error}), expected the sizes of a machine")
        if not isinstance(error, CheckFailed | InputError):
            raise
        click.echo(f"jointlib: {error.shortened() if isinstance(error, InputError) else error}", err=True)
        if isinstance(error, InputError) and "--json" in sys.argv:
            from jointlib.cli.output import faults

            click.echo(faults(error))
        return 2 if isinstance(error, InputError) else 1
