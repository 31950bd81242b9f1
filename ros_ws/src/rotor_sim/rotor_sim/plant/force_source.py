# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the force function of an element and writes it as straight-line code, with its tangent.

A force function is followed statement by statement. Each operation on a number that is not known
before the run becomes one line of the generated code; loops over fixed ranges, conditions on the
structure of the element and calls of other such functions are resolved on the way. The tangent is
derived line by line by the chain rule (forward mode: Griewank and Walther, Evaluating Derivatives,
2nd ed., ch. 3), so the lines that compute the force are the same with and without it.
"""

import ast
import builtins
import functools
import inspect
import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rotor_sim.errors import PlantError

SUBSET = (
    'use assignments, + - * /, comparisons, `a if condition else b`, sqrt, abs, min, max, loops '
    'over a fixed range and functions made of these'
)
"""What a force function may hold, as errors say it."""

_LONGEST_LOOP = 256
_SIGNS: dict[type[ast.cmpop], str] = {
    ast.Lt: '<',
    ast.LtE: '<=',
    ast.Gt: '>',
    ast.GtE: '>=',
    ast.Eq: '==',
    ast.NotEq: '!=',
}


@dataclass(frozen=True)
class Term:
    """A number that the generated code computes; `change` is its derivative, None where it is 0."""

    text: str
    change: str | None = None


@dataclass(frozen=True)
class Condition:
    """A comparison that the generated code makes."""

    text: str


class Names:
    """What a force function reads as `p.name`, `d.name` or `s.name`."""

    def __init__(self, what: str, values: Mapping[str, Any]) -> None:
        self.what, self.values = what, values


@dataclass
class Writer:
    """Collects the lines of generated code; every name is used once."""

    tangent: bool
    prefix: str = 't'
    lines: list[str] = field(default_factory=list)
    _count: int = 0

    def new(self, text: str, change: str | None = None) -> Term:
        """Write `name = text`, and the derivative where there is one; return the term."""
        name = f'{self.prefix}{self._count}'
        self._count += 1
        self.lines.append(f'{name} = {text}')
        if change is None or not self.tangent:
            return Term(name)
        self.lines.append(f'd{name} = {change}')
        return Term(name, f'd{name}')

    def condition(self, text: str) -> Condition:
        """Write a comparison."""
        return Condition(self.new(text).text)


def derivative(rule: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a force function's helper a derivative of its own.

    `rule` takes the arguments, then the change of each, and returns the change of the result. It
    is for helpers whose statements do not show their derivative, as a rounding, or not a good one.
    """

    def mark(function: Callable[..., Any]) -> Callable[..., Any]:
        function.derivative = rule  # type: ignore[attr-defined]
        return function

    return mark


@functools.cache
def _parsed(function: Callable[..., Any]) -> ast.FunctionDef:
    name = getattr(function, '__qualname__', repr(function))
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, TypeError):
        raise PlantError(f'{name} cannot be read; write it with `def` in a file') from None
    found = next((node for node in tree.body if isinstance(node, ast.FunctionDef)), None)
    if found is None:
        raise PlantError(f'{name} is no plain function; {SUBSET}')
    return found


