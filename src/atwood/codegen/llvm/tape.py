"""Programs as tapes: lists of operations that one evaluator, compiled once a machine, runs without machine code.

A tape does what the machine code of a program does: the same operations, in an order in which neighbours of one kind
stand together, so that all values have the same bits.  It takes some thirtieth of the time to make, and two to four
times as long to run.

A tape is an array of doubles: the number of constants, these, and behind them words of 32 bits.  Values lie in the
scratch array, each in a place of its own: constants, what is given, and what is computed, in the order of the words.
Each group of words begins with a code and a count.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Sequence
from math import nan
from weakref import WeakKeyDictionary

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.layout import (
    LARGEST_UNROLLED,
    Body,
    MatrixKey,
    main_body,
    matrix_key,
    places_of,
    prologue_body,
)
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Routine, Value, Variable
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

_TWO = ("mul", "add", "sub", "div", "minimum", "maximum", "less", "less_equal", "logical_and", "logical_or")
_ONE = ("neg", "sqrt", "absolute", "floor", "sign", "logical_not")
_OTHERS = ("copy", "store", "end", "sin_cos", "call1", "call2", "select", "small", "factorise", "substitute")
_CODES = {one: k for k, one in enumerate((*_TWO[:3], *_OTHERS, *_TWO[3:], *_ONE))}
_NAMES = ("", *_TWO, *_ONE, *OWN_FUNCTIONS, "sin_cos", "select", "solve", "component")
_NUMBERS = {one: k for k, one in enumerate(_NAMES)}
_KINDS = len(_NAMES)
_PAIRED = ("sin", "cos")
_KEPT = frozenset({*_PAIRED, "solve", "component"})


@dataclass(frozen=True, eq=False)
class Tape:
    """A body as what the evaluator reads.

    Attributes
    ----------
    words
        The tape.
    scratch
        The length of the scratch array that it needs, which is at least that of the machine code.
    """

    words: FloatArray
    scratch: int


def tapes_of(program: Program, functions: Callable[[str], int], positions: Sequence[int] | None = None) -> list[Tape]:
    """Return what a program computes in every call, and once a run, as tapes.

    Parameters
    ----------
    program
        The program.
    functions
        Tells where the elementary functions are, by their names as operations.
    positions
        Where all results go in the arrays of their groups, if not one after the other.

    Raises
    ------
    UnsupportedError
        If it calls functions in Python.
    """
    known = _KNOWN.get(program)
    if known is None or positions is not None:
        once = _Writer(prologue_body(program), functions).tape(program.once)
        known = [_Writer(main_body(program, positions), functions).tape(program.nodes), once]
        if positions is None:
            _KNOWN[program] = known
    return known


_KNOWN: WeakKeyDictionary[Program, list[Tape]] = WeakKeyDictionary()


_Group = tuple[list[int], list[int]]
"""Operations of one kind: their indices, and those of all their arguments."""


class _Writer:
    """What has been written of a tape."""

    def __init__(self, body: Body, functions: Callable[[str], int]) -> None:
        self.body, self.functions = body, functions
        self.known = places_of(body)
        self.constants: list[float] = []
        self.places: dict[int, int] = {}
        self.words = array("i")
        self.regions: dict[MatrixKey, int] = {}
        self.tables: dict[str, int] = {}
        self.kept: dict[int, Expression] = {}

    def tape(self, nodes: Iterable[Expression]) -> Tape:
        """Return the whole tape; the nodes are all that results need, arguments before users."""
        groups = self._groups(nodes)
        for kind in sorted({kind for kind, _ in groups} & {*OWN_FUNCTIONS, "sin_cos"}):
            self.tables[kind] = len(self.constants)
            self.constants.append(float(np.array(self.functions(kind), dtype=np.uint64).view(np.float64)))
        self.end = len(self.constants)
        for pointer, given in self.body.given:
            number = 0 if pointer == "derived" else 1 + int(pointer.removeprefix("in"))
            self.words.extend((_CODES["copy"], len(given), number))
            self._place([node.index for node in given])
        for kind, group in groups:
            self._write(kind, *group)
        self._write_results()
        self.words.extend((_CODES["end"], *[0] * (1 + len(self.words) % 2)))
        words = np.frombuffer(self.words, dtype=np.intc)
        head = np.array([len(self.constants)], dtype=np.int64).view(np.float64)
        return Tape(np.concatenate([head, self.constants, words.view(np.float64)]), self.end)

    def _groups(self, nodes: Iterable[Expression]) -> list[tuple[str, _Group]]:
        """Return operations of one kind together, behind those whose values they read.

        What reads nothing that is given in every call is left out: it is given, or only such values read it.
        """
        known, groups = self.known, dict[int, _Group]()
        levels = {index: 0 for index, (pointer, _) in known.items() if pointer != "derived"}
        level_of, is_prologue = levels.get, all(pointer != "derived" for pointer, _ in self.body.given)
        waves, numbers, kept = dict[int, dict[str, int]](), _NUMBERS, _KEPT
        for node in nodes:
            index, arguments, kind = node.index, node.arguments, node.operation
            if not arguments:
                if kind == "constant":
                    self.places[index] = len(self.constants)
                    self.constants.append(node.payload)
                continue
            if index in known:
                continue
            if len(arguments) == 2:
                a, b = arguments
                read: Sequence[int] = (a.index, b.index)
                level, other = level_of(a.index, -1), level_of(b.index, -1)
                if other > level:
                    level = other
            else:
                read = [one.index for one in arguments]
                level = max([level_of(one, -1) for one in read])
            if level < 0:
                if not is_prologue:
                    continue
                level = 0
            levels[index] = level = level + 1
            if kind in kept:
                if kind in _PAIRED:
                    waves.setdefault(read[0], {})[kind] = index
                    continue
                self.kept[index] = node
            key = level * _KINDS + numbers.get(kind, 0)
            group = groups.get(key)
            if group is None:
                group = groups[key] = ([], [])
            group[0].append(index)
            group[1].extend(read)
        for angle, several in waves.items():
            kind = "sin_cos" if len(several) == 2 else next(iter(several))
            level = levels[next(iter(several.values()))]
            group = groups.setdefault(level * _KINDS + _NUMBERS[kind], ([], []))
            group[0].extend(several[one] for one in _PAIRED if one in several)
            group[1].append(angle)
        return [(_NAMES[key % _KINDS], groups[key]) for key in sorted(groups)]

    def _place(self, indices: Sequence[int]) -> None:
        """Give values the next places."""
        self.places.update(zip(indices, range(self.end, self.end + len(indices)), strict=True))
        self.end += len(indices)

    def _write(self, kind: str, indices: Sequence[int], read: Sequence[int]) -> None:
        """Write operations of one kind."""
        places = self.places
        if kind == "component":
            of = ((index, self.kept[index].payload, solve) for index, solve in zip(indices, read, strict=True))
            places.update((index, places[solve] + unknown) for index, unknown, solve in of)
        elif kind == "solve":
            for index in indices:
                self._solve(self.kept[index])
        elif not kind:
            raise UnsupportedError("there is no tape for an operation, such as a function in Python")
        else:
            code, head = kind, []
            if kind in self.tables:
                code, head = f"call{OWN_FUNCTIONS[kind]}" if kind in OWN_FUNCTIONS else kind, [self.tables[kind]]
            count = len(indices) // 2 if kind == "sin_cos" else len(indices)
            self.words.extend((_CODES[code], count, *head))
            self.words.extend(map(places.__getitem__, read))
            self._place(indices)

    def _solve(self, node: Expression) -> None:
        """Write a linear system; its unknowns lie side by side."""
        size, key = node.payload, matrix_key(node)
        entries = [self.places[one.index] for one in node.arguments]
        if size <= LARGEST_UNROLLED:
            self.words.extend((_CODES["small"], size, *entries))
            self.places[node.index] = self.end + size * size
            self.end += size * (size + 1)
            return
        if key not in self.regions:
            self.words.extend((_CODES["factorise"], size, *entries[: size * size]))
            self.regions[key] = self.end
            self.end += size * (size + 1)
        self.words.extend((_CODES["substitute"], size, self.regions[key], *entries[size * size :]))
        self.places[node.index] = self.end
        self.end += size

    def _write_results(self) -> None:
        groups: dict[str, list[int]] = {}
        for node, pointer, position in self.body.results:
            groups.setdefault(pointer, []).extend((self.places[node.index], position))
        for pointer, pairs in groups.items():
            self.words.extend((_CODES["store"], len(pairs) // 2, int(pointer.removeprefix("out")), *pairs))


def write_routines() -> list[Routine]:
    """Write the evaluator; it takes a tape, and then what a program's function takes, and returns what that does."""
    r = Routine("evaluate", dict.fromkeys(("tape", "inputs", "derived", "scratch", "outputs"), ADDRESS), exported=True)
    return [*write_elimination(), _write_small(), _Evaluator(r).written()]


