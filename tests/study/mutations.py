"""Seeded damage to text files: what a slip of the hand, a bad merge or a torn disk would do to them."""

from __future__ import annotations

import random
import re

JUNK = (
    "nan", "-.inf", ".inf", "-1", "0", "1e400", "1e-400", "9" * 40, "fast", "''", "null", "true", "no", "12:30",
    "2026-11-22", "[1, 2]", "[]", "{}", "{a: 1}", "[[[[]]]]", "0x1F", "1_000", "-0.0", "~", "*a", "&a 3", "!!int x",
    "!!python/object:os.system x", "${oc.env:HOME}", "'\\0'", "é" * 30, "../../etc/passwd", "%", "@", "`", "|", ">",
    "- 1", "? x", "# gone", "\t1", "1e-3", "+5", "5.", ".5", "1,5", "1 2", "3.14 rad", "'30'",
)  # fmt: skip


def mutate(text: str, rng: random.Random) -> str:
    """One or two kinds of damage to a YAML text."""
    for _ in range(rng.randint(1, 2)):
        text = rng.choice(_KINDS)(text, rng)
    return text


def _lines(text, rng):
    lines = text.split("\n")
    return lines, rng.randrange(len(lines))


def _drop_line(text, rng):
    lines, i = _lines(text, rng)
    return "\n".join(lines[:i] + lines[i + 1 :])


def _repeat_line(text, rng):
    lines, i = _lines(text, rng)
    return "\n".join([*lines[: i + 1], *lines[i:]])


def _swap_lines(text, rng):
    lines, i = _lines(text, rng)
    j = rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)


def _indent_line(text, rng):
    lines, i = _lines(text, rng)
    lines[i] = rng.choice(["  ", " ", "\t", "      "]) + lines[i] if rng.random() < 0.7 else lines[i].lstrip()
    return "\n".join(lines)


def _junk_value(text, rng):
    places = list(re.finditer(r":[ \t]+([^\n#{\[]+)", text))
    return _put(text, rng.choice(places).span(1), rng.choice(JUNK)) if places else text


def _junk_number(text, rng):
    places = list(re.finditer(r"(?<![\w.])-?\d+\.?\d*(?![\w.])", text))
    return _put(text, rng.choice(places).span(), rng.choice(JUNK)) if places else text


def _scale_number(text, rng):
    places = list(re.finditer(r"(?<![\w.])-?\d+\.?\d*(?![\w.])", text))
    if not places:
        return text
    place = rng.choice(places)
    factor = rng.choice([-1, 0, 0.5, 0.9, 1.1, 2, 1e3, 1e-3, 1e12])
    return _put(text, place.span(), repr(float(place.group()) * factor))


def _misspell_key(text, rng):
    places = list(re.finditer(r"(\w{2,}):", text))
    if not places:
        return text
    place = rng.choice(places)
    word = place.group(1)
    i = rng.randrange(len(word))
    wrong = rng.choice([word[:i] + word[i + 1 :], word[:i] + "x" + word[i:], word.upper(), word + "_deg"])
    return _put(text, place.span(1), wrong)


def _cut_off(text, rng):
    return text[: rng.randrange(len(text) + 1)]


def _stray_character(text, rng):
    i = rng.randrange(len(text) + 1)
    return text[:i] + rng.choice("{}[]:,-#&*!|>'\"%@`\t\x00\x07\u2028\ufeffé") + text[i:]


def _put(text, span, new):
    return text[: span[0]] + new + text[span[1] :]


_KINDS = (
    _drop_line, _repeat_line, _swap_lines, _indent_line, _junk_value, _junk_value, _junk_number, _junk_number,
    _scale_number, _scale_number, _misspell_key, _cut_off, _stray_character,
)  # fmt: skip
