"""Ways to damage what a command reads; all random, all repeatable."""

import json
import re
from typing import Any

import numpy as np

EXTREMES = (
    "0", "-0.0", "1", "-1", "1e-45", "1e-38", "1e-9", "1e9", "1e30", "1e38", "-1e38", "1e300", "-1e300", "1e-300",
    "nan", "inf", "-inf", "2147483648", "-2147483649", "9" * 20, "9" * 400, "9" * 5000, "0.03", "true", '""',
    '"\\u0000"', '"\\u001b[31m"', '"http://127.0.0.1/a.mp4"', '"/dev/zero"', "[]", "{}", "[[]]", "[0, 0, 0]",
    "[1e38, 1e38, 1e38]", "[1, 2]", "[" * 900 + "]" * 900, '"' + "a" * 5000 + '"', "null",
)  # fmt: skip
"""Values as a scene file, or JSON, would have them."""

_NUMBER = re.compile(r"(?<![\w#.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w#.])")


def damaged_text(text: str, random: np.random.Generator) -> str:
    """A scene file with a number, a value or a line changed; half of the numbers by a power of ten or in their sign."""
    for _ in range(1 + int(random.integers(3))):
        lines = text.splitlines()
        place = int(random.integers(len(lines)))
        kind = int(random.integers(6))
        if kind <= 2 and (numbers := list(_NUMBER.finditer(text))):
            match = numbers[int(random.integers(len(numbers)))]
            scaled = f"{float(match[0]) * random.choice([-1, 1]) * 10.0 ** random.integers(-10, 11):.6g}"
            value = _one_of(EXTREMES, random) if kind == 0 else scaled
            text = text[: match.start()] + value + text[match.end() :]
            continue
        if kind == 3 and " = " in lines[place]:
            lines[place] = f"{lines[place].partition(' = ')[0]} = {_one_of(EXTREMES, random)}"
        elif kind == 4:
            del lines[place]
        else:
            lines.insert(int(random.integers(len(lines))), lines[place])
        text = "\n".join(lines) + "\n"
    return text


def damaged_bytes(content: bytes, random: np.random.Generator) -> bytes:
    """A file with bytes changed, cut out, repeated or cut off; more of them near its beginning."""
    data = bytearray(content)
    kind = int(random.integers(5))
    if kind == 0:
        return bytes(data[: int(random.integers(len(data)))])
    for _ in range(1 + int(random.integers(8))):
        if not data:  # all of a small file is cut out
            break
        near = int(min(random.exponential(200), len(data) - 1)) if random.random() < 0.5 else random.integers(len(data))
        place = int(near)
        if kind == 1:
            data[place] = int(random.integers(256))
        elif kind == 2:
            data[place : place + 4] = random.choice([0, 1, 2**31 - 1, 2**32 - 1]).astype(np.uint32).tobytes()
        elif kind == 3:
            del data[place : place + int(random.integers(1, 64))]
        else:
            data[place:place] = data[place : place + int(random.integers(1, 64))]
    return bytes(data)


def damaged_json(text: str, random: np.random.Generator) -> str:
    """A JSON file with a few of its values replaced, or taken out, wherever they stand."""
    data: Any = json.loads(text)
    raw: list[str] = []
    for _ in range(1 + int(random.integers(3))):
        holders = list(_holders(data))
        holder = holders[int(random.integers(len(holders)))]
        keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = keys[int(random.integers(len(keys)))]
        if random.random() < 0.2:
            del holder[key]
        else:
            holder[key] = f"@{len(raw)}@"
            raw.append(_one_of(EXTREMES, random).replace("nan", "NaN").replace("inf", "Infinity"))
    return re.sub(r'"@(\d+)@"', lambda match: raw[int(match[1])], json.dumps(data))


def extreme_array(array: np.ndarray[Any, Any], random: np.random.Generator) -> np.ndarray[Any, Any]:
    """Another array in place of one: of another type or shape, or with values that none should have."""
    kind = int(random.integers(8))
    changed = np.array(array)
    if kind <= 3 and changed.size and changed.dtype.kind == "f":
        changed.ravel()[int(random.integers(changed.size))] = (np.nan, np.inf, -1e30, 3e38)[kind]
        return changed
    if kind == 4:
        return changed.astype(np.complex64)
    if kind == 5:
        return changed.reshape(-1)
    if kind == 6:
        return np.zeros((*changed.shape, 2), np.float32)
    return np.array(["text"])


def _holders(data: Any) -> Any:
    """All lists and tables in a value that hold anything."""
    if isinstance(data, dict | list) and data:
        yield data
        for value in data.values() if isinstance(data, dict) else data:
            yield from _holders(value)


def _one_of(values: tuple[str, ...], random: np.random.Generator) -> str:
    return values[int(random.integers(len(values)))]
