"""The single changes that random_mutants.py makes in a line: of Python by its syntax tree, of C by its tokens."""

from __future__ import annotations

import ast
import functools
import random
import re
import subprocess
from collections.abc import Iterator
from typing import NamedTuple

from tools.house import ROOT

OPERATORS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "is": "is not", "is not": "is"}
OPERATORS |= {"in": "not in", "not in": "in", "and": "or", "or": "and", "&&": "||", "||": "&&"}
OPERATORS |= {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "*", "+=": "-=", "-=": "+="}
ARITHMETIC = {"+", "-", "*", "/", "//", "%", "+=", "-="}
BOOLEAN = {"and", "or", "&&", "||"}
TEXTS = re.compile(r"(cast|print|echo|warn|log|debug|info|add_argument|Option|Argument|TypeVar|NewType)$")
WARNINGS = "-std=gnu11 -O2 -Wall -Wextra -Wno-unused-parameter -Wconversion -Wshadow -Wstrict-prototypes"
WARNINGS += " -Wmissing-prototypes -Werror"
INCLUDES = "-Isim_bridge -Isim_bridge/boards -Ihost/boebot/arenas -Ihost/boebot/link -Ifirmware/src"
PIN_MAPS = ("SHIELDBOT", "SHIELDBOT_LINE", "SHIELDBOT_QUAD", "BOEBOT")

KINDS = ["comparison", "arithmetic", "constant", "boolean", "return value", "statement deleted", "arguments swapped"]
CONTEXT = 3  # lines above and below

Edit = tuple[str, int, int, str]  # what kind, from where to where in the file's bytes, what comes instead


class Mutation(NamedTuple):
    """The whole lines before a change and after it, and the lines around them."""

    above: str
    before: str
    after: str
    below: str


def mutation(name: str, line: int, kind: str, chance: random.Random) -> Mutation | None:
    """A random change of a kind of what begins in a line of a file; None if there is none that compiles."""
    source = (ROOT / name).read_bytes()
    edits = python_edits(source, line) if name.endswith(".py") else c_edits(source, line)
    of_kind = [edit for edit in edits if edit[0] == kind]
    if of_kind:
        _, start, end, instead = chance.choice(of_kind)
        changed = source[:start] + instead.encode() + source[end:]
        if compiles(name, source, changed):
            first, last = source.rfind(b"\n", 0, start) + 1, source.find(b"\n", end) + 1
            above = b"".join(source[:first].splitlines(keepends=True)[-CONTEXT:])
            after = changed[first : last + len(changed) - len(source)]
            below = b"".join(source[last:].splitlines(keepends=True)[:CONTEXT])
            return Mutation(*(text.decode() for text in (above, source[first:last], after, below)))
    return None


def compiles(name: str, source: bytes, changed: bytes) -> bool:
    """Whether a changed file can be compiled, C without a warning and, for a pin map, to other machine code."""
    if name.endswith(".py"):
        try:
            compile(changed, name, "exec")
        except SyntaxError:
            return False
        return True
    made = [(machine_code(name, source, pins), machine_code(name, changed, pins)) for pins in PIN_MAPS]
    return all(new is not None for _, new in made) and any(old != new for old, new in made)


@functools.lru_cache(maxsize=64)
def machine_code(name: str, source: bytes, pins: str) -> bytes | None:
    """What gcc makes of C; None if it warns."""
    microcontroller = name.startswith(("firmware/src/hal/avr/", "firmware/src/main.c"))
    compiler = "avr-gcc -mmcu=atmega328p" if microcontroller else "gcc"
    flags = f"{WARNINGS} -fkeep-inline-functions -DPIN_MAP_{pins} -I{(ROOT / name).parent} {INCLUDES}"
    done = subprocess.run(
        [*compiler.split(), *flags.split(), "-xc", "-S", "-o-", "-"], cwd=ROOT, input=source, capture_output=True
    )
    return None if done.returncode else done.stdout


def number(text: str) -> str | None:
    """A literal plus one, with its suffix."""
    found = re.fullmatch(r"(\d+)((?:\.\d*)?)([uUlLfF]*)", text)
    return f"{int(found[1]) + 1}{found[2]}{found[3]}" if found else None


parsed = functools.lru_cache(ast.parse)


