"""Tables of the pages that say what the code says: spaces, scenario files, planners.

    python docs/tables.py            renew them, `scenario.schema.json`, and what the docstrings of
                                     the environments say of their settings
    python docs/tables.py --check    name the pages that are stale, and exit 1 where there are any

Tables are committed, so that a code host shows them too. They stand in any page of `docs/`, and
in any README, between `<!-- generated: NAME -->` and `<!-- end of NAME -->`; `PARTS` has the names.
"""

import importlib
import inspect
import json
import re
import sys
import tomllib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from environment_tables import (
    action_tables,
    arguments,
    batch_arrays,
    docstring_section,
    environment_summary,
    environments,
    observation_groups,
    picture_channels,
    with_settings_written_out,
    without_index,
    without_meanings,
)
from families_picture import families_table
from markdown_table import table
from uas_coverage_agents.training.settings import Environment, LearnerSettings

from uas_coverage_env.env import (
    CoverageBatch,
    CoverageParallelEnv,
    CoverageSwarmEnv,
    CoverageVectorEnv,
)
from uas_coverage_env.env.actions import ACTIONS, ACTIONS_V1
from uas_coverage_env.env.api.aec import in_turns
from uas_coverage_env.env.gpu.refused import REFUSED
from uas_coverage_env.env.observation import OBSERVATION_SIZE, full_state, local
from uas_coverage_env.env.observation.layout import layout_table
from uas_coverage_env.env.observation.ways import WAYS
from uas_coverage_env.env.rewards.terms import rewards_table
from uas_coverage_env.env.versions import V1
from uas_coverage_env.flight import Why, figures
from uas_coverage_env.flight.registry import GROUP, KINDS, PlannerDescription, describe_planners
from uas_coverage_env.leaderboard.scores import columns
from uas_coverage_env.planning.reserves import RESERVES, Reserve
from uas_coverage_env.scenario.events import EVENT_KINDS
from uas_coverage_env.scenario.schema import scenario_schema
from uas_coverage_env.tasks import LESSONS

DOCS = Path(__file__).resolve().parent
SCHEMA = DOCS / "scenario.schema.json"


def scenario_fields() -> str:
    """One table per table of a scenario file, but for events."""
    schema = scenario_schema()
    tables = [("The file", schema)]
    for name, entry in schema["properties"].items():
        entry = entry.get("anyOf", [entry])[0]  # or null: it may be left out
        reference = entry.get("items", entry).get("$ref", "").rpartition("/")[2]
        if reference:
            title = f"`[[{name}]]`" if "items" in entry else f"`[{name}]`"
            tables.append((title, schema["$defs"][reference]))
    nested = {
        "`[[uas.sensors]]`": "Sensor",
        "`[[moving_obstacles.schedule]]`": "ScheduledVelocity",
        "`[[walls.doors]]`": "Door",
        "`[[wind.gusts]]`": "Gust",
        "`[wind.random_gusts]`": "RandomGusts",
    }
    tables += [(title, schema["$defs"][model]) for title, model in nested.items()]
    return _keys(tables)


def event_fields() -> str:
    """The keys of all kinds of event, those that kinds share once."""
    parts = scenario_schema()["$defs"]
    having: dict[tuple[str, str, str, str], list[str]] = {}
    for kind in EVENT_KINDS:
        part = parts[kind.__name__]
        own = dict(part["properties"])
        name = own.pop("kind")["const"]
        for key, entry in own.items():
            having.setdefault(_key(key, entry, part), []).append(f"`{name}`")
    everyone = len(EVENT_KINDS)
    rows = [
        (key, "all" if len(kinds) == everyone else ", ".join(kinds), *rest)
        for (key, *rest), kinds in having.items()
    ]
    return table(("key", "of `kind`", "value", "", "meaning"), rows)


def _keys(tables: list[tuple[str, dict[str, Any]]]) -> str:
    parts = []
    for title, part in tables:
        rows = [_key(name, entry, part) for name, entry in part["properties"].items()]
        parts += [f"## {title}", part["description"]]
        if rows:
            parts += [table(("key", "value", "", "meaning"), rows)]
    return "\n\n".join(parts)


def _key(name: str, entry: dict[str, Any], part: dict[str, Any]) -> tuple[str, str, str, str]:
    """A row: the key, its values, whether it is needed, what it means."""
    needed = "required" if name in part.get("required", ()) else "optional"
    return f"`{name}`", _type(entry), needed, entry["description"]


