"""Codes for missing stones, derived from those of their neighbours."""

import re

__all__ = ["FreeCodes"]


class FreeCodes:
    """Supply of free codes.

    Parameters
    ----------
    taken : codes of stones; codes handed out are added
    """

    def __init__(self, taken: set[str]) -> None:
        self._taken = taken

    def after(self, left: str, right: str) -> str:
        """Return H- and the code of a stone between two others: the next free number after the left one."""
        left, right = left.removeprefix("H-"), right.removeprefix("H-")
        for code, step in ((left, 1), (right, -1)):
            number = re.search(r"\d+$", code)
            if number is None:
                continue
            name = f"{code[: number.start()]}{int(number[0]) + step:0{len(number[0])}d}"
            if int(number[0]) + step >= 0 and not {name, f"H-{name}"} & self._taken:
                return self._take(f"H-{name}")
        count = 1
        while f"H-{left}+{count}" in self._taken:
            count += 1
        return self._take(f"H-{left}+{count}")

    def _take(self, code: str) -> str:
        self._taken.add(code)
        return code