def python_edits(source: bytes, line: int) -> Iterator[Edit]:
    """All changes of what begins in the line."""
    starts = [0]
    for one in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(one))

    def span(node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset

    def text(node: ast.expr) -> str:
        return source[slice(*span(node))].decode()

    def between(left: ast.expr, right: ast.expr) -> Iterator[Edit]:
        """The operator between two operands."""
        start, end = span(left)[1], span(right)[0]
        found = re.search(r"is not|not in|[a-z]+|[-<>=!+*/%]+", source[start:end].decode())
        if found and found[0] in OPERATORS:
            kind = "arithmetic" if found[0] in ARITHMETIC else "boolean" if found[0] in BOOLEAN else "comparison"
            yield kind, start + found.start(), start + found.end(), OPERATORS[found[0]]

    def of_node(node: ast.AST) -> Iterator[Edit]:
        match node:
            case ast.Compare(left=left, comparators=[right]):
                yield from between(left, right)
            case ast.BinOp(left=left, right=right) if not {type(left), type(right)} & {ast.JoinedStr, ast.List}:
                if not any(isinstance(side, ast.Constant) and isinstance(side.value, str) for side in (left, right)):
                    yield from between(left, right)
            case ast.AugAssign(target=target, value=value):
                yield from between(target, value)
                yield ("statement deleted", *span(node), "pass")
            case ast.BoolOp(values=[left, right, *_]):
                yield from between(left, right)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                yield "boolean", span(node)[0], span(operand)[0], ""
            case ast.Constant(value=bool(value)):
                yield ("constant", *span(node), str(not value))
            case ast.Constant(value=int() | float()) if plus_one := number(text(node)):
                yield ("constant", *span(node), plus_one)
            case ast.Return(value=ast.expr() as value) if text(value) != "None":
                yield ("return value", *span(value), "None")
            case ast.Call(args=[first, second, *_]) if not isinstance(first, ast.Starred) and text(first) != text(
                second
            ):
                if not isinstance(second, ast.Starred | ast.GeneratorExp):
                    comma = source[span(first)[1] : span(second)[0]].decode()
                    yield "arguments swapped", span(first)[0], span(second)[1], text(second) + comma + text(first)
        match node:
            case ast.Raise() | ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                yield ("statement deleted", *span(node), "pass")

    def visit(node: ast.AST) -> Iterator[Edit]:
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Call) and TEXTS.search(ast.unparse(node.func))):
            return
        if getattr(node, "lineno", None) == line:
            yield from of_node(node)
        for field, value in ast.iter_fields(node):
            if field not in ("annotation", "returns", "decorator_list") and not isinstance(node, ast.Raise):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        yield from visit(child)

    yield from visit(parsed(source))


def c_edits(source: bytes, line: int) -> Iterator[Edit]:
    """All changes of the line, but for comments, texts and the preprocessor's lines."""
    blank = re.compile(
        rb'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\])+\'|^#(?:\\\n|[^\n])*', re.DOTALL | re.MULTILINE
    )
    masked = blank.sub(lambda found: re.sub(rb"[^\n]", b"~", found[0]), source).splitlines(keepends=True)
    code, start = masked[line - 1].decode("latin-1"), sum(map(len, masked[: line - 1]))
    if "assert" in code:
        return
    for found in re.finditer(r"(?<= )(?:[<>]=?|[=!]=|&&|\|\||[-+]=?|[*/])(?= )", code):
        kind = "arithmetic" if found[0] in ARITHMETIC else "boolean" if found[0] in BOOLEAN else "comparison"
        yield kind, start + found.start(), start + found.end(), OPERATORS[found[0]]
    for found in re.finditer(r"(?<![\w.])\d+(?:\.\d*)?[uUlLfF]*(?![\w.])", code):
        if plus_one := number(found[0]):
            yield "constant", start + found.start(), start + found.end(), plus_one
    for found in re.finditer(r"!(?=[\w(])", code):
        yield "boolean", start + found.start(), start + found.end(), ""
    for found in re.finditer(r"\b(true|false)\b", code):
        yield "constant", start + found.start(), start + found.end(), "false" if found[0] == "true" else "true"
    for found in re.finditer(r"(?<=return )(?!0;|true;|false;).+(?=;)", code):
        yield "return value", start + found.start(), start + found.end(), "0"
    for found in re.finditer(r"(?<=\w\()([^,()]+), ([^,()]+)(?=[,)])", code if code.startswith(" ") else ""):
        if found[1] != found[2]:
            text = source[start + found.start() : start + found.end()].decode()
            first, second = text[: len(found[1])], text[len(found[1]) + 2 :]
            yield "arguments swapped", start + found.start(), start + found.end(), f"{second}, {first}"
    for found in re.finditer(r"(?<=  )[\w.>\[\]-]+(?: [-+*/|&^]?= .*|\(.*\)|\+\+|--);(?=\s*~*\n)", code):
        yield "statement deleted", start + found.start(), start + found.end(), ";"
