"""What the pages say about spaces, scenario files and planners, written from the code itself.

Before a build, parts are written to `docs/_generated/parts`, which pages include, and the JSON
Schema of scenario files to `docs/_generated/served`, which is put at the root of the site.
"""

import inspect
import json
import re
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

from gymnasium import spaces
from sphinx.application import Sphinx

import uas_coverage_env.env.actions as actions
from uas_coverage_env import Acceleration, Velocity, Wrench, load_scenario, uas_coverage_v0
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.env.observation import OBSERVATION_SIZE, layout_table
from uas_coverage_env.env.rewards import rewards_table
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.flight.registry import describe_planners
from uas_coverage_env.scenario.schema import scenario_schema

GENERATED = Path(__file__).resolve().parents[1] / "_generated"
COMMANDS = {"velocity": Velocity, "acceleration": Acceleration, "wrench": Wrench}
SCENARIO = "village"


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def environment_summary() -> str:
    """The first table of an environment's page, as Farama has it."""
    env = uas_coverage_v0.parallel_env(scenario=SCENARIO)
    agents = env.possible_agents
    observed, acted = env.observation_space(agents[0]), env.action_space(agents[0])
    assert isinstance(observed, spaces.Box)
    assert isinstance(acted, spaces.Box)
    rows = [
        ("Import", "`from uas_coverage_env import uas_coverage_v0`"),
        ("Creation", f'`uas_coverage_v0.parallel_env(scenario="{SCENARIO}")`'),
        ("AEC API", f'`uas_coverage_v0.env(scenario="{SCENARIO}")`'),
        ("Gymnasium", f'`gymnasium.make("UASCoverage-v0", scenario="{SCENARIO}")`'),
        ("Agents", f"one per UAS; in `{SCENARIO}`: " + ", ".join(f"`{a}`" for a in agents)),
        ("Actions", "continuous (`velocity`, `acceleration`, `wrench`), discrete (`waypoint`)"),
        ("Action shape", f"`{acted.shape}`, unless another `action` is asked for"),
        ("Action values", f"{acted.low.min():g} to {acted.high.max():g}"),
        ("Observation shape", f"`{observed.shape}`, the same in every scenario"),
        ("Observation values", f"{observed.low.min():g} to {observed.high.max():g}, finite"),
        ("State shape", f"`{env.state_space.shape}` in `{SCENARIO}`"),
        ("Parallel API", "yes"),
        ("Manual control", "no"),
        ("Render modes", ", ".join(f"`{mode}`" for mode in env.metadata["render_modes"])),
    ]
    return table((env.metadata["name"], ""), rows)


def action_tables() -> str:
    """What each number of each kind of action means, for the shipped vehicle in the village."""
    scenario = load_scenario(SCENARIO)
    rows = []
    for name in actions.ACTION_NAMES:
        kind = actions.actions_of(name, scenario)
        one, all_ = _shown(kind.space()), _shown(kind.joint_space(len(scenario.uas)))
        rows.append((f"`{name}`", f"`{one}`", f"`{all_}`"))
    parts = [table(("`action`", "one UAS", "the swarm as one agent (two UAS)"), rows)]
    for name, command in COMMANDS.items():
        kind = actions.actions_of(name, scenario)
        ranges = kind.ranges[0]
        names = [field.name for field in fields(command)][: kind.size]
        rows = [
            (str(k), f"`{number}`", *(f"{ranges[end][k]:.3g}" for end in _ENDS))
            for k, number in enumerate(names)
        ]
        parts += [f"**{name}**", table(("index", "number", "-1", "0", "1"), rows)]
    choices = [
        (f"0 … {actions.HOME_CHOICE - 1}", "that one of the nearest open waypoints, nearest first"),
        (str(actions.HOME_CHOICE), "home"),
    ]
    parts += ["**waypoint**", table(("choice", "flies to"), choices)]
    return "\n\n".join(parts)


_ENDS = ("lowest", "middle", "highest")


def _shown(space: spaces.Space[Any]) -> str:
    if isinstance(space, spaces.Box):
        return f"Box({space.low.min():g}, {space.high.max():g}, {space.shape}, {space.dtype})"
    return str(space)


def docstring_section(title: str) -> Callable[[], str]:
    """A section of the environment's docstring as Markdown: its list of names as a list."""

    def section() -> str:
        text = inspect.getdoc(CoverageParallelEnv) or ""
        match = re.search(rf"^{title}:\n((?: {{4}}.*\n?|\n)+)", text, re.MULTILINE)
        if match is None:
            raise ValueError(f"the docstring of CoverageParallelEnv has no section {title!r}")
        return inspect.cleandoc(match[1])

    return section


