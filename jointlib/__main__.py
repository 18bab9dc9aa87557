"""``python -m jointlib``: the command of that name, where no script was installed or its folder is not on the path."""

from __future__ import annotations

from .cli.main import main

if __name__ == "__main__":
    main()