class _Evaluator:
    """The routine while it is written: where the next words and the next values are."""

    def __init__(self, r: Routine) -> None:
        self.r = r
        self.tape, self.inputs, self.derived, self.values, self.outputs = r.arguments

    def written(self) -> Routine:
        """Write the loop over groups of words."""
        r, count = self.r, self.tape.read(0, INTEGER)
        r.copy(self.values, self.tape.at(1), count)
        self.word: Variable = r.variable(self.tape.at(count + 1), ADDRESS)
        self.next: Variable = r.variable(self.values.at(count), ADDRESS)
        total = r.variable(0.0)
        written = {"copy": self._copy, "sin_cos": self._waves, "select": self._select} | {
            "small": self._small,
            "factorise": self._factorise,
            "substitute": self._substitute,
        }
        with r.forever() as loop:
            now = self.word.now
            code, count = (now.read(k, CODE).integer() for k in range(2))
            words = now.at(2, CODE)
            for kind, number in _CODES.items():
                with r.when(code == number):
                    if kind == "end":
                        r.give((total.now - total.now != 0.0).code())
                    elif kind == "store":
                        self._store(words, count, total)
                    elif kind in written:
                        written[kind](words, count)
                    elif kind in ("call1", "call2"):
                        self._call(words, count, int(kind[-1]))
                    else:
                        self._each(words, count, kind)
                    r.repeat(loop)
            r.give(1)
        return r

    def _value(self, words: Value, k: Value | int) -> Value:
        """Return a value whose place is a word."""
        return self.values[words.read(k, CODE).integer()]

    def _go_on(self, words: Value, read: Value | int, made: Value | int) -> None:
        """Go on behind words that have been read, and values that have been made."""
        self.word.now = words.at(read, CODE)
        self.next.now = self.next.now.at(made)

    def _each(self, words: Value, count: Value, kind: str) -> None:
        r, place, taken = self.r, self.next.now, 2 if kind in _TWO else 1
        with r.count(count) as k:
            place[k] = _computed(r, kind, *(self._value(words, k * taken + i) for i in range(taken)))
        self._go_on(words, count * taken, count)

    def _copy(self, words: Value, count: Value) -> None:
        r, number = self.r, words.read(0, CODE).integer()
        table = self.inputs
        with r.when(number == 0):
            r.copy(self.next.now, self.derived, count)
        with r.otherwise():
            r.copy(self.next.now, table.read(number - 1, ADDRESS), count)
        self._go_on(words, 1, count)

    def _store(self, words: Value, count: Value, total: Variable) -> None:
        r, target = self.r, self.outputs.read(words.read(0, CODE).integer(), ADDRESS)
        with r.count(count) as k:
            value = self._value(words, 2 * k + 1)
            target[words.read(2 * k + 2, CODE).integer()] = value
            total.now = total.now + value
        self._go_on(words, 2 * count + 1, 0)

    def _function(self, words: Value) -> Value:
        return self.tape.read(words.read(0, CODE).integer() + 1, ADDRESS)

    def _waves(self, words: Value, count: Value) -> None:
        r, place, function = self.r, self.next.now, self._function(words)
        with r.count(count) as k:
            sine = place.at(2 * k)
            r.call(function, self._value(words, k + 1), sine, sine.at(1), result=None)
        self._go_on(words, count + 1, 2 * count)

    def _call(self, words: Value, count: Value, taken: int) -> None:
        r, place, function = self.r, self.next.now, self._function(words)
        with r.count(count) as k:
            given = [self._value(words, k * taken + i + 1) for i in range(taken)]
            place[k] = r.call(function, *given, result=NUMBER)
        self._go_on(words, count * taken + 1, count)

    def _select(self, words: Value, count: Value) -> None:
        r, place = self.r, self.next.now
        with r.count(count) as k:
            condition, a, b = (self._value(words, 3 * k + i) for i in range(3))
            place[k] = r.choose(condition != 0.0, a, b)
        self._go_on(words, 3 * count, count)

    def _gather(self, words: Value, count: Value) -> None:
        """Bring so many values together at the next places."""
        place = self.next.now
        with self.r.count(count) as k:
            place[k] = self._value(words, k)
        self._go_on(words, count, count)

    def _small(self, words: Value, size: Value) -> None:
        matrix = self.next.now
        self._gather(words, size * (size + 1))
        self.r.call("small", size, matrix, matrix.at(size * size), result=None)

    def _factorise(self, words: Value, size: Value) -> None:
        matrix = self.next.now
        self._gather(words, size * size)
        self.r.call("factorise", size, matrix, matrix.at(size * size), result=None)
        self.next.now = self.next.now.at(size)

    def _substitute(self, words: Value, size: Value) -> None:
        side, matrix = self.next.now, self.values.at(words.read(0, CODE).integer())
        self._gather(words.at(1, CODE), size)
        self.r.call("substitute", size, matrix, matrix.at(size * size), side, result=None)


