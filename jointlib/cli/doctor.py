"""``jointlib doctor``: what this computer can do."""

from __future__ import annotations

import click

from jointlib.cli.arguments import Verb, json_option
from jointlib.cli.output import emit

_PACKAGES = ("numpy", "scipy", "control", "fmpy", "pythonfmu", "matplotlib", "pint", "pyuff")


@click.command("doctor", cls=Verb)
@json_option
def command(as_json: bool) -> None:
    """Versions of what jointlib stands on, the compiler for later native FMUs, and plugins that fail to load.

    \b
    Example:
      jointlib doctor
    """
    import platform
    import shutil
    from importlib.metadata import PackageNotFoundError, version

    from jointlib.registry import GROUPS, installed

    packages = {}
    for name in ("jointlib", *_PACKAGES):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "missing"
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    browser = next(
        (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
    )
    failed = {f"{g}: {name}": why for g in GROUPS for name, why in installed(g).failed.items()}
    data = {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": packages,
        "compiler": compiler,
        "browser": browser,
        "fmu_runtimes": ["python"],
        "failed_plugins": failed,
    }
    lines = [f"Python {data['python']} on {data['platform']}"]
    lines += [f"  {name} {found}" for name, found in packages.items()]
    lines += [
        "FMUs: FMI 2.0 co-simulation with the Python runtime",
        f"compiler: {compiler or 'none found'} (native FMUs will need one)",
        f"browser: {browser or 'none found'} (reports open in any browser)",
        *(f"plugin failed to load: {name} ({why})" for name, why in failed.items()),
    ]
    emit(as_json, data, lines)
