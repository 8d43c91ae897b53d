"""Tables and docstrings on the environments, each made from what decides it."""

import inspect
import re
import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from gymnasium import spaces
from markdown_table import table

from uas_coverage_env import load_scenario, uas_coverage_v0
from uas_coverage_env.env import (
    CoverageParallelEnv,
    CoverageSwarmEnv,
)
from uas_coverage_env.env.actions import (
    CLIMB_CHOICE,
    HOLD_CHOICE,
    HOME_CHOICE,
    ActionKind,
)
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.actions.kinds import ACTION_NAMES
from uas_coverage_env.env.batch.memory import FINAL, LANES
from uas_coverage_env.env.episode.memory import LEARNERS
from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, inside_name
from uas_coverage_env.env.observation import OBSERVATION, grid
from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.env.rendering.screen import RENDER_MODES

SCENARIO = "village"


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
        ("Render modes", ", ".join(f"`{mode}`" for mode in RENDER_MODES)),
    ]
    return table((env.metadata["name"], ""), rows)


def observation_groups(blocks: Sequence[Group] = OBSERVATION) -> str:
    """The groups of an observation, and where each lies."""
    rows, start = [], 0
    for group in blocks:
        n, features = group.width * group.repeats, ", ".join(f.name for f in group.features)
        many = f", {group.repeats} × {group.width} numbers" if group.repeats > 1 else ""
        rows.append((f"{start}-{start + n - 1}", f"`{group.name}`{many}", features))
        start += n
    return table(("index", "group", "features"), rows)


def picture_channels() -> str:
    """What the channels of a picture are."""
    rows = [(str(k), f.name, f.meaning) for k, f in enumerate(grid().features)]
    return table(("channel", "name", "meaning"), rows)


def action_tables(kinds: Sequence[ActionKind]) -> str:
    """What each number of each kind of action means, for the shipped vehicle in the village."""
    scenario = load_scenario(SCENARIO)
    rows = []
    for kind in kinds:
        actions = actions_of(kind, scenario)
        one, all_ = _shown(actions.space()), _shown(actions.joint_space(len(scenario.uas)))
        rows.append((f"`{kind.name}`", f"`{one}`", f"`{all_}`"))
    parts = [table(("`action`", "one UAS", "the swarm as one agent (two UAS)"), rows)]
    for kind in kinds:
        if kind.choices:
            continue
        ranges = actions_of(kind, scenario).ranges[0]
        rows = [
            (str(k), f"`{number}`", *(f"{end:.3g}" for end in ranges[k]))
            for k, number in enumerate(kind.numbers)
        ]
        parts += [f"**{kind.name}**", table(("index", "number", "-1", "0", "1"), rows)]
    choices = [
        (f"0 … {HOME_CHOICE - 1}", "that one of the nearest open waypoints, nearest first"),
        (str(HOME_CHOICE), "home"),
        (str(HOLD_CHOICE), "nowhere: it holds where it is"),
        (str(CLIMB_CHOICE), "where it is flying already, and climbs"),
    ]
    n_choices = max(kind.choices for kind in kinds)
    choices = choices[: n_choices - HOME_CHOICE + 1]
    parts += ["**waypoint**", table(("choice", "flies to"), choices)]
    return "\n\n".join(parts)


def _shown(space: spaces.Space[Any]) -> str:
    if isinstance(space, spaces.Box):
        return f"Box({space.low.min():g}, {space.high.max():g}, {space.shape}, {space.dtype})"
    return str(space)