def arguments() -> str:
    """The arguments of the environment as a table, with their defaults."""
    text = docstring_section("Arguments")()
    meanings = dict(re.findall(r"^(\w+): (.*(?:\n +.*)*)", text, re.MULTILINE))
    named = {"observation": "OBSERVATION", "reward": "REWARD"}
    defaults = {
        name: repr(parameter.default)
        for name, parameter in inspect.signature(CoverageParallelEnv.__init__).parameters.items()
        if parameter.kind is not parameter.VAR_KEYWORD and name != "self"
    }
    for field in fields(MissionSettings):
        defaults[field.name] = named.get(field.name, repr(field.default))
    rows = [
        (f"`{name}`", f"`{default}`", " ".join(meanings[name].split()))
        for name, default in defaults.items()
    ]
    return table(("argument", "default", "meaning"), rows)


def scenario_fields() -> str:
    """One table per table of a scenario file."""
    schema = scenario_schema()
    tables = [("The file", schema)]
    for name, entry in schema["properties"].items():
        reference = entry.get("items", entry).get("$ref", "").rpartition("/")[2]
        if reference:
            title = f"`[[{name}]]`" if "items" in entry else f"`[{name}]`"
            tables.append((title, schema["$defs"][reference]))
    schedule = schema["$defs"]["ScheduledVelocity"]
    tables.append(("`[[moving_obstacles.schedule]]`", schedule))
    parts = []
    for title, part in tables:
        rows = [
            (
                f"`{name}`",
                _type(entry),
                "required" if name in part["required"] else "optional",
                entry["description"],
            )
            for name, entry in part["properties"].items()
        ]
        parts += [f"### {title}", part["description"], table(("key", "value", "", "meaning"), rows)]
    return "\n\n".join(parts)


def _type(entry: dict[str, Any]) -> str:
    """A value in words: `number, > 0, ≤ 1`, `3 numbers`, `tables, at least 1`."""
    if "anyOf" in entry:
        return _type(entry["anyOf"][0])
    if "$ref" in entry:
        return "a table"
    if entry["type"] == "array":
        if "prefixItems" in entry:
            return f"{len(entry['prefixItems'])} numbers"
        least = f", at least {entry['minItems']}" if "minItems" in entry else ""
        of = "tables" if "$ref" in entry["items"] else f"entries of {_type(entry['items'])}"
        return f"{of}{least}"
    word = {"number": "number", "integer": "whole number", "string": "text"}[entry["type"]]
    limits = [f"{sign} {entry[key]:g}" for key, sign in _LIMITS.items() if key in entry]
    return ", ".join([word, *limits])


_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def planners() -> str:
    """Every installed planner with its options."""
    parts = []
    for planner in describe_planners():
        if planner.missing:
            raise ValueError(f"planner {planner.name} cannot be described: {planner.missing}")
        parts += [f"**{planner.name}**: {planner.summary}"]
        if planner.options:
            rows = [
                (f"`{o.name}`", o.values.replace("|", "\\|"), o.default, o.description)
                for o in planner.options
            ]
            parts.append(table(("option", "values", "default", "meaning"), rows))
    return "\n\n".join(parts)


PARTS: dict[str, Callable[[], str]] = {
    "environment_summary": environment_summary,
    "observations": lambda: f"{OBSERVATION_SIZE} numbers.\n\n{layout_table()}",
    "actions": action_tables,
    "rewards": rewards_table,
    "infos": docstring_section("Infos"),
    "starting_state": docstring_section("Starting State"),
    "episode_end": docstring_section("Episode End"),
    "version_history": docstring_section("Version History"),
    "arguments": arguments,
    "scenario_fields": scenario_fields,
    "planners": planners,
}


def write_generated(*_: object) -> None:
    """Write all parts, and the schema."""
    for folder in ("parts", "served"):
        (GENERATED / folder).mkdir(parents=True, exist_ok=True)
    for name, text in PARTS.items():
        (GENERATED / "parts" / f"{name}.md").write_text(text() + "\n", encoding="utf-8")
    schema = json.dumps(scenario_schema(), indent=2, ensure_ascii=False)
    served = GENERATED / "served" / "scenario.schema.json"
    served.write_text(schema + "\n", encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    # early: Sphinx looks whether the folder of the schema exists when the configuration is read
    app.connect("config-inited", write_generated, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
