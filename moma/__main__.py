"""Entry point of ``python -m moma``, the same as the command ``moma``."""

from moma.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
