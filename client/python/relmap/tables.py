"""Lists of records, which become tables of pandas where pandas is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, List, Mapping, Sequence, SupportsIndex, Tuple, TypeVar, Union, overload

if TYPE_CHECKING:
    DataFrame = Any
T = TypeVar("T", covariant=True)
S = TypeVar("S", bound="Table[Any]")

_SHOWN, _SHOWN_HTML = 10, 50  # rows


def make_table(columns: Mapping[str, Any]) -> "DataFrame":
    """A pandas.DataFrame of columns. ImportError, with what to install, if pandas is not there."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("to_pandas() needs pandas: apt install python3-pandas, or pip install pandas") from error
    return pandas.DataFrame(dict(columns))


def _cell(value: Any) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 40 else text[:37] + "..."


class Table(Tuple[T, ...]):
    """A tuple of records that can also become a table of pandas; a slice of it, too. Its repr() is a table of the first rows.

    Attributes:
        row: makes the columns of a record, by name.
    """

    row: Callable[[Any], Mapping[str, Any]]

    @overload
    def __getitem__(self, key: SupportsIndex) -> T: ...

    @overload
    def __getitem__(self: S, key: slice) -> S: ...

    def __getitem__(self, key: Union[SupportsIndex, slice]) -> Any:
        found = super().__getitem__(key)
        if not isinstance(key, slice):
            return found
        part = type(self)(found)  # type: ignore[arg-type]
        part.__dict__.update(self.__dict__)
        return part

    def to_pandas(self) -> "DataFrame":
        """A pandas.DataFrame with a row for each record. ImportError if pandas is not installed."""
        rows = [type(self).row(record) for record in self]
        names = rows[0].keys() if rows else type(self).columns()
        return make_table({name: [row[name] for row in rows] for name in names})

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of an empty table."""
        return ()

    def __repr__(self) -> str:
        what = type(self).__name__
        if not self:
            return f"{what}: empty"
        rows = [type(self).row(record) for record in self[:_SHOWN]]
        lines: List[List[str]] = [list(rows[0])] + [[_cell(value) for value in row.values()] for row in rows]
        widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
        text = [f"{what}: {len(self)}" + (f", the first {len(rows)}:" if len(self) > len(rows) else "")]
        text += ["  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in lines]
        return "\n".join(text)

    def _repr_html_(self) -> str:
        from relmap.drawing.html import table_html

        rows = [type(self).row(record) for record in self[:_SHOWN_HTML]]
        names = tuple(rows[0].keys()) if rows else type(self).columns()
        return table_html(names, rows, len(self), type(self).__name__)
