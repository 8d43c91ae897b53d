"""Compiles kernels into a wheel where that is asked for, for every x86-64 processor with AVX2.

    HATCH_BUILD_HOOK_ENABLE_CUSTOM=true python -m build --wheel

The wheel is for the Python and the system that build it, and its kernels are for the version of
numba that they are compiled with (`uas_coverage_env/compiled/shipped.py`); with any other they are
compiled when they are first used, as from a wheel without them.
"""

import json
import os
import platform
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_PROGRAM = ("-m", "uas_coverage_env")


class Kernels(BuildHookInterface):
    """Adds the archive of kernels to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile what the first commands and environments of a user need."""
        if version == "editable":  # such an installation has a cache beside its sources
            return
        if platform.machine() not in ("x86_64", "AMD64"):
            self.app.abort(f"kernels are compiled for x86-64, not for {platform.machine()}")
        root = Path(self.root)
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        self._announce_plugins(folder)
        shipped = runpy.run_path(str(root / "uas_coverage_env/compiled/shipped.py"))
        sources = [folder, root, root / "baselines", root / "agents"]
        environment = {
            **os.environ,
            "NUMBA_CPU_NAME": shipped["LEVEL"],
            "NUMBA_CPU_FEATURES": "",
            "NUMBA_CACHE_DIR": str(folder / "cache"),
            "PYTHONPATH": os.pathsep.join(map(str, sources)),
        }
        announced = self.metadata.core.entry_points["uas_coverage.planners"]
        planners = [word for name in announced for word in ("--planner", name)]
        steps = runpy.run_path(str(root / "benchmarks/first_step.py"))
        for arguments in (
            (*_PROGRAM, "planner", "warm-up", "--environments", *planners),
            (*_PROGRAM, "demo", "--no-open", "--out", str(folder / "demo")),
            *(
                ("-c", steps["PROGRAM"], kind, json.dumps(settings), version)
                for version in steps["VERSIONS"]
                for kind in steps["KINDS"]
                for settings in steps["SETTINGS"].values()
            ),
        ):
            subprocess.run([sys.executable, *arguments], env=environment, cwd=folder, check=True)
        archive = folder / shipped["ARCHIVE"].name
        with ZipFile(archive, "x", ZIP_DEFLATED) as kernels:
            for path in sorted((folder / "cache").rglob("*.nbc")):
                if not path.name.endswith(".part.nbc"):  # of which machine code has been made
                    kernels.write(path, path.name)
        place = shipped["ARCHIVE"].relative_to(root).as_posix()
        build_data["force_include"][str(archive)] = place
        build_data["infer_tag"], build_data["pure_python"] = True, False

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what lies in the wheel now."""
        if version != "editable":
            self._folder.cleanup()

    def _announce_plugins(self, folder: Path) -> None:
        """Planners are found by entry points, which a package has once it is installed."""
        project = self.metadata.core
        information = folder / f"{project.name.replace('-', '_')}-{project.version}.dist-info"
        information.mkdir()
        (information / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {project.name}\nVersion: {self.metadata.version}\n"
        )
        groups = [
            f"[{group}]\n" + "".join(f"{name} = {where}\n" for name, where in points.items())
            for group, points in project.entry_points.items()
        ]
        (information / "entry_points.txt").write_text("\n".join(groups))
