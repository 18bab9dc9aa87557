"""Zip archives: written so that the same content is the same bytes, read so that no member does harm."""

from __future__ import annotations

import io
import re
import stat
import zipfile
import zlib
from pathlib import Path, PurePosixPath

from jointlib.errors import InputError

_EPOCH = (1980, 1, 1, 0, 0, 0)
LARGEST = 512 * 2**20
"""Bytes that an archive may hold unpacked."""
MOST_MEMBERS = 20_000


def archive_bytes(members: dict[str, bytes]) -> bytes:
    """A zip archive with sorted names and fixed dates and modes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(members):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = (stat.S_IFREG | 0o644) << 16
            archive.writestr(info, members[name], compresslevel=6)
    return buffer.getvalue()


def read_archive(path: Path, data: bytes | None = None) -> dict[str, bytes]:
    """Every file in an archive by its name; anything that is damaged or would leave its folder is refused.

    With ``data`` the archive is that, and ``path`` only its name in messages.
    """
    try:
        with zipfile.ZipFile(path if data is None else io.BytesIO(data)) as archive:
            infos = archive.infolist()
            if len(infos) > MOST_MEMBERS:
                raise InputError(f"{path}: {len(infos)} members, expected at most {MOST_MEMBERS} in an FMU")
            # No member gives more than it declares, so that a bomb is refused before it is unpacked.
            if sum(info.file_size for info in infos) > LARGEST:
                raise InputError(f"{path}: more than {LARGEST >> 20} MiB unpacked, too large for an FMU of a joint")
            members: dict[str, bytes] = {}
            for info in infos:
                _refuse_unsafe(path, info)
                if info.is_dir():
                    continue
                if info.filename in members:
                    raise InputError(f"{path}: member {info.filename!r} twice, expected every name once")
                with archive.open(info) as file:
                    members[info.filename] = file.read(info.file_size + 1)
            return members
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, expected an FMU") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not an intact zip archive ({error}), expected an FMU") from None


def _refuse_unsafe(path: Path, info: zipfile.ZipInfo) -> None:
    name = info.orig_filename
    mode = info.external_attr >> 16
    if (
        "\\" in name
        or "\0" in name
        or name.startswith("/")
        or re.match(r"[A-Za-z]:", name)
        or ".." in PurePosixPath(name).parts
    ):
        raise InputError(f"{path}: member {name!r} would leave its folder, expected relative paths below the FMU")
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise InputError(f"{path}: member {name!r} is a link or device, expected plain files")


def unpack(path: Path, members: dict[str, bytes], folder: Path) -> None:
    """Write the members of the archive ``path`` below a folder."""
    for name, data in members.items():
        file = folder / name
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        except OSError as error:
            raise InputError(f"{path}: member {name!r} cannot be unpacked ({error.strerror})") from None
