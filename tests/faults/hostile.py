"""What files may hold that should not: values and texts, and strategies that put them into valid files."""

import json
from dataclasses import dataclass
from typing import Any, Final

from hypothesis import strategies as st


@dataclass(frozen=True)
class Raw:
    """A piece of text that stands in a file as it is."""

    text: str

    def __repr__(self) -> str:
        return f"Raw({self.text[:60]!r})"


# fmt: off
NUMBERS: Final = (
    "0", "-0", "-0.0", "-1", "1", "3", "0.5", "7.3", "120", "1e-9", "1e9", "1e12", "1e17", "1e308", "1e309",
    "-1e308", "5e-324", "9" * 400, "9" * 5000, "0x7fffffffffffffff", "0o17", "017", "1_000", "1e", "+.5",
)
YAML_SNIPPETS: Final = (
    *NUMBERS,
    ".nan", ".inf", "-.inf", "nan", "null", "~", "", "true", "yes", "on", "2026-01-01", "12:30:45", "0b11",
    "''", '""', "a", "'a'", '"\\0"', '"\\e[31m"', '"\\ud800"', '"\\n"', "..", "../x", "/", "~nobody", "a/b",
    "[]", "{}", "[1]", "[1, 2]", "[[0, 0], [1, 0], [0, 1]]", "{a: 1}", "{? [a] : b}", "{a: 1, a: 2}",
    "[" * 30 + "]" * 30, "[" * 5000, "{a: " * 50 + "1" + "}" * 50, "x" * 2000, "'" + "y" * 100_000 + "'",
    "&a [1]", "*a", "&a [*a]", "{<<: {a: 1}}", "{<<: *a}", "!!int 3", "!!python/object:os.system [true]",
    "!!python/object/apply:os.system ['true']", "!!binary aGk=", "!!set {a}", "!x y", "%", "@", "`", "|", ">",
    "[" + "0, " * 3000 + "0]", "{circle: {center_m: [0, 0], radius_m: 1}}", "aerosonde", "rolling_window",
    "bug2", "tustin", "step", "[10, 5]", "[0, 1e7]", "[-1e6, -1e6, 1e6, 1e6]", "é", "\u2028", "日本",
)
CAMPAIGN_SNIPPETS: Final = (
    *NUMBERS,
    "{density_1pkm2: 400}", "{size_m: [1e6, 1e6], density_1pkm2: 0.001}", "{cells: [60, 50]}", "{turns: 50}",
    "{uniform: [0, 1]}", "{uniform: [1, 0]}", "{uniform: [-1e12, 1e12]}", "{uniform: [0, .nan]}",
    "{uniform: [0]}", "{uniform: [0, 1], choice: [1]}", "{choice: []}", "{choice: [[], {}, null, true]}",
    "{normal: {mean: 0, sigma: 0}}", "{normal: {mean: 0, sigma: 1e-12, least: 1}}",
    "{normal: {mean: 1e12, sigma: 5e-324, most: 1e12}}", "{normal: {mean: 0, sigma: 1, least: 9, most: 8}}",
    "[null, 0, a, [1], {a: 1}]", "[" + "0, " * 1500 + "1]", "[0, 0]", "{x: [1, 2]}", "{seed: [1]}",
    "{obstacles: [[]]}", "{'obstacles[0].circle.radius_m': [1, 2]}", "{area.bounds_m: [[0, 0, 1, 1]]}",
    "{forest: {density_1pkm2: 1e6}}", "{forest: {density_1pkm2: 400}}", "[{forest: {}}, {forest: {}}]",
    "{forest: {density_1pkm2: 40, gap_m: 0, radius_m: [0.1, 1000]}}", "{forest: {size_m: [1, 1e6]}}",
    "{forest: {size_m: [1e6, 1e6], density_1pkm2: 0.001, radius_m: [1e-300, 1]}}", "{forest: {room_m: 1e6}}",
    "{forest: {density_1pkm2: 50, trunks: [999, 1000]}}", "{forest: {trunks: [0, 1001]}}", "{circles: {}}",
    "independent", "1000000", "failures", "[aerosonde_forest, aerosonde_forest]",
    "[/]", "[/dev]", "[.]", "[s.yaml]", "[/dev/zero]", "[no_such.yaml]", "['a\\0b']", "[" + "x/" * 3000 + "]",
)
KEYS: Final = (
    "x", "", "<<", "[0]", "0", "a.b", "'a b'", '"\\n"', '"\\0"', "z" * 200, "? [1]", "&k k", "!!str k",
    "schema",
    "name", "circle", "polygon", "velocity_mps", "active_s", "clearance_m", "kind", "origin", "é", "null", "~",
)
JSON_SNIPPETS: Final = (
    *(text for text in NUMBERS if text[0] != "+"),
    "NaN", "Infinity", "-Infinity", "null", "true", '""', '"a"', '"16"', '"\\u0000"', '"\\ud800"', "[]", "{}",
    "[0, 0]", "[8.1, 47.1]", "[8.1, 47.1, 300]", '{"type": "LineString"}', '"' + "x" * 3000 + '"', "'a'", "",
    "[" * 30 + "]" * 30, "[" * 100_000, '{"a": ' * 3000 + "1" + "}" * 3000, '"Feature"',
    '"GeometryCollection"',
)
CELLS: Final = (
    *NUMBERS,
    "", "nan", "inf", "-inf", "a", '"', '"a', "'", ",", ",,,,", "\t", "\r", "\x0b", "\x1c", "\x85", "\u2028",
    "é",
    "x" * 140_000, "QGC WPL 110", "x_m,y_m", "lat,lon", "47.0", "8.0", "16", "22", "3", "٣", "1e5", "\x1b[31m",
)
PIECES: Final = (
    b"\t", b"\0", b"\xef\xbb\xbf", b"\xff\xfe", b"\xff", b"\xc3", b"\xed\xa0\x80", b"\r", b"\r\n", b"\n", b" ",
    b"---\n", b"...\n", b"%YAML 1.1\n", b"%TAG ! tag:x,2000:\n", b"? ", b": ", b"- ", b"|", b">", b"{", b"}",
    b"[", b"]", b",", b'"', b"'", b"#", b"&a ", b"*a", b"!!", b"<<: *a\n", b"\x1b[31m", b"\xc2\x85", b"\\",
    b"\xe2\x80\xa8", b"\x7f", b"\x01", b"a" * 5000, b"[" * 5000, b"\n" * 5000, b"1e999", b".nan",
)
# fmt: on