@functools.cache
def _outside(function: Callable[..., Any]) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return what a function reads from around it."""
    found = inspect.getclosurevars(function)
    return found.nonlocals, found.globals


def follow(
    function: Callable[..., Any], arguments: Sequence[Any], writer: Writer, who: str
) -> tuple[Any, ...]:
    """Write the code of `function` at `arguments`; return what it returns, always as a tuple.

    An argument is a number, a Term, a tuple of these or Names. `who` names the element in errors.
    Raises PlantError for a statement that cannot be followed.
    """
    try:
        result = _call(function, arguments, writer, who)
    except RecursionError:
        raise PlantError(f'{who}: {function.__qualname__} calls itself; {SUBSET}') from None
    return result if isinstance(result, tuple) else (result,)


def _call(function: Callable[..., Any], arguments: Sequence[Any], writer: Writer, who: str) -> Any:
    node = _parsed(function)
    names = [argument.arg for argument in node.args.args]
    if len(names) != len(arguments):
        raise PlantError(
            f'{who}: {function.__qualname__} takes {len(names)} arguments, not {len(arguments)}'
        )
    rule = getattr(function, 'derivative', None)
    if rule is None or not writer.tangent:
        return _Follower(function, dict(zip(names, arguments, strict=True)), writer, who).run(node)
    still = [_still(argument) for argument in arguments]
    result = _Follower(function, dict(zip(names, still, strict=True)), writer, who).run(node)
    changes = [_change_of(argument) for argument in arguments]
    if all(change is None for change in changes):
        return result
    zeroed = [0.0 if change is None else Term(change) for change in changes]
    change = _call(rule, [*still, *zeroed], writer, who)
    if isinstance(result, tuple):
        pairs = zip(result, change, strict=True)
        return tuple(Term(_text(value), _text(slope)) for value, slope in pairs)
    return Term(_text(result), _text(change))


def _still(value: Any) -> Any:
    return Term(value.text) if isinstance(value, Term) else value


def _change_of(value: Any) -> str | None:
    return value.change if isinstance(value, Term) else None


def _text(value: Any) -> str:
    if isinstance(value, Term):
        return value.text
    if isinstance(value, bool | int | float):
        number = float(value)
        # written so that the compiler reads the same bits; infinity has no literal
        return repr(number) if math.isfinite(number) else f'({"-" * (number < 0)}np.inf)'
    raise TypeError(type(value).__name__)


class _Return(Exception):  # noqa: N818 - it carries a value, nothing is wrong
    def __init__(self, value: Any) -> None:
        super().__init__()
        self.value = value


class _Follower:
    """Follows one call of a function."""

    def __init__(
        self, function: Callable[..., Any], local: dict[str, Any], writer: Writer, who: str
    ) -> None:
        self._function, self._local, self._writer, self._who = function, local, writer, who

    def run(self, node: ast.FunctionDef) -> Any:
        try:
            self._body(node.body)
        except _Return as end:
            return end.value
        raise PlantError(f'{self._who}: {self._function.__qualname__} returns nothing')

    def _refuse(self, node: ast.AST, what: str) -> PlantError:
        line = getattr(node, 'lineno', 0)
        return PlantError(
            f'{self._who}: {what} in line {line} of {self._function.__qualname__} cannot be '
            f'compiled; {SUBSET}'
        )

    def _body(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:  # noqa: C901 - one case a kind of statement
        match node:
            case ast.Expr(value=ast.Constant(value=str())) | ast.Pass():
                pass
            case ast.Assign(targets=[target], value=value):
                self._assign(target, self._value(value))
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, self._value(value))
            case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                if name not in self._local:
                    raise self._refuse(node, f'{name} before it has a value')
                self._assign(target, self._binary(node, op, self._local[name], self._value(value)))
            case ast.If(test=test, body=body, orelse=orelse):
                chosen = self._value(test)
                if isinstance(chosen, Condition | Term):
                    raise self._refuse(node, 'an `if` on a number of the run')
                self._body(body if chosen else orelse)
            case ast.For(target=ast.Name(id=name), iter=iterable, body=body, orelse=[]):
                for item in self._items(node, iterable):
                    self._local[name] = item
                    self._body(body)
            case ast.Return(value=ast.expr() as value):
                raise _Return(self._value(value))
            case _:
                raise self._refuse(node, f'`{type(node).__name__}`')

    def _items(self, node: ast.For, iterable: ast.expr) -> Sequence[Any]:
        items = self._value(iterable)
        if not isinstance(items, tuple | range) or len(items) > _LONGEST_LOOP:
            raise self._refuse(node, 'a loop that is not over a fixed range')
        return items

    def _assign(self, target: ast.expr, value: Any) -> None:
        match target:
            case ast.Name(id=name):
                self._local[name] = value
            case ast.Tuple(elts=elements):
                if not isinstance(value, tuple) or len(value) != len(elements):
                    raise self._refuse(target, 'an assignment to another number of names')
                for element, part in zip(elements, value, strict=True):
                    self._assign(element, part)
            case _:
                raise self._refuse(target, f'an assignment to `{ast.unparse(target)}`')

    def _value(self, node: ast.expr) -> Any:  # noqa: C901, PLR0911 - one case a kind of expression
        match node:
            case ast.Constant(value=bool() | int() | float() | str() as value):
                return value
            case ast.Name(id=name):
                return self._name(node, name)
            case ast.Tuple(elts=elements):
                return tuple(self._value(element) for element in elements)
            case ast.Attribute(value=of, attr=name):
                return self._attribute(node, self._value(of), name)
            case ast.Subscript(value=of, slice=index):
                return self._item(node, self._value(of), self._value(index))
            case ast.BinOp(left=left, op=op, right=right):
                return self._binary(node, op, self._value(left), self._value(right))
            case ast.UnaryOp(op=op, operand=operand):
                return self._unary(node, op, self._value(operand))
            case ast.Compare():
                return self._compare(node)
            case ast.BoolOp(op=op, values=values):
                return self._both(node, op, [self._value(value) for value in values])
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._choice(node, test, body, orelse)
            case ast.Call(func=called, args=arguments, keywords=[]):
                return self._called(node, called, [self._value(each) for each in arguments])
            case _:
                raise self._refuse(node, f'`{ast.unparse(node)}`')

    def _name(self, node: ast.expr, name: str) -> Any:
        if name in self._local:
            return self._local[name]
        for names in _outside(self._function):
            if name in names:
                return names[name]
        if hasattr(builtins, name):
            return getattr(builtins, name)
        raise self._refuse(node, f'the unknown name {name}')

    def _attribute(self, node: ast.expr, of: Any, name: str) -> Any:
        if isinstance(of, Names):
            if name not in of.values:
                known = ', '.join(sorted(of.values))
                raise PlantError(
                    f'{self._who}: {self._function.__qualname__} reads {name} of {of.what}, which '
                    f'has only {known or "nothing"}'
                )
            return of.values[name]
        if inspect.ismodule(of) and hasattr(of, name):
            return getattr(of, name)
        raise self._refuse(node, f'`{ast.unparse(node)}`')

    def _item(self, node: ast.expr, of: Any, index: Any) -> Any:
        if isinstance(of, tuple) and isinstance(index, int) and -len(of) <= index < len(of):
            return of[index]
        raise self._refuse(node, f'`{ast.unparse(node)}`')

    def _number(self, node: ast.AST, value: Any) -> str:
        if isinstance(value, Term | bool | int | float):
            return _text(value)
        raise self._refuse(node, f'a {type(value).__name__} where a number is wanted')

    def _binary(self, node: ast.AST, op: ast.operator, left: Any, right: Any) -> Any:
        if not isinstance(left, Term) and not isinstance(right, Term):
            return self._known(node, op, left, right)
        a, b = self._number(node, left), self._number(node, right)
        da, db = _change_of(left), _change_of(right)
        change: str | None = None
        match op:
            case ast.Add():
                text = f'{a} + {b}'
                change = f'{da} + {db}' if da and db else da or db
            case ast.Sub():
                text = f'{a} - {b}'
                change = f'{da} - {db}' if da and db else da or (f'-{db}' if db else None)
            case ast.Mult():
                text = f'{a} * {b}'
                parts = [f'{da} * {b}'] * bool(da) + [f'{a} * {db}'] * bool(db)
                change = ' + '.join(parts) or None
            case ast.Div():
                result = self._writer.new(f'{a} / {b}')
                if not self._writer.tangent or not (da or db):
                    return result
                top = f'({da or ""} - {result.text} * {db})' if db else da
                return Term(result.text, self._writer.new(f'{top} / {b}').text)
            case _:
                raise self._refuse(node, f'`{type(op).__name__}`')
        return self._writer.new(text, change)

    def _known(self, node: ast.AST, op: ast.operator, left: Any, right: Any) -> Any:
        """Return what an operation on numbers or tuples that are known now gives."""
        expression = ast.Expression(
            ast.BinOp(ast.Name('left', ast.Load()), op, ast.Name('right', ast.Load()))
        )
        code = compile(ast.fix_missing_locations(expression), '<force>', 'eval')
        try:
            return eval(code, {'__builtins__': {}}, {'left': left, 'right': right})  # noqa: S307
        except (TypeError, ValueError, ArithmeticError):
            raise self._refuse(node, f'an operation on {left!r} and {right!r}') from None

    def _unary(self, node: ast.expr, op: ast.unaryop, value: Any) -> Any:
        match op, value:
            case ast.USub(), Term(text=text, change=change):
                return self._writer.new(f'-{text}', f'-{change}' if change else None)
            case ast.UAdd(), Term():
                return value
            case ast.Not(), Condition(text=text):
                return self._writer.condition(f'not {text}')
            case ast.USub(), int() | float():
                return -value
            case ast.UAdd(), int() | float():
                return value
            case ast.Not(), _ if not isinstance(value, Term):
                return not value
        raise self._refuse(node, f'`{ast.unparse(node)}`')

    def _compare(self, node: ast.Compare) -> Any:
        values = [self._value(each) for each in (node.left, *node.comparators)]
        results = []
        for sign, left, right in zip(node.ops, values, values[1:], strict=False):
            if type(sign) not in _SIGNS:
                raise self._refuse(node, f'`{ast.unparse(node)}`')
            mark = _SIGNS[type(sign)]
            if isinstance(left, Term) or isinstance(right, Term):
                text = f'{self._number(node, left)} {mark} {self._number(node, right)}'
                results.append(self._writer.condition(text))
            else:
                code = f'left {mark} right'
                results.append(eval(code, {'__builtins__': {}}, {'left': left, 'right': right}))  # noqa: S307
        return results[0] if len(results) == 1 else self._both(node, ast.And(), results)

    def _both(self, node: ast.expr, op: ast.boolop, values: Sequence[Any]) -> Any:
        is_and = isinstance(op, ast.And)
        texts = []
        for value in values:
            if isinstance(value, Condition):
                texts.append(value.text)
            elif isinstance(value, Term):
                raise self._refuse(node, 'a number where a comparison is wanted')
            elif bool(value) is not is_and:
                return not is_and
        if not texts:
            return is_and
        return self._writer.condition((' & ' if is_and else ' | ').join(texts))

    def _choice(self, node: ast.expr, test: ast.expr, body: ast.expr, orelse: ast.expr) -> Any:
        condition = self._value(test)
        if isinstance(condition, Term):
            raise self._refuse(node, 'a number where a comparison is wanted')
        if not isinstance(condition, Condition):
            return self._value(body if condition else orelse)
        return self._chosen(node, condition, self._value(body), self._value(orelse))

    def _chosen(self, node: ast.AST, condition: Condition, yes: Any, no: Any) -> Any:
        if isinstance(yes, tuple) and isinstance(no, tuple) and len(yes) == len(no):
            pairs = zip(yes, no, strict=True)
            return tuple(self._chosen(node, condition, one, two) for one, two in pairs)
        text = f'{self._number(node, yes)} if {condition.text} else {self._number(node, no)}'
        dy, dn = _change_of(yes), _change_of(no)
        change = f'{dy or 0.0} if {condition.text} else {dn or 0.0}' if dy or dn else None
        return self._writer.new(text, change)

    def _called(self, node: ast.Call, called: ast.expr, arguments: list[Any]) -> Any:
        function = self._value(called)
        is_known = not any(isinstance(argument, Term | tuple | Names) for argument in arguments)
        if is_known and function in {abs, min, max, range, math.sqrt}:
            return function(*arguments)
        match function, arguments:
            case builtins.len, [tuple() as items]:
                return len(items)
            case math.sqrt, [value]:
                return self._root(node, value)
            case builtins.abs, [value]:
                text, change = self._number(node, value), _change_of(value)
                sign = f'{change} if {text} >= 0.0 else -{change}' if change else None
                return self._writer.new(f'abs({text})', sign)
            case builtins.min | builtins.max, [first, second]:
                return self._extreme(node, function.__name__, first, second)
            case _ if inspect.isfunction(function):
                return _call(function, arguments, self._writer, self._who)
        raise self._refuse(node, f'a call of `{ast.unparse(called)}`')

    def _root(self, node: ast.AST, value: Any) -> Term:
        root = self._writer.new(f'math.sqrt({self._number(node, value)})')
        change = _change_of(value)
        if not self._writer.tangent or change is None:
            return root
        # at 0 there is no derivative; a trajectory that touches it keeps its tangent finite
        text = f'0.5 * {change} / {root.text} if {root.text} > 0.0 else 0.0'
        return Term(root.text, self._writer.new(text).text)

    def _extreme(self, node: ast.AST, name: str, first: Any, second: Any) -> Term:
        a, b = self._number(node, first), self._number(node, second)
        da, db = _change_of(first), _change_of(second)
        mark = '<' if name == 'min' else '>'
        change = f'{da or 0.0} if {a} {mark} {b} else {db or 0.0}' if da or db else None
        return self._writer.new(f'{name}({a}, {b})', change)
