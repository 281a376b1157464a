"""Grammar of query expressions: from text to a small tree, with limits; no database here.

::

    expression  = conjunction { "or" conjunction }
    conjunction = negation { "and" negation }
    negation    = "not" negation | "(" expression ")" | test
    test        = attribute ( "=" | "==" | "!=" | "<" | "<=" | ">" | ">=" ) value
                | amount ( "=" | … | ">=" ) amount
                | attribute [ "not" ] "in" "(" value { "," value } ")"
                | attribute [ "not" ] "like" value
                | attribute "is" [ "not" ] "null"
                | function "(" [ argument { "," argument } ] ")" [ "is" [ "not" ] "null" ]
    argument    = value | expression
    amount      = sum | "abs" "(" sum ")"
    sum         = term { ( "+" | "-" ) term }
    term        = factor { ( "*" | "/" ) factor }, of which at most one divisor is an attribute
    factor      = number | attribute
    attribute   = name [ "@" run ]
    value       = number | word | 'quoted' | "quoted"

The signs + and - stand between blanks, as ``-`` within a word is part of it. A word is anything without blanks,
quotes, commas, parentheses and comparison signs, such as ``W05-03``. A quote within quotes is doubled. The words of
the grammar (and, or, not, in, like, is, null) are the same in upper and lower case, and must be quoted to be values.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from archmodel.query.tokens import Token, complaint, named, tokenise

MAX_DEPTH = 30
"""Deepest nesting of parentheses, nots and functions."""

MAX_CALLS = 8
"""Deepest nesting of functions alone: each is a select within a select."""

OPERATORS = frozenset({"=", "==", "!=", "<", "<=", ">", ">="})

_ORDERS = frozenset({"<", "<=", ">", ">="})

VALUES = frozenset({"quoted", "word", "number"})


_SIGNS = {"+": 1.0, "-": -1.0}
_NUMBER = r"[0-9]+(?:\.[0-9]*)?|\.[0-9]+"
_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:@[0-9]+)?"
_PRODUCT = re.compile(
    rf"(?:(?P<factor>{_NUMBER})\*)?(?P<name>{_NAME})(?:/(?:(?P<by>{_NUMBER})|(?P<divisor>{_NAME})))?"
)
"""A term without blanks: 2*depth, depth/length, 3*depth/length, depth/2."""

_JOINING = "join tests by and, or; put a text with blanks in quotes"


@dataclass(frozen=True)
class Comparison:
    """Node: attribute operator value."""

    attribute: Token
    operator: str
    value: Token


@dataclass(frozen=True)
class Term:
    """Term of a sum: factor · attribute / divisor; what is None is left out."""

    factor: float
    attribute: Token | None = None
    divisor: Token | None = None


@dataclass(frozen=True)
class Amount:
    """A number computed of attributes: the sum of terms, or its absolute value.

    Attributes
    ----------
    terms : of the sum
    absolute : whether the sign is left out
    """

    terms: tuple[Term, ...]
    absolute: bool


@dataclass(frozen=True)
class AmountComparison:
    """Node: amount operator amount."""

    left: Amount
    operator: str
    right: Amount


@dataclass(frozen=True)
class IsIn:
    """Node: attribute in (values)."""

    attribute: Token
    values: tuple[Token, ...]


@dataclass(frozen=True)
class Like:
    """Node: attribute like pattern."""

    attribute: Token
    pattern: Token


@dataclass(frozen=True)
class Call:
    """Node: function(arguments)."""

    function: Token
    arguments: "tuple[Token | Node, ...]"


@dataclass(frozen=True)
class IsNull:
    """Node: attribute is null, or function(…) is null, neither true nor false."""

    operand: Token | Call


@dataclass(frozen=True)
class Not:
    """Node: the opposite; unknown stays unknown."""

    operand: "Node"


@dataclass(frozen=True)
class All:
    """Node: every operand, joined by and."""

    operands: "tuple[Node, ...]"


@dataclass(frozen=True)
class AnyOf:
    """Node: at least one operand, joined by or."""

    operands: "tuple[Node, ...]"


Node = Comparison | AmountComparison | IsIn | Like | Call | IsNull | Not | All | AnyOf


def parse(text: str) -> Node:
    """Parse an expression into its tree.

    Raises
    ------
    QueryError
        with the place in the expression, if it does not follow the grammar or exceeds its limits
    """
    return _Parser(tokenise(text)).whole()


def attributes_in(node: Node) -> Iterator[Token]:
    """List the tokens that are, or may be, attributes of the expression's own entities; not those within functions."""
    match node:
        case All(operands) | AnyOf(operands):
            for operand in operands:
                yield from attributes_in(operand)
        case Not(operand):
            yield from attributes_in(operand)
        case Comparison(attribute, _, value):
            yield attribute
            if value.role == "word":
                yield value
        case AmountComparison(left, _, right):
            for term in (*left.terms, *right.terms):
                yield from (token for token in (term.attribute, term.divisor) if token is not None)
        case IsNull(Token() as attribute) | Like(attribute, _) | IsIn(attribute, _):
            yield attribute


