"""Exceptions with the program's messages, which state the place, the problem, and what to do."""

from __future__ import annotations

from pathlib import Path


class PalpateError(Exception):
    """Every error of this package."""

    def __init__(self, message: str, path: Path | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.path = path
        """The file, where one is at fault."""
        self.line = line
        """Its line, counted from 1, where one is."""

    def __reduce__(self) -> tuple[type[PalpateError], tuple[str, Path | None, int | None]]:
        return type(self), (str(self), self.path, self.line)


class ModelWarning(UserWarning):
    """Something to know about a model or its rows, which is no error: what `palpate export` notes."""


class SettingError(PalpateError, ValueError):
    """A setting is out of its range: a mistake of the caller, not of the data."""


class InputError(PalpateError, ValueError):
    """Something is wrong with what was given: a mesh, a data set, a model."""


class FileError(PalpateError, OSError):
    """The operating system refused to read or write a file."""
