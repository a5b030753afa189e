"""What can go wrong, as exceptions that say where it is and what to do about it."""

from __future__ import annotations

from typing import Any


class Error(ValueError):
    """What errsep refuses or cannot answer.

    Attributes
    ----------
    what : str
        What is wrong, without its place.
    file : str or None
        The file, or the name of what was given in memory, such as ``<data>``.
    line, column : int or None
        Where in the file, both from 1. A table given in memory counts as the CSV that it would be: its
        names are line 1.
    row : int or None
        Of a table given in memory: the row, from 0.
    help : str or None
        What to do about it.
    """

    def __init__(
        self,
        what: str,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        help: str | None = None,
    ) -> None:
        super().__init__(what, file, line, column, help)
        self.what = what
        self.file = file
        self.line = line
        self.column = column
        self.help = help
        self.row: int | None = None

    def __str__(self) -> str:
        place = "" if self.file is None else f"{self.file}: "
        if self.file is not None and self.line is not None:
            place = f"{self.file}:{self.line}:{self.column}: "
        help = "" if self.help is None else f"\n  help: {self.help}"
        return f"{place}{self.what}{help}"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.args, self.__dict__


class InputError(Error):
    """The data, the set-up or an option is wrong: what exits with status 2 on the command line."""


class Unsolved(Error):
    """Good data without an answer: what exits with status 1 on the command line.

    Attributes
    ----------
    result : Result, Fit or None
        What there is all the same, where there is anything.
    """

    def __init__(
        self,
        what: str,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        help: str | None = None,
    ) -> None:
        super().__init__(what, file, line, column, help)
        self.result: Any = None

    def with_result(self, result: Any) -> Unsolved:
        """The same exception with what there is all the same."""
        self.result = result
        return self


class NotDetermined(Unsolved):
    """The data do not determine what was asked for."""


class NotConverged(Unsolved):
    """No minimum was found.

    Attributes
    ----------
    partial : Fit, dict or None
        What the fit had come to when it stopped, which shows what went astray and is no answer: of
        `least_squares` the `Fit`, which is ``result`` as well; of a simultaneous reversal ``tilts``,
        ``effects`` and ``residual`` as its answer has them, without uncertainties, and ``convergence``.
    """

    def __init__(
        self,
        what: str,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        help: str | None = None,
    ) -> None:
        super().__init__(what, file, line, column, help)
        self.partial: Any = None

    def with_result(self, result: Any) -> NotConverged:
        """The same exception with what there is all the same."""
        super().with_result(result)
        self.partial = result
        return self