def _computed(r: Routine, kind: str, a: Value, b: Value | None = None) -> Value:
    """Return what an operation of one or two values gives; see `atwood.codegen.llvm.text`."""
    if b is None:
        match kind:
            case "neg":
                return r.flip(r.high(r.value(-0.0, NUMBER)) >> 31, a)
            case "sqrt":
                return r.sqrt(a)
            case "absolute":
                return r.size(a)
            case "floor":
                return r.floor(a)
            case "logical_not":
                return r.choose(a != 0.0, 0.0, 1.0)
        return r.choose(a > 0.0, r.value(1.0, NUMBER), r.choose(a < 0.0, r.value(-1.0, NUMBER), a * 0.0))
    match kind:
        case "add":
            return a + b
        case "sub":
            return a - b
        case "mul":
            return a * b
        case "div":
            return a / b
        case "minimum":
            return r.choose(a <= b, a, b)
        case "maximum":
            return r.choose(a >= b, a, b)
        case "less":
            condition = a < b
        case "less_equal":
            condition = a <= b
        case "logical_and":
            condition = (a != 0.0) & (b != 0.0)
        case _:
            condition = (a != 0.0) | (b != 0.0)
    return r.choose(condition, 1.0, 0.0)


def _write_small(name: str = "small") -> Routine:
    """Write the elimination of few unknowns with one right-hand side, as `Solver` does it in registers."""
    r = Routine(name, {"n": INTEGER, "a": ADDRESS, "x": ADDRESS}, None)
    n, a, x = r.arguments
    with r.count(n) as k:
        row = a.at(k * n)
        with r.count(n, k + 1) as i:
            other = a.at(i * n)
            with r.when(r.size(other[k]) > r.size(row[k])):
                with r.count(n, k) as j:
                    row[j], other[j] = other[j], row[j]
                x[k], x[i] = x[i], x[k]
        head = row[k]
        row[k] = r.choose(head == 0.0, nan, head)
        with r.count(n, k + 1) as i:
            below = a.at(i * n)
            factor = below[k] / row[k]
            with r.count(n, k + 1) as j:
                below[j] = below[j] - factor * row[j]
            x[i] = x[i] - factor * x[k]
    with r.count(n) as turn:
        i = n - 1 - turn
        row, total = a.at(i * n), r.variable(x[i])
        with r.count(n, i + 1) as j:
            total.now = total.now - row[j] * x[j]
        x[i] = total.now / row[i]
    r.give()
    return r
