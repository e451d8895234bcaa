"""What a key of a scenario takes, as the format's JSON Schema has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from harness.files.strict_yaml import Loc
from harness.scenario.scenario import scenario_schema


def takes_whole_numbers(loc: Loc) -> bool:
    """Whether a key takes whole numbers and no others; of planners' own keys, of any planner's that has it."""
    schema = _schema()
    found = [schema]
    for step in loc:
        found = [inner for each in found for inner in _inside(each, step, schema["$defs"])]
    return any(each.get("type") == "integer" for each in found)


@cache
def _schema() -> dict[str, Any]:
    return scenario_schema()


def _inside(schema: Mapping[str, Any], step: str | int, definitions: Mapping[str, Any]) -> Iterator[Any]:
    """What stands at a step in any variant of a schema, variants of it one by one."""
    for variant in _variants(schema, definitions):
        inner = variant.get("properties", {}).get(step) if isinstance(step, str) else variant.get("items")
        if isinstance(inner, Mapping):
            yield from _variants(inner, definitions)


def _variants(schema: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """A schema, or those that it refers to or chooses from."""
    if "$ref" in schema:
        yield from _variants(definitions[schema["$ref"].rsplit("/", 1)[-1]], definitions)
        return
    chosen = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    for each in chosen:
        yield from _variants(each, definitions)
    if not chosen:
        yield schema
