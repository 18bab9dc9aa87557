"""What this computer can do."""

from __future__ import annotations

import click

from jointlib.cli.arguments import Verb, json_option
from jointlib.cli.output import emit

_PACKAGES = ("numpy", "scipy", "control", "fmpy", "pythonfmu", "matplotlib", "pint", "pyuff")
_EXTRAS = {
    "native": "ziglang",
    "cluster": "distributed",
    "explore": "dash",
    "lab": "h5py",
    "optimise": "pymoo",
    "tables": "pyarrow",
}
"""What `pip install 'jointlib[…]'` brings, by extra."""


@click.command("doctor", cls=Verb)
@json_option
def command(as_json: bool) -> None:
    """Versions of what jointlib stands on and of its extras, the C compiler for native FMUs, plugins that fail to load.

    \b
    Example:
      jointlib doctor
    """
    import platform
    import shutil
    from importlib.metadata import PackageNotFoundError, version

    from jointlib.registry import GROUPS, installed

    from ..members.build import compilers, here

    def found(name: str) -> str:
        try:
            return version(name)
        except PackageNotFoundError:
            return "missing"

    packages = {name: found(name) for name in ("jointlib", *_PACKAGES)}
    extras = {extra: found(name) for extra, name in _EXTRAS.items()}
    reached = {one.platform.fmi3: " ".join(one.command) for one in compilers()}
    compiler = reached.get(here())
    browser = next(
        (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
    )
    failed = {f"{g}: {name}": why for g in GROUPS for name, why in installed(g).failed.items()}
    data = {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": packages,
        "extras": extras,
        "compiler": compiler,
        "browser": browser,
        "fmu_runtimes": ["c", "python"] if compiler else ["python"],
        "fmu_platforms": list(reached) if compiler else [],
        "failed_plugins": failed,
    }
    lines = [f"Python {data['python']} on {data['platform']}"]
    lines += [f"  {name} {release}" for name, release in packages.items()]
    lines += [
        f"  extra {extra}: "
        + (f"pip install 'jointlib[{extra}]'" if release == "missing" else f"{_EXTRAS[extra]} {release}")
        for extra, release in extras.items()
    ]
    lines += [
        f"native FMUs: FMI 2.0 and 3.0 for {', '.join(reached)}, compiled by {compiler}"
        if compiler
        else "native FMUs: no C compiler found (cc, gcc, clang, or pip install 'jointlib[native]')",
        "FMUs in Python: FMI 2.0 co-simulation, in hosts that bring Python",
        f"browser: {browser or 'none found'} (reports open in any browser)",
        *(f"plugin failed to load: {name} ({why})" for name, why in failed.items()),
    ]
    emit(as_json, data, lines)
