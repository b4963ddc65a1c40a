"""Seeded damage to robot files in XML: what an editor, an exporter, a merge or a torn disk would do to them."""

from __future__ import annotations

import random
import re

JUNK = (
    "nan", "inf", "-inf", "1e400", "-1e400", "1e39", "1e-400", "-1", "0", "0 0 0", "0 0 0 0", "1 2", "1 2 3 4 5",
    "fast", "", " ", "true", "none", "1,5", "0x1F", "1_000", "+5", "5.", ".5", "1e-3", "-0.0", "1 nan 0", "3.14 rad",
    "é" * 30, "../../etc/passwd", "&lt;", "%s%s%n", "${x}", "$(find pkg)/x", "9" * 40, "free", "ball", "floating",
    "planar", "fixed", "continuous", "base", "world", "1 1 1 1 1 1", "-1 -1 -1",
)  # fmt: skip
TAGS = ("link", "joint", "body", "inertial", "mimic", "equality", "tendon", "plugin", "composite", "include", "geom",
        "freejoint", "replicate", "frame", "attach", "x")  # fmt: skip
_ATTRIBUTE = re.compile(r'([\w:]+)="([^"]*)"')
_NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e-?\d+)?(?![\w.])")
_ELEMENT = re.compile(r"<(\w+)([^<>]*?)(/?)>")


def mutate(text: str, rng: random.Random) -> tuple[str, str]:
    """One or two kinds of damage to a text, and the name of the last."""
    kind = None
    for _ in range(rng.choice([1, 1, 2])):
        kind = rng.choice(_KINDS)
        text = kind(text, rng)
    return text, kind.__name__


def damage_value(text: str, rng: random.Random) -> tuple[str, int]:
    """A junk value in an attribute that is a number, and where in the text."""
    places = [place for place in _ATTRIBUTE.finditer(text) if re.match(r"[-+.\d]", place.group(2))]
    place = rng.choice(places)
    return _put(text, place.span(2), rng.choice(JUNK)), place.start()


def _drop_line(text, rng):
    lines = text.split("\n")
    del lines[rng.randrange(len(lines))]
    return "\n".join(lines)


def _repeat_line(text, rng):
    lines = text.split("\n")
    i = rng.randrange(len(lines))
    return "\n".join([*lines[: i + 1], *lines[i:]])


def _swap_lines(text, rng):
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)


def _junk_value(text, rng):
    places = list(_ATTRIBUTE.finditer(text))
    return _put(text, rng.choice(places).span(2), rng.choice(JUNK)) if places else text


def _junk_number(text, rng):
    places = list(_NUMBER.finditer(text))
    return _put(text, rng.choice(places).span(), rng.choice(JUNK)) if places else text


def _scale_number(text, rng):
    places = list(_NUMBER.finditer(text))
    if not places:
        return text
    place = rng.choice(places)
    factor = rng.choice([-1, 0, 0.5, 0.9, 1.1, 2, 1e3, 1e-3, 1e12])
    return _put(text, place.span(), repr(float(place.group()) * factor))


def _swap_values(text, rng):
    places = list(_ATTRIBUTE.finditer(text))
    if len(places) < 2:
        return text
    first, second = sorted(rng.sample(places, 2), key=lambda place: place.start())
    text = _put(text, second.span(2), first.group(2))
    return _put(text, first.span(2), second.group(2))


def _drop_attribute(text, rng):
    places = list(_ATTRIBUTE.finditer(text))
    return _put(text, rng.choice(places).span(), "") if places else text


def _misspell_word(text, rng):
    places = [*_ATTRIBUTE.finditer(text), *_ELEMENT.finditer(text)]
    if not places:
        return text
    place = rng.choice(places)
    word = place.group(1)
    i = rng.randrange(len(word))
    wrong = rng.choice([word[:i] + word[i + 1 :], word[:i] + "x" + word[i:], word.upper(), word + "s"])
    return _put(text, place.span(1), wrong)


def _other_tag(text, rng):
    places = list(_ELEMENT.finditer(text))
    return _put(text, rng.choice(places).span(1), rng.choice(TAGS)) if places else text


def _stray_element(text, rng):
    places = list(_ELEMENT.finditer(text))
    if not places:
        return text
    end = rng.choice(places).end()
    stray = rng.choice(
        [f'<{rng.choice(TAGS)} name="stray"/>', rng.choice(places).group(), "<!-- x -->", "<![CDATA[x]]>"]
    )
    return _put(text, (end, end), stray)


def _move_element(text, rng):
    places = [place for place in _ELEMENT.finditer(text) if place.group(3)]
    if len(places) < 2:
        return text
    one, other = rng.sample(places, 2)
    first, second = sorted((one.span(), other.span()))
    a, b = text[slice(*first)], text[slice(*second)]
    return text[: first[0]] + b + text[first[1] : second[0]] + a + text[second[1] :]


def _cut_off(text, rng):
    return text[: rng.randrange(len(text) + 1)]


def _stray_character(text, rng):
    i = rng.randrange(len(text) + 1)
    return text[:i] + rng.choice("<>&\"'/=!?-# \t\x00\x07\u2028\ufeffé") + text[i:]


def _put(text, span, new):
    return text[: span[0]] + new + text[span[1] :]


_KINDS = (
    _drop_line, _repeat_line, _swap_lines, _junk_value, _junk_value, _junk_number, _junk_number, _scale_number,
    _scale_number, _scale_number, _swap_values, _drop_attribute, _misspell_word, _other_tag, _stray_element,
    _move_element, _cut_off, _stray_character,
)  # fmt: skip
