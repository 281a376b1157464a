"""Scope of a query: a table of entities, and tables joined to it only when an expression needs them."""

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, TypeVar

from sqlalchemy import (
    CTE,
    ColumnElement,
    Double,
    FromClause,
    Integer,
    Select,
    and_,
    bindparam,
    column,
    func,
    select,
    values,
)
from sqlalchemy.orm import Session

from archmodel.query.inherited import Opinions, held, statements_of_structures
from archmodel.query.tokens import Token, complaint
from archmodel.tables.base import Base
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Material, MaterialProperty, Phase
from archmodel.tables.opinions import rule_of
from archmodel.tables.runs import STUDIED, EntityResult, Run
from archmodel.tables.surveys import Measurement, Simplification, Survey

MAX_FUNCTIONS = 40
"""Most functions in one query, those within functions and within canonical proportions included."""

MAX_RUNS = 12
"""Most runs in one query, each a table joined (SQLite joins at most 64)."""

S = TypeVar("S", bound=Select[Any])

_ALIASES: dict[tuple[type[Base], int], list[FromClause]] = {}
_MAKING = Lock()


def among(number: ColumnElement[int], wanted: Collection[int]) -> ColumnElement[bool]:
    """Return whether a primary key is among some, of which there may be more than a statement takes as parameters."""
    return number.in_(bindparam(None, sorted(wanted), expanding=True, literal_execute=True))


