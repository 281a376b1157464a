"""``python -m survey.synthetic.window_bay [DIR]``: write the sample window.moma and its truth.json."""

import sys
from pathlib import Path

from survey.synthetic.window_bay.sample import write_sample

if __name__ == "__main__":
    arguments = sys.argv[1:]
    if len(arguments) > 1 or (arguments and arguments[0].startswith("-")):
        sys.exit("usage: python -m survey.synthetic.window_bay [DIR]")
    for path in write_sample(Path(arguments[0] if arguments else "data/samples/window")):
        sys.stdout.write(f"{path}\n")
