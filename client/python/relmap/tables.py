"""Lists of records, which become tables of pandas where pandas is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Mapping, Sequence, Tuple, TypeVar

if TYPE_CHECKING:
    DataFrame = Any
T = TypeVar("T", covariant=True)


def make_table(columns: Mapping[str, Any]) -> "DataFrame":
    """A pandas.DataFrame of columns. ImportError, with what to install, if pandas is not there."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("to_pandas() needs pandas: apt install python3-pandas, or pip install pandas") from error
    return pandas.DataFrame(dict(columns))


class Table(Tuple[T, ...]):
    """A tuple of records that can also become a table of pandas.

    Attributes:
        row: makes the columns of a record, by name.
    """

    row: Callable[[Any], Mapping[str, Any]]

    def to_pandas(self) -> "DataFrame":
        """A pandas.DataFrame with a row for each record. ImportError if pandas is not installed."""
        rows = [type(self).row(record) for record in self]
        names = rows[0].keys() if rows else type(self).columns()
        return make_table({name: [row[name] for row in rows] for name in names})

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of an empty table."""
        return ()