def places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where there is something in nested dicts and lists."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [at, *(place for key, each in inner for place in places(each, (*at, key)))]


def _spoilt(value: Any, at: tuple[Any, ...], how: str, piece: str) -> Any:
    """A copy of nested dicts and lists with one place spoilt."""
    if isinstance(value, dict | list) and len(at) > 1:
        return _with(value, at[0], _spoilt(value[at[0]], at[1:], how, piece))
    if not at or isinstance(value, Raw):
        return Raw(piece)
    key = at[0]
    if how == "value":
        return _with(value, key, Raw(piece))
    if isinstance(value, list):
        return {"left out": value[:key] + value[key + 1 :], "twice": [*value, value[key]]}.get(
            how, [*value[:key], Raw(piece), *value[key:]]
        )
    if how == "left out":
        return {name: each for name, each in value.items() if name != key}
    if how == "twice":
        return {**value, Raw(str(key)): value[key]}
    if how == "wrapped":
        return {**value, key: [value[key]]}
    return {(Raw(piece[:300]) if name == key else name): each for name, each in value.items()}


def _with(value: Any, key: Any, new: Any) -> Any:
    if isinstance(value, dict):
        return {**value, key: new}
    return [*value[:key], new, *value[key + 1 :]]


@st.composite
def spoilt(draw: st.DrawFn, valid: Any, snippets: tuple[str, ...], keys: tuple[str, ...]) -> Any:
    """A valid document with up to three things wrong."""
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.sampled_from(places(valid)))
        how = draw(st.sampled_from(("value", "value", "value", "left out", "twice", "wrapped", "key")))
        valid = _spoilt(valid, at, how, draw(st.sampled_from(keys if how == "key" else snippets)))
    return valid


@st.composite
def spoilt_bytes(draw: st.DrawFn, valid: bytes) -> bytes:
    """A valid file with pieces put in, cut out, repeated; cut off, or in another encoding."""
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(valid)))
        until = min(len(valid), at + draw(st.sampled_from((0, 0, 1, 7, 100, 5000))))
        piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=6), st.just(valid[at:until] * 2)))
        valid = valid[:at] + piece + valid[until:]
    encoding = draw(st.sampled_from(("utf-8",) * 8 + ("utf-16", "utf-32", "latin-1", "utf-8-sig")))
    return valid.decode("utf-8", "replace").encode(encoding, "replace") if encoding != "utf-8" else valid


def as_yaml(value: Any) -> str:
    """Nested dicts, lists and raw pieces in YAML's flow style, the outermost mapping in block style."""
    if isinstance(value, dict):
        return "\n".join(f"{_flow(key)}: {_flow(each)}" for key, each in value.items()) + "\n"
    return _flow(value)


def _flow(value: Any) -> str:
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def as_json(value: Any) -> str:
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_name(key)}: {as_json(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_json, value)) + "]"
    return json.dumps(value)


def _name(key: Any) -> str:
    return json.dumps(key.text if isinstance(key, Raw) else key)