class _Parser:
    """Recursive-descent parser over the tokens; `depth` counts parentheses, nots and functions, `calls` functions."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.index = 0
        self.calls = 0

    @property
    def token(self) -> Token:
        """Token that is read next."""
        return self.tokens[self.index]

    def take(self) -> Token:
        """Return the next token, and go on behind it."""
        token = self.token
        self.index += 1
        return token

    def taken(self, role: str, text: str) -> bool:
        """Take the next token if it is this one."""
        if (self.token.role, self.token.text) != (role, text):
            return False
        self.index += 1
        return True

    def whole(self) -> Node:
        """Read an expression to the end of the text."""
        node = self.expression(0)
        if self.token.role != "end":
            raise complaint(self.token, f"{named(self.token)} is not expected here", _JOINING)
        return node

    def expression(self, depth: int) -> Node:
        """Read conjunctions joined by ``or``."""
        operands = [self.conjunction(depth)]
        while self.taken("keyword", "or"):
            operands.append(self.conjunction(depth))
        return operands[0] if len(operands) == 1 else AnyOf(tuple(operands))

    def conjunction(self, depth: int) -> Node:
        """Read negations joined by ``and``."""
        operands = [self.negation(depth)]
        while self.taken("keyword", "and"):
            operands.append(self.negation(depth))
        return operands[0] if len(operands) == 1 else All(tuple(operands))

    def negation(self, depth: int) -> Node:
        """Read a test, or one behind ``not``."""
        if depth > MAX_DEPTH:
            raise complaint(
                self.token, f"the expression is nested more than {MAX_DEPTH} deep", "use several --where"
            )
        if self.taken("keyword", "not"):
            return Not(self.negation(depth + 1))
        if self.taken("sign", "("):
            node = self.expression(depth + 1)
            self.close()
            return node
        return self.test(depth)

    def test(self, depth: int) -> Node:
        """Read a comparison, a call, or an expression in parentheses."""
        begin = self.index
        if self.computes():
            return self.amounts()
        attribute = self.take()
        if attribute.role != "word":
            example = "begin a test with an attribute, e.g. depth > 0.4"
            raise complaint(attribute, f"{named(attribute)} is not an attribute", example)
        if self.taken("sign", "("):
            call = self.call(attribute, depth)
            return self.null(call) if self.taken("keyword", "is") else call
        if self.token.role == "sign" and self.token.text in OPERATORS:
            operator = self.operator()
            # a text may hold a stroke, and has no order: code = A/12
            if self.computes() and (operator in _ORDERS or "/" not in self.token.text):
                self.index = begin
                return self.amounts()
            return Comparison(attribute, operator, self.value())
        if self.taken("keyword", "is"):
            return self.null(attribute)
        negated = self.taken("keyword", "not")
        node = self.membership_or_pattern(attribute)
        return Not(node) if negated else node

    def operator(self) -> str:
        """Take the sign of a comparison."""
        sign = self.take()
        if sign.role != "sign" or sign.text not in OPERATORS:
            raise complaint(sign, f"{named(sign)} is not a comparison", "write one of = != < <= > >=")
        return "=" if sign.text == "==" else sign.text

    def computes(self) -> bool:
        """Return whether a computed number follows: abs(…), a product, or a sum."""
        word, (following, role) = self.token, self.following
        if word.role not in ("word", "number"):
            return False
        called = word.text.lower() == "abs" and (following, role) == ("(", "sign")
        summed = role == "word" and following in (*_SIGNS, "/", "*")
        product = _PRODUCT.fullmatch(word.text)
        return called or summed or (product is not None and product["name"] != word.text)

    def amounts(self) -> AmountComparison:
        """Read a comparison of two computed amounts."""
        left = self.amount()
        return AmountComparison(left, self.operator(), self.amount())

    def amount(self) -> Amount:
        """Read a sum of terms, or its absolute value."""
        absolute = self.token.text.lower() == "abs" and self.following == ("(", "sign")
        if absolute:
            self.index += 2
        terms = [self.term(1.0)]
        while self.token.role == "word" and self.token.text in _SIGNS:
            terms.append(self.term(_SIGNS[self.take().text]))
        if absolute:
            self.close()
        return Amount(tuple(terms), absolute)

    def term(self, sign: float) -> Term:
        """Read a product of factors."""
        term = self.factor(Term(sign), divides=False)
        while self.token.role == "word" and self.token.text in ("*", "/"):
            term = self.factor(term, divides=self.take().text == "/")
        return term

    def factor(self, term: Term, *, divides: bool) -> Term:
        """Multiply a term by the next factor, or divide it."""
        token = self.take()
        if token.role == "number":
            number = float(token.text)
            if divides and number == 0.0:
                raise complaint(token, "division by zero", "divide by another number")
            return replace(term, factor=term.factor / number if divides else term.factor * number)
        if token.role != "word" or (product := _PRODUCT.fullmatch(token.text)) is None:
            if token.role == "word" and not divides and term == Term(term.factor):
                return replace(term, attribute=token)
            raise complaint(token, f"{named(token)} is no number", "write a number, an attribute, or 3*depth")
        if product["name"] != token.text and divides:
            raise complaint(token, "a product after /", "put blanks around * and /, e.g. depth / length * 2")
        factor = term.factor * float(product["factor"] or 1.0)
        if product["by"] is not None:
            if float(product["by"]) == 0.0:
                raise complaint(token, "division by zero", "divide by another number")
            factor /= float(product["by"])
        above = None if divides else _piece(token, product, "name")
        below = _piece(token, product, "name" if divides else "divisor")
        if (above and term.attribute) or (below and term.divisor):
            raise complaint(token, "a term with two attributes above or below", "write depth/length, say")
        return Term(factor, above or term.attribute, below or term.divisor)

    def call(self, function: Token, depth: int) -> Call:
        """Parse the arguments; the parenthesis has been taken."""
        self.calls += 1
        if self.calls > MAX_CALLS:
            what = f"functions are nested more than {MAX_CALLS} deep"
            raise complaint(function, what, "ask in several steps, e.g. by above(…)")
        arguments: list[Token | Node] = []
        if not self.taken("sign", ")"):
            arguments.append(self.argument(depth))
            while self.taken("sign", ","):
                arguments.append(self.argument(depth))
            self.close()
        self.calls -= 1
        return Call(function, tuple(arguments))

    def argument(self, depth: int) -> Token | Node:
        """Parse a value if the next argument or the end follows it, otherwise an expression."""
        if self.token.role in VALUES and self.following in ((",", "sign"), (")", "sign"), ("", "end")):
            return self.take()
        return self.expression(depth + 1)

    @property
    def following(self) -> tuple[str, str]:
        """Return text and role of the token after this one."""
        token = self.tokens[min(self.index + 1, len(self.tokens) - 1)]
        return token.text, token.role

    def null(self, operand: Token | Call) -> Node:
        """Read the rest of ``is null`` or ``is not null``."""
        negated = self.taken("keyword", "not")
        if not self.taken("keyword", "null"):
            raise complaint(self.token, f"{named(self.token)} after is", "write is null or is not null")
        return Not(IsNull(operand)) if negated else IsNull(operand)

    def membership_or_pattern(self, attribute: Token) -> Node:
        """Read the rest of ``in (…)`` or ``like '…'``."""
        if self.taken("keyword", "like"):
            return Like(attribute, self.value())
        if not self.taken("keyword", "in"):
            remedy = "write one of = != < <= > >=, in (…), like '…', is null; or, of a function, (…)"
            raise complaint(self.token, f"{named(self.token)} after {attribute.text[:40]}", remedy)
        if not self.taken("sign", "("):
            raise complaint(self.token, f"{named(self.token)} after in", "write in (a, b, …)")
        values = [self.value()]
        while self.taken("sign", ","):
            values.append(self.value())
        self.close()
        return IsIn(attribute, tuple(values))

    def value(self) -> Token:
        """Read a number, a word or a text."""
        token = self.take()
        if token.role not in VALUES:
            remedy = "write a number, a word, or a 'quoted text'"
            raise complaint(token, f"{named(token)} is not a value", remedy)
        return token

    def close(self) -> None:
        """Read a closing parenthesis."""
        if not self.taken("sign", ")"):
            raise complaint(self.token, f"{named(self.token)} instead of )")


def _piece(token: Token, product: "re.Match[str]", name: str) -> Token | None:
    """Return the attribute within a term that is one word."""
    if product[name] is None:
        return None
    return Token("word", product[name], token.position + product.start(name), token.source)
