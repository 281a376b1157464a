"""Entry point of ``python -m moma``, the same as the command ``moma``."""

from moma.cli import main

if __name__ == "__main__":
    main()
