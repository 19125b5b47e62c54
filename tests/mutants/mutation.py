"""Single changes of a module's source: an operator, a constant, a condition or a statement."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
"""Opposites. The neighbour of an inequality (`<=` for `<`) differs at one point, which floats hardly meet."""
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}


UNCHANGED = {"annotation", "returns", "decorator_list", "bases", "keywords"}
"""Fields of nodes whose content stays: `keywords` are those of classes and calls, mostly options."""


@dataclass(frozen=True)
class Mutation:
    """One change of a module."""

    line: int
    before: str
    after: str
    tree: ast.Module
    """The module, unchanged."""
    old: ast.AST
    new: ast.AST

    @property
    def source(self) -> str:
        """The module's whole text with the change; comments are lost."""
        changed = ast.unparse(_Replace(self.old, self.new).visit(self.tree))
        _Replace(self.new, self.old).visit(self.tree)
        return changed


def mutations(source: str) -> Iterator[Mutation]:
    """All changes of a module's text, in the order of its syntax tree.

    Docstrings, texts, annotations, decorators and base classes are left alone.
    """
    tree = ast.parse(source)
    for node in _nodes(tree):
        changed = _changed(node)
        if changed is not None:
            yield Mutation(node.lineno, ast.unparse(node), ast.unparse(changed), tree, node, changed)


def first_line_of_function(mutation: Mutation) -> int | None:
    """First line of the innermost function around a change, decorators included; None outside functions."""
    lines = [
        min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        for node in ast.walk(mutation.tree)
        if isinstance(node, ast.FunctionDef) and node.lineno <= mutation.line <= (node.end_lineno or 0)
    ]
    return max(lines, default=None)


class _Replace(ast.NodeTransformer):
    """Replace one node by another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        """The node, or its replacement."""
        return self.new if node is self.old else self.generic_visit(node)


def _nodes(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """The expressions and statements that may change, a node before its children."""
    if isinstance(node, ast.JoinedStr):
        return
    if isinstance(node, ast.expr | ast.stmt):
        yield node
    for name, value in ast.iter_fields(node):
        if name not in UNCHANGED:
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from _nodes(child)


def _changed(node: ast.expr | ast.stmt) -> ast.expr | ast.stmt | None:
    """The changed node; None where nothing is to be changed."""
    match node:
        case ast.Compare(ops=[operator]) if type(operator) in COMPARISONS:
            return ast.Compare(node.left, [COMPARISONS[type(operator)]()], node.comparators)
        case ast.BinOp(op=operator) if type(operator) in ARITHMETIC and not _is_text(node):
            return ast.BinOp(node.left, ARITHMETIC[type(operator)](), node.right)
        case ast.AugAssign(op=operator) if type(operator) in ARITHMETIC:
            return ast.AugAssign(node.target, ARITHMETIC[type(operator)](), node.value)
        case ast.BoolOp(op=operator):
            return ast.BoolOp(ast.Or() if isinstance(operator, ast.And) else ast.And(), node.values)
        case ast.UnaryOp(op=ast.Not()):
            return node.operand
        case ast.Constant(value=bool(value)):
            return ast.Constant(not value)
        case ast.Constant(value=int(value)):
            return ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            return ast.Constant(2.0 * value if value else 1.0)
        case ast.Expr(value=ast.Call()) | ast.Raise():
            return ast.Pass()
    return None


def _is_text(node: ast.BinOp) -> bool:
    """Whether an operand is visibly a text or a type: the opposite operator would be a type error."""
    parts = (node.left, node.right)
    return any(
        isinstance(part, ast.JoinedStr)
        or (isinstance(part, ast.Constant) and (part.value is None or isinstance(part.value, str)))
        for part in parts
    )
