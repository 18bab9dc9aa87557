"""What this computer can do."""

from __future__ import annotations

import click

from jointlib.cli.arguments import Verb, json_option
from jointlib.cli.output import emit

_PACKAGES = ("numpy", "scipy", "control", "fmpy", "pythonfmu", "matplotlib", "pint", "pyuff")
_EXTRAS = {
    "native": ("ziglang",),
    "cluster": ("distributed",),
    "explore": ("dash",),
    "lab": ("h5py", "npTDMS"),
    "optimise": ("pymoo",),
    "tables": ("pandas", "pyarrow", "xarray"),
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
    brought = {name: found(name) for names in _EXTRAS.values() for name in names}
    extras = {extra: _together([brought[name] for name in names]) for extra, names in _EXTRAS.items()}
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
        "extra_packages": brought,
        "compiler": compiler,
        "browser": browser,
        "fmu_runtimes": ["c", "python"] if compiler else ["python"],
        "fmu_platforms": list(reached) if compiler else [],
        "failed_plugins": failed,
    }
    lines = [f"Python {data['python']} on {data['platform']}"]
    lines += [f"  {name} {release}" for name, release in packages.items()]
    for extra, names in _EXTRAS.items():
        told = ", ".join(f"{name} {brought[name]}" for name in names)
        if extras[extra] == "missing":
            lacks = f" ({told})" if any(brought[name] != "missing" for name in names) else ""
            told = f"pip install 'jointlib[{extra}]'{lacks}"
        lines.append(f"  extra {extra}: {told}")
    lines += [
        f"native FMUs: FMI 2.0 and 3.0 for {', '.join(reached)}, compiled by {compiler}"
        if compiler
        else "native FMUs: no C compiler found (cc, gcc, clang, or pip install 'jointlib[native]')",
        "FMUs in Python: FMI 2.0 co-simulation, in hosts that bring Python",
        f"browser: {browser or 'none found'} (reports open in any browser)",
        *(f"plugin failed to load: {name} ({why})" for name, why in failed.items()),
    ]
    emit(as_json, data, lines)


def _together(versions: list[str]) -> str:
    """The version of what an extra brings, of several packages all of them; missing where one is."""
    return "missing" if "missing" in versions else ", ".join(versions)