def _type(entry: dict[str, Any]) -> str:
    """A value in words: `number, > 0, ≤ 1`, `3 numbers`, `tables, at least 1`."""
    if "anyOf" in entry:
        return _type(entry["anyOf"][0])
    if "$ref" in entry:
        return "a table"
    if "const" in entry:
        return f'`"{entry["const"]}"`'
    if "enum" in entry:
        return " or ".join(f'`"{value}"`' for value in entry["enum"])
    if entry["type"] == "array":
        if "prefixItems" in entry:
            most = len(entry["prefixItems"])
            least = "" if entry["minItems"] == most else f"{entry['minItems']} or "
            return f"{least}{most} numbers"
        least = f", at least {entry['minItems']}" if "minItems" in entry else ""
        tables = {"$ref", "oneOf"} & set(entry["items"])
        of = "tables" if tables else f"entries of {_type(entry['items'])}"
        return f"{of}{least}"
    if entry["type"] == "object":
        return "tables by name"
    word = {
        "number": "number",
        "integer": "whole number",
        "string": "text",
        "boolean": "true or false",
    }[entry["type"]]
    limits = [f"{sign} {entry[key]:g}" for key, sign in _LIMITS.items() if key in entry]
    return ", ".join([word, *limits])


_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def planners() -> str:
    """Every planner of this repository with its options."""
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    ours = {name for group in (GROUP, KINDS) for name in project["entry-points"][group]}
    families: dict[str, list[PlannerDescription]] = {}
    for planner in describe_planners():
        if planner.name.partition(":")[0] not in ours:
            continue
        if planner.missing:
            raise ValueError(f"planner {planner.name} cannot be described: {planner.missing}")
        kin = _FAMILY if planner.name.startswith(_FAMILY) else planner.name
        families.setdefault(kin, []).append(planner)
    return "\n\n".join(map(_options, families.values()))


_FAMILY = "milp-mpc"
"""What the names of planners begin with that share a table, as they share most options."""


def _options(family: Sequence[PlannerDescription]) -> str:
    """One table, with a column for each planner's defaults; of a planner alone, just `default`."""
    defaults: dict[tuple[str, str, str], dict[str, str]] = {}
    for planner in family:
        for o in planner.options:
            key = (o.name, o.values, o.description)
            defaults.setdefault(key, {})[planner.name] = o.default
    columns = ["default"] if len(family) == 1 else [f"`{planner.name}`" for planner in family]
    rows = [
        (f"`{name}`", values.replace("|", "\\|"), *(of.get(p.name, "") for p in family), meaning)
        for (name, values, meaning), of in sorted(defaults.items(), key=lambda it: -len(it[1]))
    ]
    lines = [f"**{planner.name}**: {planner.summary}" for planner in family]
    if rows:
        lines.append(table(("option", "values", *columns, "meaning"), rows))
    return "\n\n".join(lines)


def flight_figures() -> str:
    """Every figure of a flight: its name, its key in the file, what it is."""
    rows = [
        (
            f"`{name}`",
            f"`{key}`" if (key := each.key_in_file) else "",
            each.meaning,
        )
        for name, each in FIGURES.items()
    ]
    return table(("figure", "in `summary.json`", ""), rows)


def comparison_columns() -> str:
    """Every column of a comparison: its heading, its name in the files, what it is."""
    rows = [
        (f"*{each.heading}*" if each.table else "", f"`{name}`", each.meaning)
        for name, each in columns().items()
    ]
    return table(("in the tables", "in the files", ""), rows)


FIGURES = {each.name: each for each in figures.FIGURES}
"""Those of this package, whatever others are installed."""

OPERATIONS = (
    *("area_roles", "area_words", "plan_items", "town_kinds", "town_not_read"),
    *("exported_files", "autopilot_parameters", "autopilot_failures", "log_formats", "log_rules"),
    *("stream_troubles", "stream_failsafes", "stream_reactions", "stream_limits"),
)
"""Functions of operations_tables.py, which needs the extra `ops`."""


def of_operations(name: str) -> str:
    """One of these tables."""
    return table(*getattr(importlib.import_module("operations_tables"), name)())


def reserves() -> str:
    """What routes allow for, and keep of the flying time."""
    numbers = [name for name in Reserve._fields if name not in ("of", "measured")]
    rows = [
        (f"`{name}`", *(f"{getattr(one, column):g}" for column in numbers), one.of, one.measured)
        for name, one in RESERVES.items()
    ]
    return table(("reserve", *(f"`{name}`" for name in numbers), "of", "measured by"), rows)


def learner_settings() -> str:
    """The keys of a file of `uas-coverage train`."""
    text = re.split(r"^Attributes:\n", inspect.getdoc(LearnerSettings) or "", flags=re.MULTILINE)[1]
    meanings = dict(re.findall(r"^(\w+): (.*(?:\n +.*)*)", inspect.cleandoc(text), re.MULTILINE))
    rows = []
    for name, field in LearnerSettings.model_fields.items():
        default = field.get_default(call_default_factory=True)
        plain = isinstance(default, str | int)
        shown = "required" if field.is_required() else f"`{json.dumps(default)}`" if plain else ""
        rows.append((f"`{name}`", shown, " ".join(meanings[name].split())))
    chosen = ", ".join(f"`{name}`" for name in Environment.model_fields)
    return f"{table(('key', 'default', 'meaning'), rows)}\n\n`[environment]` may hold {chosen}."