@dataclass
class Context:
    """State that the parts of one query share.

    Attributes
    ----------
    session : of the database that is asked
    run : the run of results whose run is not named; None: the latest that holds the entity
    within_canon : the part that is being understood is the canonical proportions of a kind
    campaign : name of the campaign since which displacements count; None: the first measurement of each stone
    """

    session: Session
    run: int | None = None
    within_canon: bool = field(default=False, init=False)
    campaign: str | None = field(default=None, init=False)
    _functions: int = field(default=0, init=False)
    _aliases: Counter[type[Base]] = field(default_factory=Counter, init=False)
    _shared: dict[Hashable, Any] = field(default_factory=dict, init=False)

    def alias(self, cls: type[Base]) -> FromClause:
        """Return an alias of a table that this query does not have yet.

        Queries share their aliases with later ones, since to make one takes longer than most queries do.
        """
        # A kind that was declared since then may have brought columns of its own.
        pool = _ALIASES.setdefault((cls, len(cls.__table__.c)), [])
        number = self._aliases[cls]
        self._aliases[cls] += 1
        if number >= len(pool):
            with _MAKING:
                while number >= len(pool):
                    fresh = cls.__table__.alias()
                    _ = (
                        fresh.c
                    )  # columns are made when first asked for, which two threads must not do at once
                    pool.append(fresh)
        return pool[number]

    def count_function(self, token: Token) -> None:
        """Count a function, and refuse one too many."""
        self._functions += 1
        if self._functions > MAX_FUNCTIONS:
            raise complaint(token, f"more than {MAX_FUNCTIONS} functions", "ask in several queries")

    def once(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Return a value that is looked up, or put together, at most once in a query."""
        if key not in self._shared:
            self._shared[key] = make()
        return self._shared[key]

    def computed(
        self, key: Hashable, names: Sequence[str], make: Callable[[], Mapping[int, Sequence[float]]]
    ) -> CTE:
        """Return a table of numbers that no table stores, computed once in a query: ``id`` and a column for each name.

        Parameters
        ----------
        make : numbers of each entity or structure by its primary key
        """

        def table() -> CTE:
            """Write the numbers into a list of values."""
            columns = (column("id", Integer), *(column(name, Double) for name in names))
            # no entity has the number 0, and a list of values cannot be empty
            rows = [(number, *map(float, numbers)) for number, numbers in make().items()] or [
                (0, *(0.0 for _ in names))
            ]
            return values(*columns, name=f"computed_{len(self._shared)}", literal_binds=True).data(rows).cte()

        cte: CTE = self.once(("computed", key), table)
        return cte

    def statements_of_structures(self, *kinds: str) -> CTE:
        """Return statements of some kinds about structures, for every structure that is a part of theirs."""
        cte: CTE = self.once(("structures", kinds), lambda: statements_of_structures(self.alias, *kinds))
        return cte


@dataclass
class Scope:
    """Entities that an expression is about.

    Every join finds at most one row for each entity, so that it adds no rows.

    Attributes
    ----------
    context : of the whole query
    entity : the table of entities, or an alias of it
    """

    context: Context
    entity: FromClause = field(default_factory=lambda: Entity.__table__)
    _joins: dict[Hashable, tuple[FromClause, ColumnElement[bool]]] = field(default_factory=dict, init=False)

    @classmethod
    def elsewhere(cls, context: Context) -> "Scope":
        """Return the scope of other entities than those of this expression."""
        return cls(context, context.alias(Entity))

    @property
    def is_bare(self) -> bool:
        """True if nothing was joined."""
        return not self._joins

    def joined(self, statement: S) -> S:
        """Return the select on entities with the joins that were needed."""
        source = self.entity
        for target, condition in self._joins.values():
            source = source.outerjoin(target, condition)
        return statement.select_from(source)

    def measurement(self) -> FromClause:
        """Join the measurement that is held now."""
        return self._join(
            "measurement", Measurement, lambda rows: and_(rows.c.entity_id == self.entity.c.id, held(rows))
        )

    def survey(self) -> FromClause:
        """Join the survey of that measurement."""
        number = self.measurement().c.survey_id
        return self._join("survey", Survey, lambda rows: rows.c.id == number)

    def result(self, run: int | None = None) -> FromClause:
        """Join the result of a run: of this number, of the query, or the latest that holds the entity."""
        number = self.context.run if run is None else run
        wanted = self._latest_run() if number is None else number
        return self._join(
            ("result", number),
            EntityResult,
            lambda rows: and_(rows.c.entity_id == self.entity.c.id, rows.c.run_id == wanted),
        )

    def run(self, run: int | None = None) -> FromClause:
        """Join the run of that result."""
        result = self.result(run)
        return self._join(("run", id(result)), Run, lambda rows: rows.c.id == result.c.run_id)

    def simplification(self, run: int | None = None) -> FromClause:
        """Join the solid that stood for the entity in that run."""
        result = self.result(run)
        return self._join(
            ("simplification", id(result)),
            Simplification,
            lambda rows: and_(rows.c.entity_id == self.entity.c.id, rows.c.run_id == result.c.run_id),
        )

    def opinions(self, about: str) -> Opinions:
        """Return the opinions of a kind about the entity."""
        context = self.context
        rule = context.once(("rule", about), lambda: rule_of(context.session, about))
        return Opinions(context.alias, self.entity, rule, context.statements_of_structures(about))

    def phase(self) -> FromClause:
        """Join the phase of the entity."""
        number = self.opinions("of_phase").holding("phase_id")
        return self._join("phase", Phase, lambda rows: rows.c.id == number)

    def material(self) -> FromClause:
        """Join the material of the entity."""
        number = self.opinions("made_of").holding("material_id")
        return self._join("material", Material, lambda rows: rows.c.id == number)

    def material_property(self, name: str) -> FromClause:
        """Join a property of that material."""
        number = self.material().c.id
        return self._join(
            ("property", name),
            MaterialProperty,
            lambda rows: and_(rows.c.material_id == number, rows.c.name == name, held(rows)),
        )

    def displacement(self) -> FromClause:
        """Join the displacement since the campaign of the query: ``moved`` and ``moved_sigma``."""
        campaign = self.context.campaign
        key = ("displacement", campaign)
        if key not in self._joins:
            rows = self.context.computed(key, ("moved", "moved_sigma"), self._displacements)
            self._joins[key] = rows, rows.c.id == self.entity.c.id
        return self._joins[key][0]

    def _displacements(self) -> Mapping[int, Sequence[float]]:
        # numpy is loaded only by those who ask
        from archmodel.store.campaigns import campaigns, displacements

        session, campaign = self.context.session, self.context.campaign
        surveys = None if campaign is None else campaigns(session)[campaign]
        compared = displacements(session, surveys)
        return {number: (moved.distance, moved.sigma) for number, moved in compared.displacements.items()}

    def _latest_run(self) -> ColumnElement[int]:
        """Return the number of the latest run that holds the entity: one step in the primary key."""
        result = self.context.alias(EntityResult)
        # a study has shares of its stones, not motions
        studies = select(Run.id).where(Run.outcome == STUDIED)
        latest = select(func.max(result.c.run_id)).where(
            result.c.entity_id == self.entity.c.id, result.c.run_id.not_in(studies)
        )
        return latest.correlate(self.entity).scalar_subquery()

    def _join(
        self, key: Hashable, cls: type[Base], condition: Callable[[FromClause], ColumnElement[bool]]
    ) -> FromClause:
        """Return the alias joined under this key, and join it if it is not joined yet."""
        if key not in self._joins:
            rows = self.context.alias(cls)
            self._joins[key] = rows, condition(rows)
        return self._joins[key][0]


@dataclass
class StructureScope:
    """Structures that an expression within ``member_of(…)`` is about.

    Attributes
    ----------
    context : of the whole query
    structure : an alias of the table of structures
    """

    context: Context
    structure: FromClause