def environments() -> str:
    """Every environment with the shapes of its observation and actions, for the village."""
    doors: dict[str, tuple[str, str, Callable[..., Any]]] = {
        f'uas_coverage_v0.parallel_env("{SCENARIO}")': (
            "PettingZoo, parallel",
            "one per UAS",
            uas_coverage_v0.parallel_env,
        ),
        f'uas_coverage_v0.env("{SCENARIO}")': (
            "PettingZoo, AEC",
            "one per UAS",
            uas_coverage_v0.env,
        ),
        f'gymnasium.make("UASCoverage-v0", scenario="{SCENARIO}")': (
            "Gymnasium",
            "one for the swarm",
            CoverageSwarmEnv,
        ),
        f'uas_coverage_v0.vector_env(64, "{SCENARIO}")': (
            "Gymnasium, vectorised",
            "one for the swarm, 64 missions",
            partial(uas_coverage_v0.vector_env, 64),
        ),
    }
    rows = []
    for call, (api, agents, door) in doors.items():
        spaces_of = [_spaces(door(scenario=SCENARIO, action=name)) for name in ACTION_NAMES]
        shapes = [f"`{_shape(acted)}`" for _, acted in spaces_of]
        rows.append((f"`{call}`", api, agents, f"`{_shape(spaces_of[0][0])}`", *shapes))
    kinds = (f"`{name}`" for name in ACTION_NAMES)
    return table(("environment", "API", "agents", "observation", *kinds), rows)


def _spaces(env: Any) -> tuple[spaces.Space[Any], spaces.Space[Any]]:
    """The observation and the action space, of the first agent where there are several."""
    if not hasattr(env, "possible_agents"):
        return env.observation_space, env.action_space
    agent = env.possible_agents[0]
    return env.observation_space(agent), env.action_space(agent)


def _shape(space: spaces.Space[Any]) -> str:
    """The shape of a box, the number of choices of a discrete space."""
    if isinstance(space, spaces.Discrete):
        return f"Discrete({space.n})"
    return str(space.shape)


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
    parameters = inspect.signature(CoverageParallelEnv).parameters.values()
    defaults = {parameter.name: parameter.default for parameter in parameters}
    rows = [
        (f"`{name}`", f"`{defaults[name]!r}`", " ".join(meaning.split()))
        for name, meaning in meanings.items()
    ]
    return table(("argument", "default", "meaning"), rows)


def batch_arrays() -> str:
    """The arrays of a batch: from the declarations, and what is said below each field there."""
    places = ((LANES, "batch.lanes"), (LEARNERS, "batch.learners"), (FINAL, "batch.missions.final"))
    rows = []
    for memory, place in places:
        text = inspect.getsource(memory.declaration)
        said = dict(re.findall(r'^    (\w+): Annotated.*?\n    """(.*?)"""', text, re.M | re.S))
        lanes = () if memory is LANES or memory is FINAL else ("L",)
        for field in memory.fields:
            axes = ", ".join(str(axis) for axis in (*lanes, *field.axes))
            kind = "record" if field.dtype.names else str(field.dtype)
            meaning = " ".join(said.get(field.name, "").split())
            rows.append((f"`{place}.{field.name}`", f"({axes})", kind, meaning))
    return table(("array", "shape", "dtype", "meaning"), rows)


def without_meanings(rows: str) -> str:
    """Of a table of features, the columns of indices and names."""
    cut = [line.split("|")[1:3] for line in rows.splitlines()]
    return "\n".join(f"|{index}|{feature}|" for index, feature in cut)


def without_index(rows: str) -> str:
    """A table of features without the column of indices."""
    return "\n".join(f"|{line.split('|', 2)[2]}" for line in rows.splitlines())


_SETTING = re.compile(r"^( +)action: (?:.*\n)+?\1 +.*as in the version\.\n", re.MULTILINE)
"""The settings in a docstring: from the first of them to the end of the last."""


def settings_text() -> str:
    """What `MissionSettings` says of its attributes, under the names of the keyword arguments."""
    text = inspect.getdoc(MissionSettings) or ""
    listed = textwrap.dedent(text.partition("Attributes:\n")[2].partition("\n\n")[0])
    said = dict(each.split(":", 1) for each in re.split(r"^(?=\w)", listed, flags=re.M) if each)
    names = [(name, said[inside_name(name)].rstrip()) for name in MissionKeywords.__annotations__]
    return "".join(f"{name}:{meaning}\n" for name, meaning in names)


def with_settings_written_out(source: str) -> str:
    """Source code in which docstrings say of the settings what `MissionSettings` says."""
    return _SETTING.sub(lambda match: textwrap.indent(settings_text(), match[1]), source)
