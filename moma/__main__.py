"""``python -m moma`` is the command ``moma``."""

from moma.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
