"""What is compared: planners and policies by name, each with all its options."""

import itertools
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Planner, load_planner
from uas_coverage_env.flight.registry import options_of
from uas_coverage_env.leaderboard.hashing import source_hash

_NO_LABEL = re.compile(r"[^\w.+-]")
_LABELLED = re.compile(r"([\w.+-]+)=(.+)", re.DOTALL)


@dataclass(frozen=True)
class PlannerSpec:
    """A planner as it is flown.

    Attributes:
        label: Under which it stands in the tables.
        planner: Its name, as `load_planner` takes it.
        options: Every option, defaults filled in, as plain data.
        fingerprint: Changes with the data it flies by (a policy's weights); empty where none.
        package: The package that its code is in.
        own_sha256: Hash of the user's own modules that it flies by (MODULE:CLASS of planner and
            options): an edited planner is another one. Empty where there are none.
    """

    label: str
    planner: str
    options: Mapping[str, Any]
    fingerprint: str
    package: str
    own_sha256: str = field(default="", kw_only=True)

    @classmethod
    def named(cls, label: str, planner: str, options: Mapping[str, str] | None = None) -> Self:
        """A planner by its name, with the options that are given and the defaults of the others.

        Raises:
            InputError: An unknown planner or option.
        """
        made = load_planner(planner, options)
        all_options = options_of(made)
        return cls(
            label,
            planner,
            all_options,
            fingerprint=getattr(made, "fingerprint", ""),
            package=type(made).__module__.partition(".")[0],
            own_sha256=_own_sha256(planner, all_options),
        )

    def identity(self) -> dict[str, Any]:
        """What its flights depend on; where a policy's folder lies does not matter."""
        kind, _, argument = self.planner.partition(":")
        planner = kind if argument and self.fingerprint else self.planner
        return {
            "planner": planner,
            "options": dict(self.options),
            "fingerprint": self.fingerprint,
            **({"own_sha256": self.own_sha256} if self.own_sha256 else {}),
        }

    def load(self) -> Planner:
        """Make the planner.

        Raises:
            InputError: It cannot be made, or flies by other data by now.
        """
        planner = load_planner(self.planner, self.options)
        now = getattr(planner, "fingerprint", ""), _own_sha256(self.planner, self.options)
        if now != (self.fingerprint, self.own_sha256):
            raise InputError(f"{self.label}: its files have changed since the sweep has begun")
        return planner


def _own_sha256(planner: str, options: Mapping[str, Any]) -> str:
    listed = [value if isinstance(value, list) else [value] for value in options.values()]
    named = [str(text).partition(":") for text in itertools.chain([planner], *listed)]
    modules = {name.partition(".")[0] for name, colon, _ in named if colon and name in sys.modules}
    own = {name for name in modules if not name.startswith("uas_coverage_")}
    return source_hash(own) if own else ""


def planner_specs_of(
    texts: Iterable[str], options: Iterable[str], vary: Iterable[str] = ()
) -> dict[str, PlannerSpec]:
    """The planners that the command line names, by label, in their order.

    Args:
        texts: Each one or several (comma between them) of PLANNER or LABEL=PLANNER.
        options: LABEL:KEY=VALUE each; the label of a planner without one is its name.
        vary: KEY=VALUE,VALUE,... of all planners, or LABEL:KEY=... of one: it is flown with every
            combination of the values, which its labels name.

    Raises:
        InputError: No planner, an unknown one or an unknown option, a label or key given twice, a
            value that does not fit.
    """
    planners: dict[str, str] = {}
    for item in (part.strip() for text in texts for part in text.split(",")):
        labelled = _LABELLED.fullmatch(item)
        label, planner = labelled.groups() if labelled else (item, item)
        if not item:
            continue
        if label in planners:
            raise InputError(
                f"--planners: {label!r} is given twice; give the second one a label of its own, "
                f"as in other={planner}"
            )
        planners[label] = planner
    if not planners:
        raise InputError("--planners: names none; give some, as in nearest-waypoint,lawnmower")
    given: dict[str, dict[str, str]] = {label: {} for label in planners}
    for text in options:
        label, key, value = _option(text, list(planners))
        if key in given[label]:
            raise InputError(f"--option {label}:{key} is given twice; give it once")
        given[label][key] = value
    varied = _varied(vary, list(planners))
    specs: dict[str, PlannerSpec] = {}
    for label, planner in planners.items():
        for key in varied[label].keys() & given[label].keys():
            raise InputError(f"--vary {key}: --option {label}:{key} gives it, too; leave one out")
        for values in itertools.product(*varied[label].values()):
            chosen = dict(zip(varied[label], values, strict=True))
            parts = [label, *(f"{key}-{value}" for key, value in chosen.items())]
            name = "+".join([label, *(_NO_LABEL.sub("-", part) for part in parts[1:])])
            if name in specs:
                raise InputError(f"--vary: {parts[1:]} and another choice are both called {name!r}")
            specs[name] = PlannerSpec.named(name, planner, {**given[label], **chosen})
    return specs


def varied_keys(vary: Iterable[str]) -> list[str]:
    """The names of the options that are varied."""
    return list(dict.fromkeys(_setting(text)[1] for text in vary))


def _varied(vary: Iterable[str], labels: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    """Label -> option -> its values."""
    found: dict[str, dict[str, list[str]]] = {label: {} for label in labels}
    for text in vary:
        label, key, listed = _setting(text)
        values = [value.strip() for value in listed.split(",") if value.strip()]
        if not (key and values):
            raise InputError(
                f"--vary {text!r}: should be KEY=VALUE,VALUE,... as in weight_energy=0,0.6"
            )
        if label and label not in labels:
            raise InputError(f"--vary {text!r}: no {label!r} in --planners {','.join(labels)}")
        for each in [label] if label else labels:
            if key in found[each]:
                raise InputError(f"--vary {key} is given twice; give all of its values at once")
            found[each][key] = list(dict.fromkeys(values))
    return found


def _option(text: str, labels: Sequence[str]) -> tuple[str, str, str]:
    label, key, value = _setting(text)
    if not (label and key and "=" in text):
        raise InputError(
            f"--option {text!r}: should be PLANNER:KEY=VALUE, as in {labels[0]}:horizon=12"
        )
    if label not in labels:
        raise InputError(f"--option {text!r}: no {label!r} in --planners {','.join(labels)}")
    return label, key, value


def _setting(text: str) -> tuple[str, str, str]:
    """LABEL, KEY and VALUE of LABEL:KEY=VALUE; empty where it is not there."""
    left, _, value = (part.strip() for part in text.partition("="))
    label, _, key = (part.strip() for part in left.rpartition(":"))
    return label, key, value