PARTS: dict[str, Callable[[], str]] = {
    "batch_arrays": batch_arrays,
    "environments": environments,
    "environment_summary": environment_summary,
    "observation_groups": observation_groups,
    "observation_groups_v1": partial(observation_groups, V1.observation),
    "observation_ways": lambda: without_index(layout_table((WAYS,))),
    "observations": lambda: f"{OBSERVATION_SIZE} numbers.\n\n{layout_table()}",
    "observation_local": lambda: without_meanings(layout_table(local())),
    "observation_grid": picture_channels,
    "observation_full_state": lambda: layout_table(full_state(2, 3, 1)),
    "actions": partial(action_tables, ACTIONS),
    "actions_v1": partial(action_tables, [kind for kind in ACTIONS_V1 if kind not in ACTIONS]),
    "rewards": rewards_table,
    "rewards_v1": partial(rewards_table, V1.reward),
    "infos": docstring_section("Infos"),
    "starting_state": docstring_section("Starting State"),
    "episode_end": docstring_section("Episode End"),
    "version_history": docstring_section("Version History"),
    "arguments": arguments,
    "scenario_fields": scenario_fields,
    "event_fields": event_fields,
    "families": families_table,
    "planners": planners,
    "figures": flight_figures,
    "reserves": reserves,
    "comparison_columns": comparison_columns,
    "learner_settings": learner_settings,
    "not_on_a_gpu": lambda: table(
        ("does not run on a GPU", "instead"), [(row.what, row.instead) for row in REFUSED]
    ),
    "lessons": lambda: table(
        ("lesson", "what is easier"), [(f"`{name}`", one.meaning) for name, one in LESSONS.items()]
    ),
    "left_open": lambda: table(("`why`", "what it means"), [(f"`{w}`", w.meaning) for w in Why]),
    **{name: partial(of_operations, name) for name in OPERATIONS},
}


_MARKED = re.compile(
    r"^<!-- generated: (?P<name>\w+) -->\n(?P<text>.*?)^<!-- end of (?P=name) -->$",
    re.MULTILINE | re.DOTALL,
)


def renewed(text: str) -> str:
    """The text of a page with what stands between its marks made anew.

    Raises:
        ValueError: A mark names no part, or has no end.
    """
    found = [match["name"] for match in _MARKED.finditer(text)]
    opened = re.findall(r"^<!-- generated: (.*) -->$", text, re.MULTILINE)
    if wrong := [name for name in opened if name not in found or name not in PARTS]:
        raise ValueError(f"{wrong[0]!r} has no end, or is none of {', '.join(PARTS)}")
    return _MARKED.sub(
        lambda match: (
            f"<!-- generated: {match['name']} -->\n\n"
            f"{PARTS[match['name']]()}\n\n<!-- end of {match['name']} -->"
        ),
        text,
    )


def renewed_files() -> dict[Path, str]:
    """What every file with something generated in it should hold."""
    pages = [*sorted(DOCS.glob("*.md")), *(DOCS.parent / name for name in _READMES)]
    files = {}
    for page in pages:
        text = page.read_text(encoding="utf-8")
        if "<!-- generated: " in text:
            files[page] = renewed(text)
    for module in _SAY_SETTINGS:
        source = Path(inspect.getfile(module))
        files[source] = with_settings_written_out(source.read_text(encoding="utf-8"))
    return {**files, SCHEMA: json.dumps(scenario_schema(), indent=2, ensure_ascii=False) + "\n"}


_SAY_SETTINGS = (CoverageParallelEnv, CoverageSwarmEnv, CoverageVectorEnv, CoverageBatch, in_turns)
"""In the files of these are docstrings that name all settings."""

_READMES = ("README.md", "baselines/README.md", "agents/README.md", "benchmarks/README.md")


def main(*arguments: str) -> int:
    """Renew or check all files; the exit code."""
    if arguments not in ((), ("--check",)):
        sys.stderr.write("usage: python docs/tables.py [--check]\n")
        return 2
    stale = {
        path: text
        for path, text in renewed_files().items()
        if not path.exists() or path.read_text(encoding="utf-8") != text
    }
    for path, text in stale.items():
        sys.stdout.write(f"{path.relative_to(DOCS.parent)}\n")
        if not arguments:
            path.write_text(text, encoding="utf-8", newline="\n")
    return 1 if arguments and stale else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
