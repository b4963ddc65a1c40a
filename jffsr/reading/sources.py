"""Which file and line, or which override, a key of a composed configuration came from."""

from __future__ import annotations

from dataclasses import dataclass, field

from jffsr.reading.yaml_lines import Key, Mark


@dataclass(frozen=True)
class Sources:
    """The marks of every layer, later ones winning; the study's own file is layer `main`, overrides follow.

    Two sources always compare equal, because where a value was written is no part of a configuration's value.
    """

    layers: tuple[dict[Key, Mark], ...] = field(default=(), compare=False)
    main: int = field(default=0, compare=False)

    def mark(self, key: Key) -> Mark | None:
        """The mark of the key, else of the nearest key around it, in the last layer that has it."""
        return self._find(key)[1]

    def order(self, key: Key) -> tuple[int, int]:
        """Sorts keys as a reader meets them: the study's file, the files it builds on, then the overrides."""
        layer, mark = self._find(key)
        reading = layer if layer > self.main else self.main - layer
        return reading, (mark.line or 0) if mark else 0

    def where(self, dotted: str) -> str:
        """`place: key`, or the key alone when nothing is known of it."""
        mark = self.mark(tuple(dotted.split(".")))
        return f"{mark.place}: {dotted}" if mark else dotted

    def _find(self, key: Key) -> tuple[int, Mark | None]:
        for length in range(len(key), -1, -1):
            for layer in range(len(self.layers) - 1, -1, -1):
                mark = self.layers[layer].get(key[:length])
                # Every file has a root; of these only the study's own is a place to look at.
                if mark is not None and (length or layer == self.main):
                    return layer, mark
        return 0, None
